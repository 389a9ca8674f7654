#pragma once

#include <Eigen/SparseCore>

#include "palpate/core/geometry.h"
#include "palpate/elastic/tet_model.h"

namespace palpate {

/// The patch of tissue that the tip holds: sample points on the rest surface, each tied by barycentric weights to the
/// nodes of its triangle. Three rows of J per sample; the samples are independent (J K^-1 J^T is regular).
struct Footprint {
  struct Sample {
    Triangle nodes;
    Vec3 barycentric;
  };
  std::vector<Sample> samples;
  Vec3 center_mm = Vec3::Zero();  ///< rest position of the middle, on the surface
  Vec3 normal = Vec3::UnitZ();    ///< outward normal of the rest surface there
};

/// Samples within `radius_mm` of the point of the surface nearest to `near_mm`, measured along the surface's tangent
/// plane. At least one sample. Throws std::invalid_argument when the surface is empty.
Footprint make_footprint(const TetModel& model, const std::vector<Triangle>& boundary, const Vec3& near_mm,
                         double radius_mm);

/// J of Eq. 3 on the unknowns, 3 m rows.
Eigen::SparseMatrix<double> constraint_matrix(const TetModel& model, const Footprint& footprint);

}  // namespace palpate
