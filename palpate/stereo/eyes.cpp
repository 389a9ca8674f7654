#include "palpate/stereo/eyes.h"

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
constexpr double kLeastRowOffset_px = 0.02;
constexpr int kHalo_px = 5;  // highlights shine into their neighbourhood

// Black that touches the rim of the image.
cv::Mat black_border(const cv::Mat& bgr) {
  cv::Mat brightest;
  cv::Mat channels[3];
  cv::split(bgr, channels);
  cv::max(channels[0], channels[1], brightest);
  cv::max(brightest, channels[2], brightest);
  cv::Mat framed;
  cv::copyMakeBorder(brightest <= kBlack, framed, 1, 1, 1, 1, cv::BORDER_CONSTANT, cv::Scalar(255));
  cv::floodFill(framed, {0, 0}, cv::Scalar(128));
  return framed(cv::Rect({1, 1}, bgr.size())) == 128;
}

}  // namespace

cv::Mat matchable_mask(const cv::Mat& bgr) {
  cv::Mat channels[3];
  cv::split(bgr, channels);
  cv::Mat darkest;
  cv::min(channels[0], channels[1], darkest);
  cv::min(darkest, channels[2], darkest);
  // Soft reflections do not saturate, but outshine their surroundings in every channel.
  cv::Mat surroundings;
  cv::blur(darkest, surroundings, {kSurroundings_px, kSurroundings_px});
  cv::Mat blocked = (darkest >= kSaturated) | ((darkest - kOutshine) > surroundings);
  const cv::Mat halo = cv::getStructuringElement(cv::MORPH_ELLIPSE, {kHalo_px, kHalo_px});
  cv::dilate(blocked, blocked, halo);
  cv::Mat border = black_border(bgr);
  cv::dilate(border, border, halo);
  return ~(blocked | border);
}

Eyes prepare_eyes(const cv::Mat& left_bgr, const cv::Mat& right_bgr, const cv::Mat& mask) {
  struct Eye {
    cv::Mat grey, matchable;
    cv::Scalar mean, deviation;
  } left, right;
  const auto look = [](const cv::Mat& bgr, Eye& eye) {
    eye.matchable = matchable_mask(bgr);
    cv::cvtColor(bgr, eye.grey, cv::COLOR_BGR2GRAY);
    cv::meanStdDev(eye.grey, eye.mean, eye.deviation, eye.matchable);
  };
  tbb::parallel_invoke([&] { look(left_bgr, left); }, [&] { look(right_bgr, right); });
  Eyes eyes;
  eyes.left_mask = left.matchable & mask;
  eyes.wanted = mask & ~black_border(left_bgr);
  eyes.right_mask = right.matchable;
  const double gain = right.deviation[0] > 1 ? left.deviation[0] / right.deviation[0] : 1;
  left.grey.convertTo(eyes.left, CV_32F);
  right.grey.convertTo(eyes.right, CV_32F, gain, left.mean[0] - gain * right.mean[0]);
  return eyes;
}

cv::Mat rows_aligned(const cv::Mat& right, double row_offset_px) {
  if (std::abs(row_offset_px) < kLeastRowOffset_px) return right;
  cv::Mat aligned;
  cv::warpAffine(right, aligned, cv::Matx23d(1, 0, 0, 0, 1, row_offset_px), right.size(),
                 cv::INTER_CUBIC | cv::WARP_INVERSE_MAP, cv::BORDER_REPLICATE);
  return aligned;
}

void align_rows(Eyes& eyes, double row_offset_px) {
  eyes.right = rows_aligned(eyes.right, row_offset_px);
  if (std::abs(row_offset_px) < 0.5) return;
  cv::warpAffine(eyes.right_mask, eyes.right_mask, cv::Matx23d(1, 0, 0, 0, 1, row_offset_px), eyes.right_mask.size(),
                 cv::INTER_NEAREST | cv::WARP_INVERSE_MAP);
}

}  // namespace palpate
