#include "palpate/surface/depth_cells.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

namespace palpate {

cv::Point DepthCells::cell_of(const Vec3& point_mm) const {
  return {static_cast<int>(std::floor((point_mm.x() / point_mm.z() - u_min) / pitch)),
          static_cast<int>(std::floor((point_mm.y() / point_mm.z() - v_min) / pitch))};
}

bool DepthCells::contains(const cv::Point& cell) const {
  return cell.x >= 0 && cell.y >= 0 && cell.x < w.cols && cell.y < w.rows;
}

bool DepthCells::is_known(const cv::Point& cell) const {
  return contains(cell) && std::isfinite(w(cell));
}

Vec3 DepthCells::point_mm(const cv::Point& cell) const {
  return Vec3(u_min + (cell.x + 0.5) * pitch, v_min + (cell.y + 0.5) * pitch, 1) / static_cast<double>(w(cell));
}

DepthCells make_depth_cells(const PointCloud& cloud, double pitch, const std::vector<Vec3>& covered_rays) {
  constexpr double kMaxCells = 4e6;
  DepthCells cells;
  double u_max = -std::numeric_limits<double>::max(), v_max = u_max;
  cells.u_min = cells.v_min = std::numeric_limits<double>::max();
  for (const Vec3& p : cloud.position_mm) {
    cells.u_min = std::min(cells.u_min, p.x() / p.z());
    cells.v_min = std::min(cells.v_min, p.y() / p.z());
    u_max = std::max(u_max, p.x() / p.z());
    v_max = std::max(v_max, p.y() / p.z());
  }
  if (cloud.size() == 0) return cells;
  cells.pitch = std::max(pitch, std::sqrt((u_max - cells.u_min) * (v_max - cells.v_min) / kMaxCells));
  const cv::Size size(static_cast<int>((u_max - cells.u_min) / cells.pitch) + 1,
                      static_cast<int>((v_max - cells.v_min) / cells.pitch) + 1);
  cells.w = cv::Mat1f(size, 0.0f);
  cells.deviation = cv::Mat1f(size, 0.0f);
  cells.covered = cv::Mat1b(size, uchar{0});
  cells.closed = cv::Mat1b(size, uchar{0});
  cv::Mat1f count(size, 0.0f);
  for (size_t i = 0; i < cloud.size(); ++i) {
    const Vec3& p = cloud.position_mm[i];
    const cv::Point cell = cells.cell_of(p);
    const double w = 1 / p.z();
    cells.w(cell) += static_cast<float>(w);
    cells.deviation(cell) += cloud.depth_deviation_mm[i] * static_cast<float>(w * w);
    ++count(cell);
  }
  cells.w /= count;
  cells.deviation /= count;
  cells.w.setTo(std::numeric_limits<float>::quiet_NaN(), count == 0);
  for (const Vec3& ray : covered_rays)
    if (const cv::Point cell = cells.cell_of(ray); cells.contains(cell)) cells.covered(cell) = 255;
  return cells;
}

}  // namespace palpate
