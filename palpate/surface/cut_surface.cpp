#include "palpate/surface/cut_surface.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/imgproc.hpp>

#include "palpate/core/errors.h"
#include "palpate/core/quantile.h"
#include "palpate/surface/cocone.h"
#include "palpate/surface/extend_rim.h"
#include "palpate/surface/seen_tissue.h"

namespace palpate {

namespace {

double area_mm2(const cv::Mat1b& cells_wanted, const DepthCells& cells) {
  double area = 0;
  for (int r = 0; r < cells_wanted.rows; ++r)
    for (int c = 0; c < cells_wanted.cols; ++c)
      if (cells_wanted(r, c)) area += std::pow(cells.size_mm(static_cast<double>(cells.w(r, c))), 2);
  return area;
}

/// Of the triangles, as seen along the viewing ray of each.
double facing_area_mm2(const Surface& surface) {
  double area = 0;
  for (const Triangle& t : surface.triangles) {
    const Vec3 &a = surface.vertices_mm[static_cast<size_t>(t[0])], &b = surface.vertices_mm[static_cast<size_t>(t[1])],
               &c = surface.vertices_mm[static_cast<size_t>(t[2])];
    area -= 0.5 * (b - a).cross(c - a).dot((a + b + c).normalized());
  }
  return area;
}

double median_depth_mm(const Surface& surface) {
  std::vector<double> depths;
  for (const Vec3& v : surface.vertices_mm) depths.push_back(v.z());
  return median_of(depths);
}

void add(PointCloud& points, const Vec3& position_mm, float deviation_mm, float correlation, const cv::Vec3b& colour) {
  points.position_mm.push_back(position_mm);
  points.depth_deviation_mm.push_back(deviation_mm);
  points.correlation.push_back(correlation);
  points.colour.push_back(colour);
}

/// The points that the surface does not pass by.
PointCloud left_over(const PointCloud& points, const Surface& surface, const DepthCells& cells, double spacing_mm) {
  const SeenTissue taken = seen_tissue(surface, cells);
  // Points on the rim belong to the surface, which ends a spacing inside of them.
  const cv::Mat1b known = taken.cells.w == taken.cells.w;
  const int reach = static_cast<int>(spacing_mm / cells.size_mm(1 / median_depth_mm(surface))) + 1;
  cv::Mat1b wide;
  cv::dilate(known, wide, cv::Mat1b::ones(2 * reach + 1, 2 * reach + 1));
  PointCloud left;
  for (size_t i = 0; i < points.size(); ++i)
    if (!wide(cells.cell_of(points.position_mm[i])))
      add(left, points.position_mm[i], points.depth_deviation_mm[i], points.correlation[i], points.colour[i]);
  return left;
}

double area_of_points_mm2(const PointCloud& points, const DepthCells& cells) {
  cv::Mat1b wanted(cells.w.size(), uchar{0});
  for (const Vec3& p : points.position_mm)
    if (const cv::Point cell = cells.cell_of(p); cells.is_known(cell)) wanted(cell) = 255;
  return area_mm2(wanted, cells);
}

}  // namespace

std::vector<PointCloud> split_at_edges(const PointCloud& cloud, const DepthEdges& edges) {
  const DepthCells& cells = edges.cells;
  const cv::Mat1i labels = label_pieces(edges);
  std::map<int, double> areas;
  for (int r = 0; r < labels.rows; ++r)
    for (int c = 0; c < labels.cols; ++c)
      if (labels(r, c) >= 0) areas[labels(r, c)] += std::pow(cells.size_mm(static_cast<double>(cells.w(r, c))), 2);
  std::map<int, PointCloud> group_of;
  for (const auto& [label, area] : areas)
    if (area >= edges.options.min_piece_mm2) group_of[label];
  const auto group_at = [&](const cv::Point& cell) -> PointCloud* {
    const auto found = cells.contains(cell) ? group_of.find(labels(cell)) : group_of.end();
    return found == group_of.end() ? nullptr : &found->second;
  };
  for (size_t i = 0; i < cloud.size(); ++i)
    if (PointCloud* group = group_at(cells.cell_of(cloud.position_mm[i])))
      add(*group, cloud.position_mm[i], cloud.depth_deviation_mm[i], cloud.correlation[i], cloud.colour[i]);
  for (int r = 0; r < labels.rows; ++r)
    for (int c = 0; c < labels.cols; ++c)
      if (PointCloud* group = cells.closed(r, c) ? group_at({c, r}) : nullptr)
        add(*group, cells.point_mm({c, r}), cells.deviation(r, c) / (cells.w(r, c) * cells.w(r, c)), 0, {});
  std::vector<PointCloud> groups;
  for (auto& [label, group] : group_of) groups.push_back(std::move(group));
  if (groups.empty())
    throw BadInput(fmt::format("of {} measured points no {:g} mm2 of tissue hang together (tuning.piece_mm2)",
                               cloud.size(), edges.options.min_piece_mm2));
  std::stable_sort(groups.begin(), groups.end(),
                   [](const PointCloud& a, const PointCloud& b) { return a.size() > b.size(); });
  return groups;
}

std::vector<SurfacePiece> cut_surfaces(std::vector<PointCloud> groups, const DepthEdges& edges, double spacing_mm,
                                       const SurfaceOptions& options) {
  std::vector<SurfacePiece> pieces;
  std::string why_none;
  for (size_t i = 0; i < groups.size(); ++i) {
    SurfacePiece piece;
    try {
      piece.clean = clean_points(groups[i], spacing_mm, options);
      piece.surface =
          extend_rim(cocone(piece.clean.position_mm, options, &edges), groups[i].position_mm, spacing_mm, &edges);
    } catch (const BadInput& sentence) {
      // Too few points, or too narrow, for a surface at this spacing.
      if (why_none.empty()) why_none = sentence.what();
      continue;
    }
    piece.area_mm2 = facing_area_mm2(piece.surface);
    piece.depth_mm = median_depth_mm(piece.surface);
    PointCloud left = left_over(groups[i], piece.surface, edges.cells, spacing_mm);
    if (area_of_points_mm2(left, edges.cells) >= edges.options.min_piece_mm2) groups.push_back(std::move(left));
    if (piece.area_mm2 >= edges.options.min_piece_mm2) pieces.push_back(std::move(piece));
  }
  if (pieces.empty())
    throw BadInput(why_none.empty() ? "no tissue surface is large enough (tuning.piece_mm2)" : why_none);
  std::stable_sort(pieces.begin(), pieces.end(),
                   [](const SurfacePiece& a, const SurfacePiece& b) { return a.area_mm2 > b.area_mm2; });
  return pieces;
}

}  // namespace palpate
