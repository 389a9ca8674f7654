#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <array>
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
  std::vector<Mat3> stress_MPa;  ///< Cauchy stress, one per element; with quadratic elements none
};

/// Displacements of some nodes, mm; a component that is NaN stays free.
using Imposed = std::map<int, Vec3>;

/// Equilibrium of the body by CalculiX with linear tetrahedra (C3D4), the displacements of some nodes imposed.
/// saint-venant-kirchhoff is *ELASTIC with NLGEOM, neo-hookean *HYPERELASTIC, NEO HOOKE; linear is *ELASTIC without
/// NLGEOM. Throws std::invalid_argument for a law that CalculiX does not have, std::runtime_error with the end of its
/// log where it fails.
CalculixAnswer run_calculix(const TetMesh& mesh, const TissueOptions& tissue, const Imposed& imposed_mm);

/// Quadratic tetrahedra (C3D10) with straight edges: four corners, then the middles of the edges 01, 12, 20, 03,
/// 13, 23.
struct QuadraticMesh {
  std::vector<Vec3> nodes_mm;
  std::vector<std::array<int, 10>> tetrahedra;
};

/// A node in the middle of every edge; those of `mesh` keep their numbers.
QuadraticMesh with_midside_nodes(const TetMesh& mesh);

/// What is imposed on both ends of an edge is imposed on its middle, their mean.
Imposed with_midside_nodes(const QuadraticMesh& mesh, const Imposed& imposed_mm);

/// The same with quadratic elements; its `u` and `reaction` cover the midside nodes too. `first_step`: fraction of the
/// load that the first increment takes.
CalculixAnswer run_calculix(const QuadraticMesh& mesh, const TissueOptions& tissue, const Imposed& imposed_mm,
                            double first_step = 0.1);

}  // namespace palpate::test

/// Skips the test where CalculiX is missing.
#define PALPATE_NEEDS_CALCULIX() \
  if (!palpate::test::calculix_is_installed()) GTEST_SKIP() << "CalculiX is missing (Debian package calculix-ccx)"
