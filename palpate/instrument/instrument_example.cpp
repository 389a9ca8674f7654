#include "palpate/instrument/instrument_example.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace palpate {
namespace {

constexpr int kBins = 16;           // of each of brightness and two ratios
constexpr int kLearntWidth = 320;   // px of the image that is learnt from
constexpr int kIterations = 4;      // of the cut between instrument and tissue
constexpr float kFrequent = 3e-4F;  // below this frequency a colour says little
constexpr float kMaxEvidence = 3;   // of one colour, so that the network can overrule it

int bin_of(const cv::Vec3b& p) {
  const float b = p[0] + 8.0F, g = p[1] + 8.0F, r = p[2] + 8.0F;
  const auto bin = [](float value) { return std::clamp(static_cast<int>(value * kBins), 0, kBins - 1); };
  return (bin(std::sqrt((b + g + r) / 800)) * kBins + bin(0.5F + 0.4F * std::log2(r / g))) * kBins +
         bin(0.5F + 0.4F * std::log2(b / g));
}

/// Frequencies of the bins among the pixels of a mask, blurred over neighbouring bins.
cv::Mat frequencies(const cv::Mat& bgr, const cv::Mat& mask) {
  const int sizes[] = {kBins, kBins, kBins};
  cv::Mat counts(3, sizes, CV_32F, cv::Scalar(0));
  float all = 1;
  for (int y = 0; y < bgr.rows; ++y)
    for (int x = 0; x < bgr.cols; ++x)
      if (mask.at<uchar>(y, x)) ++counts.ptr<float>()[bin_of(bgr.at<cv::Vec3b>(y, x))], ++all;
  for (int slice = 0; slice < kBins; ++slice) {
    cv::Mat plane(kBins, kBins, CV_32F, counts.ptr<float>(slice));
    cv::GaussianBlur(plane, plane, {5, 5}, 0.8, 0.8, cv::BORDER_REPLICATE);
  }
  cv::Mat rows(kBins, kBins * kBins, CV_32F, counts.data);
  cv::GaussianBlur(rows, rows, {1, 5}, 0.8, 0.8, cv::BORDER_REPLICATE);
  return rows / all;
}

/// 255 = the instrument that the example lies on.
cv::Mat grown(const cv::Mat& bgr, const cv::Mat& sure, const cv::Mat& probability) {
  cv::Mat kinds(bgr.size(), CV_8U, cv::Scalar(cv::GC_PR_BGD));
  if (!probability.empty()) {
    cv::Mat likely;
    cv::resize(probability, likely, bgr.size(), 0, 0, cv::INTER_LINEAR);
    kinds.setTo(cv::GC_PR_FGD, likely > 0.5);
    kinds.setTo(cv::GC_BGD, likely < 0.02);
  }
  kinds.setTo(cv::GC_FGD, sure);
  cv::Mat background, foreground;
  cv::setRNGSeed(1);
  cv::grabCut(bgr, kinds, {}, background, foreground, kIterations, cv::GC_INIT_WITH_MASK);
  cv::Mat instrument = (kinds == cv::GC_FGD) | (kinds == cv::GC_PR_FGD), labels;
  const int count = cv::connectedComponents(instrument, labels, 8);
  std::vector<uchar> hangs_on(static_cast<size_t>(count), 0);
  for (int y = 0; y < sure.rows; ++y)
    for (int x = 0; x < sure.cols; ++x)
      if (sure.at<uchar>(y, x)) hangs_on[static_cast<size_t>(labels.at<int>(y, x))] = 255;
  for (int y = 0; y < sure.rows; ++y)
    for (int x = 0; x < sure.cols; ++x)
      instrument.at<uchar>(y, x) = hangs_on[static_cast<size_t>(labels.at<int>(y, x))] & instrument.at<uchar>(y, x);
  return instrument;
}

}  // namespace

ExampleColours::ExampleColours(const cv::Mat& bgr, const cv::Mat& example, const cv::Mat& probability) {
  const double scale = 1.0 * kLearntWidth / bgr.cols;
  cv::Mat small, sure;
  cv::resize(bgr, small, {kLearntWidth, std::max(1, cvRound(scale * bgr.rows))}, 0, 0, cv::INTER_AREA);
  cv::resize(example, sure, small.size(), 0, 0, cv::INTER_NEAREST);
  if (cv::countNonZero(sure) == 0) return;
  *this = of_found(small, grown(small, sure, probability));
}

ExampleColours ExampleColours::of_found(const cv::Mat& bgr, const cv::Mat& instrument) {
  ExampleColours found;
  const cv::Mat with = frequencies(bgr, instrument) + kFrequent, without = frequencies(bgr, ~instrument) + kFrequent;
  cv::log(with / without, found.evidence_);
  found.evidence_ = cv::max(cv::min(found.evidence_, kMaxEvidence), -kMaxEvidence);
  return found;
}

cv::Mat ExampleColours::counted_in(const cv::Mat& bgr, const cv::Mat& probability) const {
  if (evidence_.empty()) return probability;
  cv::Mat small, evidence(probability.size(), CV_32F), result;
  cv::resize(bgr, small, probability.size(), 0, 0, cv::INTER_AREA);
  for (int y = 0; y < small.rows; ++y)
    for (int x = 0; x < small.cols; ++x)
      evidence.at<float>(y, x) = evidence_.ptr<float>()[bin_of(small.at<cv::Vec3b>(y, x))];
  cv::blur(evidence, evidence, {5, 5});
  cv::Mat odds;
  const cv::Mat bounded = cv::max(cv::min(probability, 1 - 1e-4), 1e-4);
  cv::log(bounded / (1 - bounded), odds);
  cv::exp(-(odds + evidence), result);
  result = 1 / (1 + result);
  return result;
}

}  // namespace palpate
