#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "palpate/core/geometry.h"

namespace palpate {

/// A vertex as an image sees it.
struct ScreenVertex {
  cv::Point2f px;
  float nearness = 0;  ///< larger = nearer; 1/depth (exact under perspective) or minus depth (orthographic); must be
                       ///< the same measure for all vertices. Not finite: its triangles are not drawn.
};

/// What an image of a triangle mesh shows at each pixel of `area`; all three have the size of `area`.
struct VisibleTriangles {
  cv::Rect area;        ///< bounding box of the mesh within the image
  cv::Mat triangle;     ///< CV_32S, number of the nearest triangle, -1 = none
  cv::Mat barycentric;  ///< CV_32FC2, weights of its first two corners (the third is 1 minus both)
  cv::Mat nearness;     ///< CV_32F
};

/// Z-buffer: the nearest triangle at each pixel centre, whichever side it turns to the camera. The same for every
/// thread count. `visible` is reused, so that a video allocates once.
void rasterize(const std::vector<ScreenVertex>& vertices, const std::vector<Triangle>& triangles,
               const cv::Size& image_size, VisibleTriangles& visible);

}  // namespace palpate
