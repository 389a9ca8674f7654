#include "palpate/instrument/segment.h"

#include <algorithm>
#include <array>
#include <opencv2/imgproc.hpp>

#include "palpate/instrument/find_tip.h"

namespace palpate {

namespace {

constexpr int kColourNoise = 2;       // grey levels by which a grey pixel may look red
constexpr int kUnchanged = 24;        // grey levels between two pictures of the same still highlight
constexpr int kNearSaturation = 200;  // both brighter than this: a highlight that flickers

cv::Mat half_size(const cv::Mat& image) {
  cv::Mat half;
  cv::resize(image, half, cv::Size((image.cols + 1) / 2, (image.rows + 1) / 2), 0, 0, cv::INTER_AREA);
  return half;
}

double percentile(std::vector<float>& values, double share) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

int redness_of(const cv::Vec3b& p) {
  return std::max(0, p[2] - std::min(p[0], p[1]) - kColourNoise);
}

int value_of(const cv::Vec3b& p) {
  return std::max({p[0], p[1], p[2]});
}

/// Where the picture is: everything but the black surround that touches the image border.
cv::Mat find_picture_area(const cv::Mat& bgr) {
  cv::Mat value, channels[3];
  cv::split(bgr, channels);
  cv::max(channels[0], channels[1], value);
  cv::max(value, channels[2], value);
  cv::Mat black = value < 8;
  cv::morphologyEx(black, black, cv::MORPH_OPEN, cv::Mat::ones(7, 7, CV_8U));
  cv::copyMakeBorder(black, black, 1, 1, 1, 1, cv::BORDER_CONSTANT, 255);
  cv::floodFill(black, cv::Point(0, 0), 128);
  return black(cv::Rect(1, 1, bgr.cols, bgr.rows)) != 128;
}

/// Redness that four fifths of the tissue exceed, and the brightness below which colour is noise.
void learn_tissue(const cv::Mat& half_bgr, const cv::Mat& half_organ, const cv::Mat& instrument,
                  SegmentationModel& model) {
  std::vector<float> redness, value;
  for (int y = 0; y < half_bgr.rows; ++y)
    for (int x = 0; x < half_bgr.cols; ++x) {
      if (!half_organ.empty() && !half_organ.at<uchar>(y, x)) continue;
      if (!instrument.empty() && instrument.at<uchar>(y, x)) continue;
      const cv::Vec3b& p = half_bgr.at<cv::Vec3b>(y, x);
      if (value_of(p) < 12) continue;
      value.push_back(static_cast<float>(value_of(p)));
      redness.push_back(static_cast<float>(redness_of(p)) / static_cast<float>(value_of(p)));
    }
  if (value.size() < 100) return;
  model.tissue_redness = std::clamp(percentile(redness, 0.2), 0.2, 0.5);
  model.least_value = std::clamp(0.2 * percentile(value, 0.9), 14.0, 32.0);
}

/// Grey pixels at half size, without the still grey ones of the static frame.
cv::Mat grey_pixels(const cv::Mat& half_bgr, const SegmentationModel& model) {
  cv::Mat mask = metalness(half_bgr, model) >= 128;
  if (model.still_grey.empty()) return mask;
  for (int y = 0; y < mask.rows; ++y) {
    const cv::Vec3b* now = half_bgr.ptr<cv::Vec3b>(y);
    const cv::Vec3b* before = model.reference_half.ptr<cv::Vec3b>(y);
    const uchar* still = model.still_grey.ptr<uchar>(y);
    uchar* row = mask.ptr<uchar>(y);
    for (int x = 0; x < mask.cols; ++x) {
      if (!row[x] || !still[x]) continue;
      const int a = value_of(now[x]), b = value_of(before[x]);
      if (std::abs(a - b) < kUnchanged || std::min(a, b) > kNearSaturation) row[x] = 0;
    }
  }
  return mask;
}

/// The part of the mask that hangs together with the border of the picture, with a margin. A highlight never does; an
/// instrument does, also one that is not recognised yet.
cv::Mat from_border(const cv::Mat& mask, const cv::Mat& half_picture_area) {
  cv::Mat joined, labels;
  cv::dilate(mask, joined, cv::Mat::ones(5, 5, CV_8U));
  const int count = cv::connectedComponents(joined, labels, 8);
  std::vector<uchar> at_border(static_cast<size_t>(count), 0);
  cv::Mat inside;
  cv::erode(half_picture_area, inside, cv::Mat::ones(5, 5, CV_8U), {-1, -1}, 1, cv::BORDER_CONSTANT, 0);
  for (int y = 0; y < labels.rows; ++y)
    for (int x = 0; x < labels.cols; ++x)
      if (!inside.at<uchar>(y, x)) at_border[static_cast<size_t>(labels.at<int>(y, x))] = 255;
  at_border[0] = 0;
  cv::Mat result(mask.size(), CV_8U);
  for (int y = 0; y < labels.rows; ++y)
    for (int x = 0; x < labels.cols; ++x) result.at<uchar>(y, x) = at_border[static_cast<size_t>(labels.at<int>(y, x))];
  return result;
}

/// The blobs that look like instruments, at half size.
cv::Mat instrument_blobs(const cv::Mat& grey, const cv::Mat& half_picture_area) {
  cv::Mat mask;
  cv::morphologyEx(grey, mask, cv::MORPH_OPEN, cv::Mat::ones(3, 3, CV_8U));
  cv::morphologyEx(mask, mask, cv::MORPH_CLOSE, cv::getStructuringElement(cv::MORPH_ELLIPSE, {5, 5}));
  std::vector<std::vector<cv::Point>> outlines;
  cv::findContours(mask, outlines, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  const double least_area = 0.0015 * mask.rows * mask.cols;
  cv::Mat result = cv::Mat::zeros(mask.size(), CV_8U);
  for (size_t i = 0; i < outlines.size(); ++i) {
    if (cv::contourArea(outlines[i]) < least_area) continue;
    cv::Mat blob = cv::Mat::zeros(mask.size(), CV_8U);
    cv::drawContours(blob, outlines, static_cast<int>(i), 255, cv::FILLED);
    if (find_tip(blob, half_picture_area)) result |= blob;
  }
  return result;
}

cv::Mat half_mask(const cv::Mat& mask) {
  cv::Mat half;
  if (!mask.empty())
    cv::resize(mask, half, cv::Size((mask.cols + 1) / 2, (mask.rows + 1) / 2), 0, 0, cv::INTER_NEAREST);
  return half;
}

/// The outline at full resolution: metal within a pixel or two of the coarse mask, holes closed.
cv::Mat refine(const cv::Mat& bgr, const cv::Mat& coarse, const SegmentationModel& model) {
  cv::Mat mask = cv::Mat::zeros(bgr.size(), CV_8U);
  cv::Rect box = cv::boundingRect(coarse);
  if (box.area() == 0) return mask;
  box = cv::Rect(2 * box.x - 8, 2 * box.y - 8, 2 * box.width + 16, 2 * box.height + 16) & cv::Rect({}, bgr.size());
  cv::Mat near, core, upsampled;
  cv::resize(coarse, upsampled, bgr.size(), 0, 0, cv::INTER_NEAREST);
  cv::dilate(upsampled(box), near, cv::Mat::ones(5, 5, CV_8U));
  cv::erode(upsampled(box), core, cv::Mat::ones(7, 7, CV_8U));
  cv::Mat fine = metalness(bgr(box), model);
  cv::medianBlur(fine, fine, 3);
  fine = ((fine >= 128) & near) | core;
  cv::morphologyEx(fine, fine, cv::MORPH_OPEN, cv::Mat::ones(3, 3, CV_8U));
  std::vector<std::vector<cv::Point>> outlines;
  cv::findContours(fine, outlines, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  cv::Mat part = mask(box);
  for (size_t i = 0; i < outlines.size(); ++i)
    if (outlines[i].size() > 40) cv::drawContours(part, outlines, static_cast<int>(i), 255, cv::FILLED);
  return mask;
}

}  // namespace

cv::Mat metalness(const cv::Mat& bgr, const SegmentationModel& model) {
  cv::Mat result(bgr.size(), CV_8U);
  std::array<float, 256> full, per_redness;  // by brightness
  for (int value = 0; value < 256; ++value) {
    const double bright = std::clamp(2 * value / model.least_value - 1, 0.0, 1.0);
    full[static_cast<size_t>(value)] = static_cast<float>(255 * bright);
    per_redness[static_cast<size_t>(value)] =
        static_cast<float>(255 * bright / (model.tissue_redness * std::max(value, 1)));
  }
  for (int y = 0; y < bgr.rows; ++y) {
    const cv::Vec3b* from = bgr.ptr<cv::Vec3b>(y);
    uchar* to = result.ptr<uchar>(y);
    for (int x = 0; x < bgr.cols; ++x) {
      const size_t value = static_cast<size_t>(value_of(from[x]));
      const float redness = static_cast<float>(redness_of(from[x]));
      to[x] = static_cast<uchar>(std::max(0.0f, full[value] - per_redness[value] * redness));
    }
  }
  return result;
}

SegmentationModel learn_segmentation(const cv::Mat& static_bgr, const cv::Mat& organ_mask) {
  SegmentationModel model;
  model.reference_bgr = static_bgr.clone();
  model.reference_half = half_size(static_bgr);
  model.picture_area = find_picture_area(static_bgr);
  const cv::Mat half_organ = half_mask(organ_mask);
  const cv::Mat half_area = half_mask(model.picture_area);

  // Twice, because an instrument inside the organ region would be learnt as pale tissue the first time.
  learn_tissue(model.reference_half, half_organ, {}, model);
  cv::Mat coarse = instrument_blobs(grey_pixels(model.reference_half, model), half_area);
  learn_tissue(model.reference_half, half_organ, coarse, model);
  const cv::Mat grey = grey_pixels(model.reference_half, model);
  coarse = instrument_blobs(grey, half_area);

  model.reference_mask = refine(static_bgr, coarse, model);
  model.still_grey = grey & ~from_border(grey, half_area);
  return model;
}

cv::Mat segment_instrument(const cv::Mat& bgr, const SegmentationModel& model) {
  const cv::Mat coarse = instrument_blobs(grey_pixels(half_size(bgr), model), half_mask(model.picture_area));
  return refine(bgr, coarse, model);
}

}  // namespace palpate
