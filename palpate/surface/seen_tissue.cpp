#include "palpate/surface/seen_tissue.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

namespace palpate {

namespace {

/// Inverse depth of a triangle in every cell whose middle it covers; of several triangles the nearest.
void draw(const Vec3& a, const Vec3& b, const Vec3& c, DepthCells& cells) {
  const auto place = [&](const Vec3& p) {
    return cv::Point2d((p.x() / p.z() - cells.u_min) / cells.pitch - 0.5,
                       (p.y() / p.z() - cells.v_min) / cells.pitch - 0.5);
  };
  const cv::Point2d p = place(a), q = place(b), r = place(c);
  const double area = (q - p).cross(r - p);
  if (std::abs(area) < 1e-12) return;
  const int x_min = std::max(0, static_cast<int>(std::ceil(std::min({p.x, q.x, r.x})))),
            y_min = std::max(0, static_cast<int>(std::ceil(std::min({p.y, q.y, r.y})))),
            x_max = std::min(cells.w.cols - 1, static_cast<int>(std::floor(std::max({p.x, q.x, r.x})))),
            y_max = std::min(cells.w.rows - 1, static_cast<int>(std::floor(std::max({p.y, q.y, r.y}))));
  for (int y = y_min; y <= y_max; ++y)
    for (int x = x_min; x <= x_max; ++x) {
      const cv::Point2d here(x, y);
      const double of_a = (q - here).cross(r - here) / area, of_b = (r - here).cross(p - here) / area;
      if (of_a < 0 || of_b < 0 || of_a + of_b > 1) continue;
      const auto w = static_cast<float>(of_a / a.z() + of_b / b.z() + (1 - of_a - of_b) / c.z());
      if (float& nearest = cells.w(y, x); !(nearest >= w)) nearest = w;
    }
}

}  // namespace

SeenTissue seen_tissue(const Surface& surface, const DepthCells& measured) {
  SeenTissue seen;
  seen.cells = measured;
  seen.cells.w = cv::Mat1f(measured.w.size(), std::numeric_limits<float>::quiet_NaN());
  for (const Triangle& t : surface.triangles)
    draw(surface.vertices_mm[static_cast<size_t>(t[0])], surface.vertices_mm[static_cast<size_t>(t[1])],
         surface.vertices_mm[static_cast<size_t>(t[2])], seen.cells);
  const cv::Mat1b known = seen.cells.w == seen.cells.w;
  // The picture's own border is an edge, too.
  cv::Mat1b framed;
  cv::copyMakeBorder(known, framed, 1, 1, 1, 1, cv::BORDER_CONSTANT, 0);
  cv::Mat distance;
  cv::distanceTransform(framed, distance, cv::DIST_L2, cv::DIST_MASK_5);
  seen.inside_cells = distance(cv::Rect({1, 1}, known.size())).clone();
  return seen;
}

SeenTissue::Sight sight_of(const SeenTissue& seen, const Vec3& place_mm, double reach_mm) {
  const DepthCells& cells = seen.cells;
  if (!(place_mm.z() > 0) || cells.w.empty()) return SeenTissue::Sight::none;
  const cv::Point middle = cells.cell_of(place_mm);
  const int reach = static_cast<int>(reach_mm / cells.size_mm(1 / place_mm.z())) + 1;
  double nearest_mm = reach_mm;
  SeenTissue::Sight sight = SeenTissue::Sight::none;
  for (int y = middle.y - reach; y <= middle.y + reach; ++y)
    for (int x = middle.x - reach; x <= middle.x + reach; ++x) {
      if (!cells.is_known({x, y})) continue;
      const double distance_mm = (cells.point_mm({x, y}) - place_mm).norm();
      if (distance_mm > nearest_mm) continue;
      nearest_mm = distance_mm;
      sight = cells.closed(y, x) ? SeenTissue::Sight::closed : SeenTissue::Sight::seen;
    }
  return sight;
}

double distance_to_edge_mm(const SeenTissue& seen, const Vec3& place_mm) {
  const cv::Point cell = seen.cells.cell_of(place_mm);
  if (!seen.cells.is_known(cell)) return 0;
  return static_cast<double>(seen.inside_cells(cell)) * seen.cells.size_mm(1 / place_mm.z());
}

}  // namespace palpate
