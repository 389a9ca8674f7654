#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "palpate/core/geometry.h"
#include "palpate/elastic/tet_model.h"

namespace palpate {

/// The patch of tissue that the tip holds: sample points on the rest surface, each tied by barycentric weights to the
/// nodes of its triangle, or weighted means of them. Three rows of J per sample or mean; they are independent
/// (J K^-1 J^T is regular).
struct Footprint {
  struct Sample {
    Triangle nodes;
    Vec3 barycentric;
  };
  std::vector<Sample> samples;
  Eigen::MatrixXd means;  ///< one row for each mean that is tied, one column per sample; empty: each sample is tied
  Vec3 center_mm = Vec3::Zero();  ///< rest position of the middle, on the surface
  Vec3 normal = Vec3::UnitZ();    ///< outward normal of the rest surface there
};

/// Rigid disc of `radius_mm` on the surface, around the point nearest to `near_mm`, measured along the tangent plane
/// there. What it covers is tied by means of the displacement: against every polynomial on the disc up to a degree as
/// high as the mesh can tell apart (7, 5, 3, 1 or 0), weighted as the pressure of a rigid punch is distributed,
/// 1 / sqrt(1 - (rho / radius)^2) (Sneddon 1965). No node is held that need not be; what the edges h beneath still add,
/// as if the disc were larger by 0.3 to 0.5 h, is taken off its radius beforehand (as Peaceman 1978 does for a well in
/// coarse cells). Throws std::invalid_argument when the surface is empty.
Footprint make_footprint(const TetModel& model, const std::vector<Triangle>& boundary, const Vec3& near_mm,
                         double radius_mm);

/// J of Eq. 3 on the unknowns, three rows per mean or sample.
Eigen::SparseMatrix<double> constraint_matrix(const TetModel& model, const Footprint& footprint);

}  // namespace palpate
