#include "palpate/stereo/quasi_dense.h"

#include <tbb/parallel_invoke.h>

#include <opencv2/imgproc.hpp>

#include "palpate/stereo/grow.h"
#include "palpate/stereo/refine.h"
#include "palpate/stereo/seeds.h"

namespace palpate {
namespace {

// A touch of blur takes the finest detail away, which interpolation between pixels gets wrong.
Level softened(const cv::Mat& grey, const cv::Mat& mask) {
  cv::Mat soft;
  cv::GaussianBlur(grey, soft, {3, 3}, 0.6);
  return make_level(soft, mask);
}

}  // namespace

DisparityMap match_quasi_dense(const cv::Mat& left_bgr, const cv::Mat& right_bgr, const cv::Mat& mask,
                               double min_disparity_px, double max_disparity_px) {
  PreparedPair prepared = prepare_pair(left_bgr, right_bgr, mask);
  const Seeds seeds = find_seeds(prepared, min_disparity_px, max_disparity_px);
  align_rows(prepared, seeds.row_offset_px);
  return match_quasi_dense(prepared, seeds, min_disparity_px, max_disparity_px);
}

DisparityMap match_quasi_dense(const PreparedPair& prepared, const Seeds& seeds, double min_disparity_px,
                               double max_disparity_px) {
  CellGrid grid = grow(prepared, seeds, min_disparity_px, max_disparity_px);
  Level left, right;
  tbb::parallel_invoke([&] { left = softened(prepared.left, prepared.left_mask); },
                       [&] { right = softened(prepared.right, prepared.right_mask); });
  for (const Reach reach : {Reach{5, 1}, Reach{12, 2}}) {
    refine_cells(left, right, grid);
    smooth_cells(grid, reach);
  }
  DisparityMap map = fill_between_cells(prepared, grid);
  map.row_offset_px = seeds.row_offset_px;
  return map;
}

}  // namespace palpate
