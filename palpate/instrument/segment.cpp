#include "palpate/instrument/segment.h"

#include <algorithm>
#include <array>
#include <opencv2/imgproc.hpp>

#include "palpate/core/quantile.h"
#include "palpate/instrument/find_tip.h"

namespace palpate {

namespace {

constexpr int kColourNoise = 2;       // grey levels by which a grey pixel may look red
constexpr int kOliveQuarters = 2;     // of the green over the blue that counts as red
constexpr int kUnchanged = 24;        // grey levels between two pictures of the same still highlight
constexpr int kNearSaturation = 200;  // both brighter than this: a highlight that flickers
constexpr int kTissueMoves = 7;       // px at half size, twice the way and one
constexpr int kNearby = 15;           // px at half size
constexpr int kOtherRedness = 13;     // 255ths beyond what was seen nearby
constexpr double kContinuedWidths = 4;
constexpr double kMinContinued_px = 3;   // at half size
constexpr double kMinNew = 0.2;          // fraction of an instrument that was not there in the static frame
constexpr double kMuchMore = 1.5;        // times what was found without what is still
constexpr double kLeftFraction = 0.9;    // of a part that stood still, where tissue shows instead
constexpr double kLit = 1.5;             // times min_value, to tell tissue from shadow
constexpr double kBlack = 8;             // grey levels of what is around the picture
constexpr double kBlackFraction = 0.05;  // the same, of the picture's brightness, where the surround is lit a little
constexpr int kDarkest = 12;             // grey levels
constexpr double kPalest = 0.08;         // redness of tissue that can still be told from metal
constexpr double kReddest = 0.6;
constexpr int kPlace = 8;   // px at half size over which the redness of tissue is averaged
constexpr int kAround = 3;  // places to each side
constexpr size_t kMinPlaces = 4;
constexpr double kClearlyPaler = 0.5;  // as a fraction of the organ's redness

cv::Mat half_size(const cv::Mat& image) {
  cv::Mat half;
  cv::resize(image, half, cv::Size((image.cols + 1) / 2, (image.rows + 1) / 2), 0, 0, cv::INTER_AREA);
  return half;
}

/// Red over green, and only a little of green over blue: metal may be olive or brown.
int redness_of(int b, int g, int r) {
  const int redness = r - g + (b < g ? ((g - b) * kOliveQuarters) / 4 : 0) - kColourNoise;
  return redness > 0 ? redness : 0;
}

int redness_of(const cv::Vec3b& p) {
  return redness_of(p[0], p[1], p[2]);
}

int value_of(const cv::Vec3b& p) {
  return std::max({p[0], p[1], p[2]});
}

/// How much pixels look like metal beside tissue of the given redness; see metalness.
cv::Mat metalness_beside(const cv::Mat& bgr, const cv::Mat& tissue_redness, double min_value) {
  cv::Mat result(bgr.size(), CV_8U);
  cv::Mat planes[3];
  cv::split(bgr, planes);  // so that the compiler can take many pixels at once
  const float per_min = static_cast<float>(2 / min_value);
  const int columns = bgr.cols;
  for (int y = 0; y < bgr.rows; ++y) {
    const uchar* __restrict blue = planes[0].ptr<uchar>(y);
    const uchar* __restrict green = planes[1].ptr<uchar>(y);
    const uchar* __restrict red = planes[2].ptr<uchar>(y);
    const uchar* __restrict tissue = tissue_redness.ptr<uchar>(y);
    uchar* __restrict to = result.ptr<uchar>(y);
    for (int x = 0; x < columns; ++x) {
      const int b = blue[x], g = green[x], r = red[x];
      const int max = b < g ? g : b, value = r < max ? max : r;
      const int redness = redness_of(b, g, r);
      const float of_tissue = 255.0f * static_cast<float>(redness) / static_cast<float>(value * tissue[x] + 1);
      const float bright = per_min * static_cast<float>(value) - 1;
      const float lit = bright < 0 ? 0 : bright > 1 ? 1 : bright;
      to[x] = static_cast<uchar>(static_cast<int>(255 * lit * (of_tissue > 1 ? 0 : 1 - of_tissue)));
    }
  }
  return result;
}

/// What static tissue looks like: pixels at half size that are neither instrument, highlight, nor dark.
struct StaticTissue {
  const cv::Mat& half_bgr;
  cv::Mat half_organ;  ///< 255 = surely tissue; may be empty
  cv::Mat instrument;  ///< 255 = not tissue; may be empty

  bool shows(int y, int x) const { return instrument.empty() || !instrument.at<uchar>(y, x); }
  bool is_organ(int y, int x) const { return half_organ.empty() || half_organ.at<uchar>(y, x); }
  const cv::Vec3b& at(int y, int x) const { return half_bgr.at<cv::Vec3b>(y, x); }
};

float relative_redness(const cv::Vec3b& p) {
  return static_cast<float>(redness_of(p)) / static_cast<float>(std::max(value_of(p), 1));
}

/// Redness that four fifths of the organ exceed, and the brightness below which colour is noise.
double learn_organ(const StaticTissue& tissue, SegmentationModel& model) {
  std::vector<float> redness, value;
  for (int y = 0; y < tissue.half_bgr.rows; ++y)
    for (int x = 0; x < tissue.half_bgr.cols; ++x) {
      const cv::Vec3b& p = tissue.at(y, x);
      if (!tissue.is_organ(y, x) || !tissue.shows(y, x) || value_of(p) < kDarkest) continue;
      value.push_back(static_cast<float>(value_of(p)));
      redness.push_back(relative_redness(p));
    }
  if (value.size() < 100) return kReddest;
  model.min_value = std::clamp(0.2 * quantile_of(value, 0.9), 14.0, 32.0);
  return quantile_of(redness, 0.2);
}

/// The same redness everywhere.
void learn_redness_everywhere(const StaticTissue& tissue, SegmentationModel& model) {
  const double redness = std::clamp(learn_organ(tissue, model), kPalest, kReddest);
  model.tissue_redness_half = cv::Mat(model.reference_half.size(), CV_8U, cv::Scalar(255 * redness));
  model.tissue_redness = cv::Mat(model.reference_bgr.size(), CV_8U, cv::Scalar(255 * redness));
}

/// The redness that four fifths of the tissue around each place exceed.
void learn_redness_of_places(const StaticTissue& tissue, SegmentationModel& model) {
  const double everywhere = std::clamp(learn_organ(tissue, model), kPalest, kReddest);
  const int rows = tissue.half_bgr.rows / kPlace + 1, columns = tissue.half_bgr.cols / kPlace + 1;
  cv::Mat places(rows, columns, CV_32F, cv::Scalar(-1));
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const cv::Rect box =
          cv::Rect(column * kPlace, row * kPlace, kPlace, kPlace) & cv::Rect({}, tissue.half_bgr.size());
      float sum = 0;
      int count = 0;
      for (int y = box.y; y < box.br().y; ++y)
        for (int x = box.x; x < box.br().x; ++x) {
          const cv::Vec3b& p = tissue.at(y, x);
          if (!tissue.shows(y, x) || value_of(p) < model.min_value || value_of(p) > kNearSaturation) continue;
          sum += relative_redness(p);
          ++count;
        }
      if (count > kPlace * kPlace / 4) places.at<float>(row, column) = sum / static_cast<float>(count);
    }
  cv::Mat around(rows, columns, CV_32F);
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      std::vector<float> values;
      for (int y = std::max(0, row - kAround); y <= std::min(rows - 1, row + kAround); ++y)
        for (int x = std::max(0, column - kAround); x <= std::min(columns - 1, column + kAround); ++x)
          if (places.at<float>(y, x) >= 0) values.push_back(places.at<float>(y, x));
      double redness = values.size() < kMinPlaces ? everywhere : quantile_of(values, 0.2);
      if (redness > kClearlyPaler * everywhere) redness = everywhere;
      around.at<float>(row, column) = static_cast<float>(255 * std::max(redness, kPalest));
    }
  cv::Mat large;
  cv::resize(around, large, {columns * kPlace, rows * kPlace}, 0, 0, cv::INTER_LINEAR);
  large(cv::Rect({}, tissue.half_bgr.size())).convertTo(model.tissue_redness_half, CV_8U);
  cv::resize(model.tissue_redness_half, model.tissue_redness, model.reference_bgr.size(), 0, 0, cv::INTER_LINEAR);
}

cv::Mat grey_pixels(const cv::Mat& half_bgr, const SegmentationModel& model) {
  return metalness_beside(half_bgr, model.tissue_redness_half, model.min_value) >= 128;
}

/// Those of the grey pixels that look like what is still there since the static frame.
cv::Mat still_pixels(const cv::Mat& grey, const cv::Mat& half_bgr, const SegmentationModel& model) {
  cv::Mat still = cv::Mat::zeros(grey.size(), CV_8U);
  for (int y = 0; y < grey.rows; ++y) {
    const cv::Vec3b* now = half_bgr.ptr<cv::Vec3b>(y);
    const uchar* is_grey = grey.ptr<uchar>(y);
    const uchar* darkest = model.still_darkest.ptr<uchar>(y);
    const uchar* brightest = model.still_brightest.ptr<uchar>(y);
    uchar* row = still.ptr<uchar>(y);
    for (int x = 0; x < grey.cols; ++x) {
      if (!is_grey[x] || darkest[x] > brightest[x]) continue;
      const int value = value_of(now[x]);
      const bool flickers = std::min<int>(value, brightest[x]) > kNearSaturation;
      if (flickers || (value > darkest[x] - kUnchanged && value < brightest[x] + kUnchanged)) row[x] = 255;
    }
  }
  return still;
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
  const double min_area = 0.0015 * mask.rows * mask.cols;
  cv::Mat result = cv::Mat::zeros(mask.size(), CV_8U), inside;
  cv::erode(half_picture_area, inside, cv::Mat::ones(5, 5, CV_8U), {-1, -1}, 1, cv::BORDER_CONSTANT, 0);
  const auto at_border = [&inside](const cv::Point& p) { return !inside.at<uchar>(p); };
  for (size_t i = 0; i < outlines.size(); ++i) {
    if (cv::contourArea(outlines[i]) < min_area) continue;
    // What only comes near it is, by its colours alone, as likely a highlight.
    if (std::none_of(outlines[i].begin(), outlines[i].end(), at_border)) continue;
    cv::Mat blob = cv::Mat::zeros(mask.size(), CV_8U);
    cv::drawContours(blob, outlines, static_cast<int>(i), 255, cv::FILLED);
    if (find_tip(blob, half_picture_area)) result |= blob;
  }
  return result;
}

/// What is grey in the static frame and no instrument.
void learn_still(const cv::Mat& grey, const cv::Mat& instrument, const cv::Mat& half_area, SegmentationModel& model) {
  cv::Mat around_instrument;
  cv::dilate(instrument, around_instrument, cv::Mat::ones(5, 5, CV_8U));
  const cv::Mat still = grey & ~around_instrument;
  model.still_darkest = cv::Mat(grey.size(), CV_8U, cv::Scalar(255));
  model.still_brightest = cv::Mat::zeros(grey.size(), CV_8U);
  for (int y = 0; y < grey.rows; ++y)
    for (int x = 0; x < grey.cols; ++x)
      if (still.at<uchar>(y, x))
        model.still_darkest.at<uchar>(y, x) = model.still_brightest.at<uchar>(y, x) =
            static_cast<uchar>(value_of(model.reference_half.at<cv::Vec3b>(y, x)));
  const cv::Mat at_border = from_border(grey, half_area);
  // Tissue moves a little; a highlight that does is new each time.
  cv::Mat nearby;
  cv::dilate(still & at_border, nearby, cv::Mat::ones(kTissueMoves, kTissueMoves, CV_8U));
  cv::Mat darkest, brightest;
  cv::erode(model.still_darkest, darkest, cv::Mat::ones(kTissueMoves, kTissueMoves, CV_8U));
  cv::dilate(model.still_brightest, brightest, cv::Mat::ones(kTissueMoves, kTissueMoves, CV_8U));
  darkest.copyTo(model.still_darkest, nearby);
  brightest.copyTo(model.still_brightest, nearby);
  model.still_at_border = nearby;
  cv::Mat labels;
  cv::connectedComponents(nearby, labels, 8);
  labels.convertTo(model.still_parts, CV_8U);  // more than 255 share the last number
  model.still_parts.setTo(0, ~(still & at_border));
}

cv::Mat half_mask(const cv::Mat& mask) {
  cv::Mat half;
  if (!mask.empty())
    cv::resize(mask, half, cv::Size((mask.cols + 1) / 2, (mask.rows + 1) / 2), 0, 0, cv::INTER_NEAREST);
  return half;
}

cv::Mat redness_image(const cv::Mat& bgr) {
  cv::Mat result(bgr.size(), CV_8U);
  for (int y = 0; y < bgr.rows; ++y)
    for (int x = 0; x < bgr.cols; ++x)
      result.at<uchar>(y, x) = static_cast<uchar>(255 * relative_redness(bgr.at<cv::Vec3b>(y, x)));
  return result;
}

/// Wrist and jaws that reflect the tissue's red have lost what tells metal from tissue; but where the shaft points, the
/// picture has another redness than anything the static frame showed nearby. Returns those pixels that continue the
/// instruments of a mask, half size.
cv::Mat continued(const cv::Mat& half_bgr, const cv::Mat& grey, const cv::Mat& mask, const SegmentationModel& model) {
  cv::Mat result = cv::Mat::zeros(mask.size(), CV_8U);
  for (const ImageInstrument& instrument : find_instruments(mask, model.picture_area_half)) {
    const ImageTip& tip = instrument.tip;
    const cv::Point2d side = 0.6 * tip.width_px * cv::Point2d(-tip.axis.y, tip.axis.x);
    const cv::Point2d back = tip.tip_px - tip.width_px * tip.axis;
    const cv::Point2d ahead = tip.tip_px + kContinuedWidths * tip.width_px * tip.axis;
    const std::vector<cv::Point> corners = {back + side, ahead + side, ahead - side, back - side};
    const cv::Rect box = cv::boundingRect(corners) & cv::Rect({}, mask.size());
    if (box.area() == 0) continue;
    cv::Mat strip = cv::Mat::zeros(box.size(), CV_8U);
    std::vector<cv::Point> moved;
    for (const cv::Point& corner : corners) moved.push_back(corner - box.tl());
    cv::fillConvexPoly(strip, moved, 255);

    cv::Mat own = cv::Mat::zeros(mask.size(), CV_8U), others;
    instrument.mask.copyTo(own(instrument.box));
    own = own(box);
    cv::dilate(mask(box) & ~own, others, cv::Mat::ones(7, 7, CV_8U));  // it must not grow into another one
    strip &= ~others;

    cv::Mat part;
    cv::blur(half_bgr(box), part, {3, 3});
    const cv::Mat redness = redness_image(part);
    cv::Mat joined = cv::Mat::zeros(box.size(), CV_8U);
    for (int y = 0; y < box.height; ++y)
      for (int x = 0; x < box.width; ++x) {
        const int value = value_of(part.at<cv::Vec3b>(y, x)), now = redness.at<uchar>(y, x);
        if (!strip.at<uchar>(y, x) || value < model.min_value || value > kNearSaturation) continue;
        const int min = model.min_redness_half(box).at<uchar>(y, x), max = model.max_redness_half(box).at<uchar>(y, x);
        if (now < min - kOtherRedness || now > max + kOtherRedness) joined.at<uchar>(y, x) = 255;
      }
    joined |= strip & (grey(box) | own);
    cv::morphologyEx(joined, joined, cv::MORPH_OPEN, cv::Mat::ones(3, 3, CV_8U));
    cv::morphologyEx(joined, joined, cv::MORPH_CLOSE, cv::getStructuringElement(cv::MORPH_ELLIPSE, {5, 5}));
    cv::Mat labels;
    const int count = cv::connectedComponents(joined, labels, 8);
    std::vector<uchar> hangs_on(static_cast<size_t>(count), 0);
    for (int y = 0; y < box.height; ++y)
      for (int x = 0; x < box.width; ++x)
        if (own.at<uchar>(y, x)) hangs_on[static_cast<size_t>(labels.at<int>(y, x))] = 255;
    hangs_on[0] = 0;
    cv::Mat further = cv::Mat::zeros(box.size(), CV_8U);
    double farthest = 0;
    for (int y = 0; y < box.height; ++y)
      for (int x = 0; x < box.width; ++x) {
        if (!hangs_on[static_cast<size_t>(labels.at<int>(y, x))] || mask(box).at<uchar>(y, x) || others.at<uchar>(y, x))
          continue;
        further.at<uchar>(y, x) = 255;
        farthest = std::max(farthest, (cv::Point2d(x + box.x, y + box.y) - tip.tip_px).dot(tip.axis));
      }
    // Less than that is the blurred edge of what was found.
    if (farthest > kMinContinued_px) result(box) |= further;
  }
  return result;
}

/// A part of a half-size mask at full size.
cv::Mat doubled(const cv::Mat& half, const cv::Rect& part) {
  cv::Mat result(part.size(), CV_8U);
  for (int y = 0; y < part.height; ++y) {
    const uchar* from = half.ptr<uchar>((y + part.y) / 2);
    uchar* to = result.ptr<uchar>(y);
    for (int x = 0; x < part.width; ++x) to[x] = from[(x + part.x) / 2];
  }
  return result;
}

/// The outline at full resolution: metal within a pixel or two of the coarse mask, holes closed. `sure` needs no metal.
cv::Mat refine(const cv::Mat& bgr, const cv::Mat& coarse, const cv::Mat& sure, const SegmentationModel& model) {
  cv::Mat mask = cv::Mat::zeros(bgr.size(), CV_8U);
  cv::Rect box = cv::boundingRect(coarse);
  if (box.area() == 0) return mask;
  box = cv::Rect(2 * box.x - 8, 2 * box.y - 8, 2 * box.width + 16, 2 * box.height + 16) & cv::Rect({}, bgr.size());
  cv::Mat near, core;
  const cv::Mat upsampled = doubled(coarse, box);
  cv::dilate(upsampled, near, cv::Mat::ones(5, 5, CV_8U));
  cv::erode(upsampled, core, cv::Mat::ones(7, 7, CV_8U));
  cv::Mat fine = metalness(bgr, box, model);
  cv::medianBlur(fine, fine, 3);
  fine = ((fine >= 128) & near) | core;
  if (!sure.empty()) fine |= doubled(sure, box);
  cv::morphologyEx(fine, fine, cv::MORPH_OPEN, cv::Mat::ones(3, 3, CV_8U));
  std::vector<std::vector<cv::Point>> outlines;
  cv::findContours(fine, outlines, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  cv::Mat part = mask(box);
  for (size_t i = 0; i < outlines.size(); ++i)
    if (outlines[i].size() > 40) cv::drawContours(part, outlines, static_cast<int>(i), 255, cv::FILLED);
  return mask;
}

}  // namespace

cv::Mat find_picture_area(const cv::Mat& bgr) {
  cv::Mat value, channels[3];
  cv::split(bgr, channels);
  cv::max(channels[0], channels[1], value);
  cv::max(value, channels[2], value);
  std::vector<uchar> some;
  for (int y = 0; y < value.rows; y += 4)
    for (int x = 0; x < value.cols; x += 4) some.push_back(value.at<uchar>(y, x));
  cv::Mat black = value < std::max(kBlack, kBlackFraction * quantile_of(some, 0.95));
  cv::morphologyEx(black, black, cv::MORPH_OPEN, cv::Mat::ones(7, 7, CV_8U));
  cv::copyMakeBorder(black, black, 1, 1, 1, 1, cv::BORDER_CONSTANT, 255);
  cv::floodFill(black, cv::Point(0, 0), 128);
  return black(cv::Rect(1, 1, bgr.cols, bgr.rows)) != 128;
}

cv::Mat metalness(const cv::Mat& bgr, const cv::Rect& part, const SegmentationModel& model) {
  return metalness_beside(bgr(part), model.tissue_redness(part), model.min_value);
}

void forget_what_left(const cv::Mat& bgr, SegmentationModel& model) {
  const cv::Rect box = cv::boundingRect(model.still_parts);
  if (box.area() == 0) return;
  const cv::Rect full = cv::Rect(2 * box.tl(), box.size() * 2) & cv::Rect({}, bgr.size());
  const cv::Mat half = half_size(bgr(full));
  const cv::Mat metal = metalness_beside(half, model.tissue_redness_half(box), model.min_value);
  const cv::Mat parts = model.still_parts(box);
  std::array<int, 256> all{}, tissue{};
  for (int y = 0; y < box.height; ++y)
    for (int x = 0; x < box.width; ++x) {
      const uchar part = parts.at<uchar>(y, x);
      ++all[part];
      tissue[part] += metal.at<uchar>(y, x) < 128 && value_of(half.at<cv::Vec3b>(y, x)) > kLit * model.min_value;
    }
  for (int part = 1; part < 256; ++part) {
    const size_t at = static_cast<size_t>(part);
    if (all[at] == 0 || tissue[at] < kLeftFraction * all[at]) continue;
    cv::Mat place;
    cv::dilate(model.still_parts == part, place, cv::Mat::ones(kTissueMoves, kTissueMoves, CV_8U));
    model.still_darkest.setTo(255, place);
    model.still_brightest.setTo(0, place);
    model.still_at_border.setTo(0, place);
    model.still_parts.setTo(0, model.still_parts == part);
  }
}

SegmentationModel learn_segmentation(const cv::Mat& static_bgr, const cv::Mat& organ_mask) {
  SegmentationModel model;
  model.reference_bgr = static_bgr.clone();
  model.reference_half = half_size(static_bgr);
  model.picture_area = find_picture_area(static_bgr);
  const cv::Mat half_organ = half_mask(organ_mask);
  model.picture_area_half = half_mask(model.picture_area);
  const cv::Mat& half_area = model.picture_area_half;

  // Several times, because an instrument inside the organ region would be learnt as pale tissue the first time.
  learn_redness_everywhere({model.reference_half, half_organ, {}}, model);
  cv::Mat coarse = instrument_blobs(grey_pixels(model.reference_half, model), half_area);
  learn_redness_everywhere({model.reference_half, half_organ, coarse}, model);
  cv::Mat grey = grey_pixels(model.reference_half, model);
  cv::Mat perhaps_instrument = instrument_blobs(grey, half_area) | from_border(grey, half_area);
  cv::dilate(perhaps_instrument, perhaps_instrument, cv::Mat::ones(5, 5, CV_8U));
  learn_redness_of_places({model.reference_half, half_organ, perhaps_instrument}, model);
  grey = grey_pixels(model.reference_half, model);
  coarse = instrument_blobs(grey, half_area);

  model.reference_mask = refine(static_bgr, coarse, {}, model);
  learn_still(grey, coarse, half_area, model);
  cv::Mat smooth;
  cv::blur(model.reference_half, smooth, {3, 3});
  const cv::Mat redness = redness_image(smooth), nearby = cv::Mat::ones(kNearby, kNearby, CV_8U);
  cv::erode(redness, model.min_redness_half, nearby);
  cv::dilate(redness, model.max_redness_half, nearby);
  return model;
}

cv::Mat segment_instrument(const cv::Mat& bgr, const SegmentationModel& model) {
  const cv::Mat half = half_size(bgr), &half_area = model.picture_area_half;
  const cv::Mat grey = grey_pixels(half, model), still = still_pixels(grey, half, model);
  cv::Mat coarse = instrument_blobs(grey & ~still, half_area);
  // An instrument that stood at the border in the static frame, too short to be recognised, hangs on what is still, or
  // is cut in two by it.
  if (cv::countNonZero(still & model.still_at_border) > 0) {
    const cv::Mat joined = instrument_blobs(grey & ~(still & ~model.still_at_border), half_area);
    const int now = cv::countNonZero(joined), fresh = cv::countNonZero(joined & ~still);
    if (fresh >= kMinNew * now && fresh > kMuchMore * cv::countNonZero(coarse)) coarse = joined;
  }
  if (cv::countNonZero(coarse) == 0) return cv::Mat::zeros(bgr.size(), CV_8U);
  const cv::Mat further = continued(half, grey & ~still, coarse, model);
  return refine(bgr, coarse | further, further, model);
}

}  // namespace palpate
