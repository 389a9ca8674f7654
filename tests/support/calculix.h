#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <map>
#include <vector>

#include "palpate/core/geometry.h"
#include "palpate/elastic/material.h"

namespace palpate::test {

/// Whether CalculiX (`ccx`) is on the search path.
bool calculix_is_installed();

/// What CalculiX prints for the end of its step, seven digits.
struct CalculixAnswer {
  Eigen::VectorXd u;             ///< displacement of every node, mm
  Eigen::VectorXd reaction;      ///< force that holds every node where it is, N; zero where nothing is imposed
  std::vector<Mat3> stress_MPa;  ///< Cauchy stress, one per element
};

/// Equilibrium of the body by CalculiX with linear tetrahedra (C3D4), the displacements of some nodes imposed.
/// saint-venant-kirchhoff is *ELASTIC with NLGEOM, neo-hookean *HYPERELASTIC, NEO HOOKE; linear is *ELASTIC without
/// NLGEOM. Throws std::invalid_argument for a law that CalculiX does not have, std::runtime_error with the end of its
/// log where it fails.
CalculixAnswer run_calculix(const TetMesh& mesh, const TissueOptions& tissue, const std::map<int, Vec3>& imposed_mm);

}  // namespace palpate::test

/// Skips the test where CalculiX is missing.
#define PALPATE_NEEDS_CALCULIX() \
  if (!palpate::test::calculix_is_installed()) GTEST_SKIP() << "CalculiX is missing (Debian package calculix-ccx)"
