#pragma once

#include "palpate/core/geometry.h"

namespace palpate {

/// A cloud over the image plane of the camera at the origin, in square cells of u = x/z and v = y/z. Inverse depth
/// w = 1/z is kept, in which a plane is linear and in which noise acts. Images: rows along v, columns along u.
struct DepthCells {
  double u_min = 0, v_min = 0, pitch = 1;
  cv::Mat1f w;          ///< mean of the cell's points, 1/mm; NaN = nothing was measured
  cv::Mat1f deviation;  ///< of w, as the points state it
  cv::Mat1b covered;    ///< 255 = an instrument stands before it
  cv::Mat1b closed;     ///< 255 = not measured: w continues what surrounds it

  /// The cell that a point is seen in; may lie outside.
  cv::Point cell_of(const Vec3& point_mm) const;
  bool contains(const cv::Point& cell) const;
  bool is_known(const cv::Point& cell) const;  ///< inside, and w is a number
  Vec3 point_mm(const cv::Point& cell) const;  ///< of a known cell: its middle
  double size_mm(double at_w) const { return pitch / at_w; }
};

/// `pitch`: size of a cell in u and v; `covered_rays`: directions in which an instrument is seen, as dense as pixels.
/// Without points the images are empty.
DepthCells make_depth_cells(const PointCloud& cloud, double pitch, const std::vector<Vec3>& covered_rays);

}  // namespace palpate
