#include "palpate/stereo/prepared_pair.h"

#include <tbb/parallel_invoke.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "palpate/stereo/quasi_dense.h"

namespace palpate {
namespace {

constexpr int kSaturated = 235;  // a highlight is bright in every channel
constexpr int kBlack = 14;       // the border of the scope, and nothing lit
constexpr int kOutshine = 100;   // grey levels above the surroundings
constexpr int kSurroundings_px = 61;
constexpr double kMinRowOffset_px = 0.02;
constexpr int kHalo_px = 5;  // highlights shine into their neighbourhood

// Black that touches the rim of the image.
cv::Mat black_border(const cv::Mat& brightest) {
  cv::Mat framed;
  cv::copyMakeBorder(brightest <= kBlack, framed, 1, 1, 1, 1, cv::BORDER_CONSTANT, cv::Scalar(255));
  cv::floodFill(framed, {0, 0}, cv::Scalar(128));
  return framed(cv::Rect({1, 1}, brightest.size())) == 128;
}

// Of a whole image: what both cameras can see alike, and the black border.
struct Areas {
  cv::Mat matchable, border;
};

Areas areas_of(const cv::Mat& bgr) {
  cv::Mat channels[3], darkest, brightest;
  cv::split(bgr, channels);
  cv::min(channels[0], channels[1], darkest);
  cv::min(darkest, channels[2], darkest);
  cv::max(channels[0], channels[1], brightest);
  cv::max(brightest, channels[2], brightest);
  // Soft reflections do not saturate, but outshine their surroundings in every channel.
  cv::Mat surroundings;
  cv::blur(darkest, surroundings, {kSurroundings_px, kSurroundings_px});
  const cv::Mat blocked = (darkest >= kSaturated) | ((darkest - kOutshine) > surroundings);
  Areas areas;
  areas.border = black_border(brightest);
  const cv::Mat halo = cv::getStructuringElement(cv::MORPH_ELLIPSE, {kHalo_px, kHalo_px});
  cv::dilate(blocked | areas.border, areas.matchable, halo);
  cv::bitwise_not(areas.matchable, areas.matchable);
  return areas;
}

}  // namespace

cv::Mat matchable_mask(const cv::Mat& bgr) {
  return areas_of(bgr).matchable;
}

PreparedPair prepare_pair(const cv::Mat& left_bgr, const cv::Mat& right_bgr, const cv::Mat& mask) {
  struct OneCamera {
    cv::Mat grey;
    Areas areas;
    cv::Scalar mean, deviation;
  } left, right;
  const auto look = [](const cv::Mat& bgr, OneCamera& camera) {
    camera.areas = areas_of(bgr);
    cv::cvtColor(bgr, camera.grey, cv::COLOR_BGR2GRAY);
    cv::meanStdDev(camera.grey, camera.mean, camera.deviation, camera.areas.matchable);
  };
  tbb::parallel_invoke([&] { look(left_bgr, left); }, [&] { look(right_bgr, right); });
  PreparedPair prepared;
  prepared.left_mask = left.areas.matchable & mask;
  prepared.wanted = mask & ~left.areas.border;
  prepared.right_mask = right.areas.matchable;
  const double gain = right.deviation[0] > 1 ? left.deviation[0] / right.deviation[0] : 1;
  left.grey.convertTo(prepared.left, CV_32F);
  right.grey.convertTo(prepared.right, CV_32F, gain, left.mean[0] - gain * right.mean[0]);
  return prepared;
}

cv::Mat rows_aligned(const cv::Mat& right, double row_offset_px) {
  if (std::abs(row_offset_px) < kMinRowOffset_px) return right;
  cv::Mat aligned;
  cv::warpAffine(right, aligned, cv::Matx23d(1, 0, 0, 0, 1, row_offset_px), right.size(),
                 cv::INTER_CUBIC | cv::WARP_INVERSE_MAP, cv::BORDER_REPLICATE);
  return aligned;
}

void align_rows(PreparedPair& prepared, double row_offset_px) {
  prepared.right = rows_aligned(prepared.right, row_offset_px);
  if (std::abs(row_offset_px) < 0.5) return;
  cv::warpAffine(prepared.right_mask, prepared.right_mask, cv::Matx23d(1, 0, 0, 0, 1, row_offset_px),
                 prepared.right_mask.size(), cv::INTER_NEAREST | cv::WARP_INVERSE_MAP);
}

}  // namespace palpate
