#include "palpate/instrument/grey_evidence.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "palpate/core/quantile.h"

namespace palpate {
namespace {

constexpr float kTrust = 0.35F;     // of the network's log odds: on what it has never seen it is too sure
constexpr double kSurest = 1e-4;    // and its probabilities go no further
constexpr float kGreyEvidence = 1;  // log odds of a colour without any redness, times 1 - kNeutral
constexpr float kNeutral = 0.4F;    // greyness that says nothing
constexpr double kOfPicture = 0.3;  // of the lit pixels are less red than tissue
constexpr float kDark = 20;         // grey levels below which there is no colour to judge
constexpr float kNoise = 2;         // grey levels by which grey may look red
constexpr float kPalest = 0.08F, kReddest = 0.6F;  // redness of tissue
constexpr int kAround = 5;                         // px over which colours are averaged

float redness_of(const cv::Vec3b& p, float value) {
  const float redness = static_cast<float>(p[2] - p[1]) + 0.5F * static_cast<float>(std::max(0, p[1] - p[0])) - kNoise;
  return std::max(0.0F, redness) / value;
}

}  // namespace

cv::Mat grey_counted_in(const cv::Mat& bgr, const cv::Mat& probability) {
  cv::Mat redness(bgr.size(), CV_32F, cv::Scalar(-1));  // -1 where it is dark
  std::vector<float> lit;
  for (int y = 0; y < bgr.rows; ++y)
    for (int x = 0; x < bgr.cols; ++x) {
      const cv::Vec3b& p = bgr.at<cv::Vec3b>(y, x);
      const float value = std::max({p[0], p[1], p[2]});
      if (value > kDark) lit.push_back(redness.at<float>(y, x) = redness_of(p, value));
    }
  cv::Mat evidence = cv::Mat::zeros(bgr.size(), CV_32F), odds, result;
  if (!lit.empty()) {
    const float of_tissue = std::clamp(quantile_of(lit, kOfPicture), kPalest, kReddest);
    for (int y = 0; y < bgr.rows; ++y)
      for (int x = 0; x < bgr.cols; ++x)
        if (const float r = redness.at<float>(y, x); r >= 0)
          evidence.at<float>(y, x) = kGreyEvidence * (std::max(-1.0F, 1 - r / of_tissue) - kNeutral);
  }
  cv::blur(evidence, evidence, {kAround, kAround});
  const cv::Mat bounded = cv::max(cv::min(probability, 1 - kSurest), kSurest);
  cv::log(bounded / (1 - bounded), odds);
  cv::exp(-(kTrust * odds + evidence), result);
  result = 1 / (1 + result);
  return result;
}

}  // namespace palpate
