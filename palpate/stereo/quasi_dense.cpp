#include "palpate/stereo/quasi_dense.h"

#include "palpate/stereo/grow.h"
#include "palpate/stereo/refine.h"
#include "palpate/stereo/seeds.h"

namespace palpate {

DisparityMap match_quasi_dense(const cv::Mat& left_bgr, const cv::Mat& right_bgr, const cv::Mat& mask,
                               double least_disparity_px, double most_disparity_px) {
  Eyes eyes = prepare_eyes(left_bgr, right_bgr, mask);
  const Seeds seeds = find_seeds(eyes, least_disparity_px, most_disparity_px);
  align_rows(eyes, seeds.row_offset_px);
  return match_quasi_dense(eyes, seeds, least_disparity_px, most_disparity_px);
}

DisparityMap match_quasi_dense(const Eyes& eyes, const Seeds& seeds, double least_disparity_px,
                               double most_disparity_px) {
  CellGrid grid = grow(eyes, seeds, least_disparity_px, most_disparity_px);
  refine_cells(eyes, grid);
  smooth_cells(grid);
  DisparityMap map = fill_between_cells(eyes, grid);
  map.row_offset_px = seeds.row_offset_px;
  return map;
}

}  // namespace palpate
