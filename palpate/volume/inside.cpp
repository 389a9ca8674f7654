#include "palpate/volume/inside.h"

#include <algorithm>
#include <cmath>

namespace palpate {

namespace {

/// Twice the area of (a, b, p) seen along z; the same bits, with the other sign, for (b, a, p), so that a line between
/// two triangles crosses exactly one of them.
double orientation(const Vec3& a, const Vec3& b, double x, double y) {
  const bool swapped = a.x() > b.x() || (a.x() == b.x() && a.y() > b.y());
  const Vec3 &p = swapped ? b : a, &q = swapped ? a : b;
  double value = (q.x() - p.x()) * (y - p.y()) - (q.y() - p.y()) * (x - p.x());
  if (value == 0) value = 1e-300;  // a point on the edge counts to its left
  return swapped ? -value : value;
}

}  // namespace

InsideTest::InsideTest(const Surface& closed) {
  triangles_.reserve(closed.triangles.size());
  Vec3 min = Vec3::Constant(1e300), max = -min;
  for (const Triangle& t : closed.triangles) {
    Column column;
    for (size_t k = 0; k < 3; ++k) {
      column.corners[k] = closed.vertices_mm[static_cast<size_t>(t[k])];
      min = min.cwiseMin(column.corners[k]);
      max = max.cwiseMax(column.corners[k]);
    }
    triangles_.push_back(column);
  }
  const int side = std::clamp(static_cast<int>(std::sqrt(static_cast<double>(triangles_.size()))), 1, 512);
  columns_ = rows_ = side;
  x_min_ = min.x();
  y_min_ = min.y();
  pitch_x_ = std::max(max.x() - min.x(), 1e-9) / side;
  pitch_y_ = std::max(max.y() - min.y(), 1e-9) / side;
  const auto for_each_bucket = [&](const Column& t, auto visit) {
    const auto [x0, x1] = std::minmax({t.corners[0].x(), t.corners[1].x(), t.corners[2].x()});
    const auto [y0, y1] = std::minmax({t.corners[0].y(), t.corners[1].y(), t.corners[2].y()});
    const auto index = [&](double value, double origin, double pitch) {
      return std::clamp(static_cast<int>((value - origin) / pitch), 0, side - 1);
    };
    for (int row = index(y0, y_min_, pitch_y_); row <= index(y1, y_min_, pitch_y_); ++row)
      for (int column = index(x0, x_min_, pitch_x_); column <= index(x1, x_min_, pitch_x_); ++column)
        visit(static_cast<size_t>(row * columns_ + column));
  };
  first_.assign(static_cast<size_t>(side * side) + 1, 0);
  for (const Column& t : triangles_) for_each_bucket(t, [&](size_t b) { ++first_[b + 1]; });
  for (size_t b = 1; b < first_.size(); ++b) first_[b] += first_[b - 1];
  bucket_.resize(static_cast<size_t>(first_.back()));
  std::vector<int> next(first_.begin(), first_.end() - 1);
  for (size_t t = 0; t < triangles_.size(); ++t)
    for_each_bucket(triangles_[t], [&](size_t b) { bucket_[static_cast<size_t>(next[b]++)] = static_cast<int>(t); });
}

bool InsideTest::operator()(const Vec3& point) const {
  const double x = point.x(), y = point.y();
  const int column = static_cast<int>(std::floor((x - x_min_) / pitch_x_)),
            row = static_cast<int>(std::floor((y - y_min_) / pitch_y_));
  if (column < 0 || row < 0 || column > columns_ || row > rows_) return false;
  const auto b = static_cast<size_t>(std::min(row, rows_ - 1) * columns_ + std::min(column, columns_ - 1));
  int winding = 0;
  for (int i = first_[b]; i < first_[b + 1]; ++i) {
    const Vec3* c = triangles_[static_cast<size_t>(bucket_[static_cast<size_t>(i)])].corners;
    const double w0 = orientation(c[1], c[2], x, y), w1 = orientation(c[2], c[0], x, y);
    if ((w0 > 0) != (w1 > 0)) continue;
    const double w2 = orientation(c[0], c[1], x, y);
    if ((w0 > 0) != (w2 > 0)) continue;
    const double z = (w0 * c[0].z() + w1 * c[1].z() + w2 * c[2].z()) / (w0 + w1 + w2);
    if (z < point.z()) winding += w0 > 0 ? -1 : 1;  // seen from -z an outwards oriented front runs clockwise in (x, y)
  }
  return winding > 0;
}

double enclosed_volume_mm3(const Surface& closed) {
  if (closed.triangles.empty()) return 0;
  const Vec3 origin = closed.vertices_mm[static_cast<size_t>(closed.triangles.front()[0])];
  double volume = 0;
  for (const Triangle& t : closed.triangles)
    volume +=
        signed_volume_mm3(origin, closed.vertices_mm[static_cast<size_t>(t[0])],
                          closed.vertices_mm[static_cast<size_t>(t[1])], closed.vertices_mm[static_cast<size_t>(t[2])]);
  return volume;
}

}  // namespace palpate
