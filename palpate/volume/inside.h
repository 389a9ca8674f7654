#pragma once

#include "palpate/core/geometry.h"

namespace palpate {

/// Answers whether a point lies inside a closed, outwards oriented surface: where the winding number, counted by the
/// signed crossings of the line that leaves the point along -z, is positive. Holds for surfaces that overlap
/// themselves, too: a part turned inside out counts against what it overlaps. Kept as buckets of triangles over (x, y).
class InsideTest {
 public:
  explicit InsideTest(const Surface& closed);

  bool operator()(const Vec3& point) const;

 private:
  struct Column {
    Vec3 corners[3];
  };

  std::vector<Column> triangles_;
  std::vector<int> first_;  ///< per bucket, and the end
  std::vector<int> bucket_;
  double x_min_ = 0, y_min_ = 0, pitch_x_ = 1, pitch_y_ = 1;
  int columns_ = 0, rows_ = 0;
};

/// Volume enclosed by a closed, outwards oriented surface, mm^3.
double enclosed_volume_mm3(const Surface& closed);

}  // namespace palpate
