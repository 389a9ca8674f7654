#include "palpate/estimate/find_edges.h"

#include <algorithm>

#include "palpate/core/quantile.h"

namespace palpate {

namespace {

/// Cells hold at least so many pixels across, or many stay empty.
constexpr double kPixelsPerCell = 1.5;

double middle_depth_mm(const PointCloud& cloud) {
  constexpr size_t kLookedAt = 5000;
  std::vector<double> depths;
  for (size_t i = 0; i < cloud.size(); i += cloud.size() / kLookedAt + 1) depths.push_back(cloud.position_mm[i].z());
  if (depths.empty()) return 1;
  return median_of(depths);
}

}  // namespace

DepthEdges find_edges(const PointCloud& cloud, const Rectification& rectification, const cv::Mat& covered,
                      const EdgeOptions& options) {
  const double pitch = std::max(options.cell_mm / middle_depth_mm(cloud), kPixelsPerCell / rectification.focal_px);
  const int step = std::max(1, static_cast<int>(pitch * rectification.focal_px));
  std::vector<Vec3> covered_rays;
  for (int y = 0; y < covered.rows; y += step)
    for (int x = 0; x < covered.cols; x += step)
      if (covered.at<uchar>(y, x)) covered_rays.push_back(triangulate_pixel(rectification, cv::Point2d(x, y), 1));
  DepthCells cells = make_depth_cells(cloud, pitch, covered_rays);
  close_covered(cells, options);
  return find_depth_edges(std::move(cells), options);
}

}  // namespace palpate
