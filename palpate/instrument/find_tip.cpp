#include "palpate/instrument/find_tip.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "palpate/core/quantile.h"

namespace palpate {

namespace {

/// Everything of an instrument between two neighbouring cross-sections, one pixel thick.
struct Slice {
  double low = 1e9;  ///< signed distances of its edges from the axis, px
  double high = -1e9;
  int pixels = 0;
  bool cut = false;  ///< ends at the border of the picture, so its edges are not the instrument's
  double width() const { return high - low + 1; }
};

struct EdgeLine {
  double offset = 0;
  double slope = 0;
  double deviation = 0;  ///< robust, of the edge points that were used, px
};

/// The part of the image that shows anything.
struct Picture {
  cv::Size size;
  const cv::Mat& area;  ///< 255 inside; may be empty

  bool contains(const cv::Point& p) const {
    return cv::Rect({}, size).contains(p) && (area.empty() || area.at<uchar>(p) != 0);
  }
};

constexpr int kMinPixels = 60;
constexpr double kApartWidths = 2;       // between the places where two shafts enter
constexpr double kShaftFraction = 0.5;   // of the full width that a slice of the shaft has
constexpr double kSleeveFraction = 0.8;  // the same where a thin rod comes out of a sleeve
constexpr double kSolid = 0.85;          // fraction of a slice of the shaft that belongs to the mask
/// What a part may look like, to be an instrument.
struct ShaftShape {
  double straight;  ///< most deviation of the edges from straight lines, in widths
  double taper;     ///< most that they come together, per length
};
constexpr ShaftShape kShaft{0.14, 0.45};      // a straight one, without wrist and jaws
constexpr ShaftShape kVetted{0.3, 1.2};       // of a mask whose parts are instruments: near ones taper, wrists bend
constexpr ShaftShape kByColours{0.09, 0.45};  // of a mask that nothing but colours has made
constexpr double kGapWidths = 3;    // between the border and what is seen of an instrument whose shaft is too dark
constexpr double kGapLength = 1.8;  // of such a part, in its widths
constexpr double kRearEnd = 0.06;   // of its length

/// Pixels of the box that lie within two of the border of the image.
cv::Mat image_border(const cv::Size& size, const cv::Rect& box) {
  cv::Mat border(box.size(), CV_8U, cv::Scalar(255));
  const cv::Rect middle = (cv::Rect(2, 2, size.width - 4, size.height - 4) & box) - box.tl();
  if (middle.area() > 0) border(middle) = 0;
  return border;
}

/// The same for the border of the picture where it does not fill the image.
cv::Mat picture_border(const cv::Mat& picture_area, const cv::Rect& box) {
  cv::Mat eroded;  // a part of an image is eroded with the pixels around it
  cv::erode(picture_area(box), eroded, cv::Mat::ones(5, 5, CV_8U));
  return eroded == 0;
}

bool touches(const std::vector<cv::Point>& pixels, const cv::Mat& border) {
  return std::any_of(pixels.begin(), pixels.end(), [&](const cv::Point& p) { return border.at<uchar>(p) != 0; });
}

std::vector<Slice> slices_along(const std::vector<cv::Point>& pixels, const cv::Mat& border, const cv::Point2d& origin,
                                const cv::Point2d& axis, double& first) {
  double min = 1e9, max = -1e9;
  for (const cv::Point& p : pixels) {
    const double s = (p.x - origin.x) * axis.x + (p.y - origin.y) * axis.y;
    min = std::min(min, s);
    max = std::max(max, s);
  }
  first = min;
  std::vector<Slice> slices(static_cast<size_t>(max - min) + 1);
  for (const cv::Point& p : pixels) {
    const double s = (p.x - origin.x) * axis.x + (p.y - origin.y) * axis.y;
    const double t = (p.y - origin.y) * axis.x - (p.x - origin.x) * axis.y;
    Slice& slice = slices[static_cast<size_t>(s - min)];
    slice.low = std::min(slice.low, t);
    slice.high = std::max(slice.high, t);
    ++slice.pixels;
    if (border.at<uchar>(p)) slice.cut = true;
  }
  return slices;
}

/// Straight line through an edge, by iteratively reweighted least squares (Tukey).
EdgeLine fit_edge(const std::vector<double>& s, const std::vector<double>& t) {
  EdgeLine line;
  std::vector<double> residual(s.size());
  line.offset = median_of(t);
  for (int pass = 0; pass < 8; ++pass) {
    for (size_t i = 0; i < s.size(); ++i) residual[i] = std::abs(t[i] - line.offset - line.slope * s[i]);
    if (pass % 3 == 0) line.deviation = 1.48 * median_of(residual);
    const double limit = 4.7 * std::max(line.deviation, 0.5);
    double w0 = 0, ws = 0, wss = 0, wt = 0, wst = 0;
    for (size_t i = 0; i < s.size(); ++i) {
      const double ratio = residual[i] / limit;
      if (ratio >= 1) continue;
      const double w = (1 - ratio * ratio) * (1 - ratio * ratio);
      w0 += w, ws += w * s[i], wss += w * s[i] * s[i], wt += w * t[i], wst += w * s[i] * t[i];
    }
    const double determinant = w0 * wss - ws * ws;
    if (determinant < 1e-9) break;
    line.slope = (w0 * wst - ws * wt) / determinant;
    line.offset = (wt - line.slope * ws) / w0;
  }
  return line;
}

struct Shaft {
  EdgeLine low, high;
  double width = 0;
  int slices = 0;
  double filled = 0;  ///< fraction of the pixels between the edges that belong to the mask
};

Shaft fit_shaft(const std::vector<Slice>& slices, double min_fraction) {
  Shaft shaft;
  std::vector<double> widths;
  for (const Slice& slice : slices)
    if (slice.pixels > 0 && !slice.cut) widths.push_back(std::min(slice.width(), 1.0 * slice.pixels));
  if (widths.size() < 8) return shaft;
  const double full_width = quantile_of(widths, 0.75);

  std::vector<double> s, low, high, width;
  double area = 0, pixels = 0;
  for (size_t i = 0; i < slices.size(); ++i) {
    const Slice& slice = slices[i];
    if (slice.pixels == 0 || slice.cut || slice.width() < min_fraction * full_width) continue;
    area += slice.width();
    pixels += slice.pixels;
    if (slice.pixels < kSolid * slice.width()) continue;  // between open jaws
    s.push_back(static_cast<double>(i));
    low.push_back(slice.low);
    high.push_back(slice.high);
    width.push_back(slice.width());
  }
  if (s.size() < 8) return shaft;
  shaft.low = fit_edge(s, low);
  shaft.high = fit_edge(s, high);
  shaft.width = median_of(width);
  shaft.slices = static_cast<int>(s.size());
  shaft.filled = pixels / area;
  return shaft;
}

bool looks_like_an_instrument(const Shaft& shaft, double length, const ShaftShape& shape) {
  const double width = shaft.width;
  if (width < 3 || shaft.slices < 0.6 * width || length < 1.3 * width) return false;
  const double straightness = std::max(1.5, shape.straight * width);
  return shaft.low.deviation < straightness && shaft.high.deviation < straightness &&
         std::abs(shaft.high.slope - shaft.low.slope) < shape.taper && shaft.filled > 0.6;
}

/// Whether what is thinner than the sleeve comes straight out of its end.
bool has_rod(const std::vector<Slice>& slices, const Shaft& sleeve) {
  const double margin = std::max(2.0, 0.1 * sleeve.width);
  std::vector<double> s, low, high;
  double last_of_sleeve = 0;
  for (size_t i = 0; i < slices.size(); ++i) {
    const Slice& slice = slices[i];
    if (slice.pixels == 0 || slice.cut) continue;
    const double at = static_cast<double>(i);
    if (slice.low < sleeve.low.offset + sleeve.low.slope * at - margin ||
        slice.high > sleeve.high.offset + sleeve.high.slope * at + margin)
      return false;
    if (slice.width() >= kSleeveFraction * sleeve.width) {
      last_of_sleeve = at;
    } else if (slice.width() >= kShaftFraction * sleeve.width) {
      s.push_back(at), low.push_back(slice.low), high.push_back(slice.high);
    }
  }
  if (s.size() < 8 || s[s.size() / 10] < last_of_sleeve) return false;
  return fit_edge(s, low).deviation < margin && fit_edge(s, high).deviation < margin;
}

/// The far end in coordinates along and across the axis.
cv::Point2d far_end(const std::vector<Slice>& slices, double first, double width) {
  // An end that is only a pixel or two thick is noise of the mask: the tip begins where the slices carry a jaw.
  const double min_pixels = std::max(2.0, 0.06 * width);
  size_t last = slices.size() - 1;
  while (last > 0 && slices[last].pixels < min_pixels) --last;
  double beyond = 0;  // the partly filled slice before the first full one, for sub-pixel precision
  if (last + 1 < slices.size()) beyond = std::min(1.0, slices[last + 1].pixels / min_pixels);
  double across = 0, weight = 0;
  const size_t depth = static_cast<size_t>(std::max(3.0, 0.15 * width));
  for (size_t i = last; i + depth > last && i > 0; --i) {
    if (slices[i].pixels == 0) continue;
    across += 0.5 * (slices[i].low + slices[i].high);
    weight += 1;
  }
  return {first + static_cast<double>(last) + beyond, weight > 0 ? across / weight : 0.0};
}

/// Whether the pixels at the border lie at places further apart than one shaft explains.
bool at_two_places(const std::vector<cv::Point>& entering, double width) {
  constexpr int kReach_px = 3;
  const cv::Rect box = cv::boundingRect(entering);
  if (std::hypot(box.width, box.height) < kApartWidths * width) return false;
  cv::Mat drawn = cv::Mat::zeros(box.size() + cv::Size(2 * kReach_px, 2 * kReach_px), CV_8U);
  for (const cv::Point& p : entering) drawn.at<uchar>(p - box.tl() + cv::Point(kReach_px, kReach_px)) = 255;
  cv::dilate(drawn, drawn, cv::Mat::ones(2 * kReach_px + 1, 2 * kReach_px + 1, CV_8U));
  cv::Mat labels, stats, centres;
  const int count = cv::connectedComponentsWithStats(drawn, labels, stats, centres, 8);
  for (int a = 1; a < count; ++a)
    for (int b = a + 1; b < count; ++b) {
      const cv::Point2d apart(centres.at<double>(a, 0) - centres.at<double>(b, 0),
                              centres.at<double>(a, 1) - centres.at<double>(b, 1));
      if (cv::norm(apart) > kApartWidths * width) return true;
    }
  return false;
}

/// How far the border of the picture is from a pixel in a direction.
double way_to_border_px(const Picture& picture, cv::Point2d from, const cv::Point2d& direction) {
  constexpr double kStep_px = 3;
  double way = 0;
  while (picture.contains(from + way * direction)) way += kStep_px;
  return way;
}

/// The pixels at that end of a part from which the border of the picture is nearest, if it is near enough for the rest
/// of the shaft to be there unseen.
std::vector<cv::Point> rear_end(const std::vector<cv::Point>& pixels, const cv::Point& origin, const Picture& picture) {
  cv::Matx22d spread = cv::Matx22d::zeros();
  cv::Point2d centre(0, 0);
  for (const cv::Point& p : pixels) centre += cv::Point2d(p) * (1.0 / static_cast<double>(pixels.size()));
  for (const cv::Point& p : pixels) {
    const cv::Point2d d = cv::Point2d(p) - centre;
    spread += cv::Matx22d(d.x * d.x, d.x * d.y, d.x * d.y, d.y * d.y);
  }
  const double angle = 0.5 * std::atan2(2 * spread(0, 1), spread(0, 0) - spread(1, 1));
  const cv::Point2d axis(std::cos(angle), std::sin(angle));
  double min = 1e9, max = -1e9;
  for (const cv::Point& p : pixels) {
    const double s = (cv::Point2d(p) - centre).dot(axis);
    min = std::min(min, s), max = std::max(max, s);
  }
  const double length = max - min, width = static_cast<double>(pixels.size()) / std::max(1.0, length);
  const cv::Point2d from = centre + cv::Point2d(origin);
  const double behind = way_to_border_px(picture, from + min * axis, -axis);
  const double ahead = way_to_border_px(picture, from + max * axis, axis);
  if (length < kGapLength * width || std::min(behind, ahead) > kGapWidths * width) return {};
  std::vector<cv::Point> end;
  for (const cv::Point& p : pixels) {
    const double s = (cv::Point2d(p) - centre).dot(axis), from_end = behind <= ahead ? s - min : max - s;
    if (from_end <= kRearEnd * length) end.push_back(p);
  }
  return end;
}

std::optional<ImageTip> tip_of_component(const std::vector<cv::Point>& pixels, const cv::Mat& border,
                                         const cv::Point& origin, const Picture& picture, const ShaftShape& shape) {
  cv::Point2d entry(0, 0);
  std::vector<cv::Point> entering;
  for (const cv::Point& p : pixels)
    if (border.at<uchar>(p)) entering.push_back(p);
  if (entering.empty()) entering = rear_end(pixels, origin, picture);
  if (entering.empty()) return {};
  for (const cv::Point& p : entering) entry += cv::Point2d(p);
  entry *= 1.0 / static_cast<double>(entering.size());

  cv::Point2d axis(0, 0);
  double farthest = 0;
  for (const cv::Point& p : pixels) {
    const cv::Point2d away = cv::Point2d(p) - entry;
    if (const double squared = away.dot(away); squared > farthest) farthest = squared, axis = away;
  }
  farthest = std::sqrt(farthest);
  if (farthest < 8) return {};
  axis *= 1 / farthest;

  double first = 0;
  Shaft shaft;
  std::vector<Slice> slices;
  for (int pass = 0; pass < 3; ++pass) {
    slices = slices_along(pixels, border, entry, axis, first);
    shaft = fit_shaft(slices, kShaftFraction);
    if (shaft.slices == 0) return {};
    if (pass == 2) break;
    const double turn = std::atan(0.5 * (shaft.low.slope + shaft.high.slope));
    axis = cv::Point2d(axis.x * std::cos(turn) - axis.y * std::sin(turn),
                       axis.x * std::sin(turn) + axis.y * std::cos(turn));
  }
  const ShaftShape& strict = shape.straight < kShaft.straight ? shape : kShaft;
  if (!looks_like_an_instrument(shaft, farthest, strict)) {
    const Shaft sleeve = fit_shaft(slices, kSleeveFraction);
    if (has_rod(slices, sleeve) && looks_like_an_instrument(sleeve, farthest, strict)) shaft = sleeve;
  }
  if (!looks_like_an_instrument(shaft, farthest, shape) || at_two_places(entering, shaft.width)) return {};

  const cv::Point2d end = far_end(slices, first, shaft.width);
  ImageTip tip;
  tip.axis = axis;
  tip.width_px = shaft.width;
  tip.tip_px = entry + end.x * axis + end.y * cv::Point2d(-axis.y, axis.x);
  return tip;
}

std::vector<ImageInstrument> instruments_in(const cv::Mat& instrument_mask, const cv::Mat& picture_area, size_t max,
                                            const ShaftShape& shape) {
  std::vector<ImageInstrument> found;
  const cv::Rect box = cv::boundingRect(instrument_mask);
  if (box.area() < kMinPixels) return found;
  const cv::Mat border = image_border(instrument_mask.size(), box);
  cv::Mat labels, stats, centres;
  const int count = cv::connectedComponentsWithStats(instrument_mask(box), labels, stats, centres, 8);
  std::vector<int> by_size;
  for (int i = 1; i < count; ++i)
    if (stats.at<int>(i, cv::CC_STAT_AREA) >= kMinPixels) by_size.push_back(i);
  std::sort(by_size.begin(), by_size.end(),
            [&](int a, int b) { return stats.at<int>(a, cv::CC_STAT_AREA) > stats.at<int>(b, cv::CC_STAT_AREA); });
  for (int label : by_size) {
    if (found.size() == max) break;
    std::vector<cv::Point> pixels;
    const cv::Mat part = labels == label;
    cv::findNonZero(part, pixels);
    const bool from_image_border = touches(pixels, border) || picture_area.empty();
    if (auto tip = tip_of_component(pixels, from_image_border ? border : picture_border(picture_area, box), box.tl(),
                                    {instrument_mask.size(), picture_area}, shape)) {
      tip->tip_px += cv::Point2d(box.tl());
      found.push_back({*tip, box, part});
    }
  }
  return found;
}

}  // namespace

std::vector<ImageInstrument> find_instruments(const cv::Mat& instrument_mask, const cv::Mat& picture_area, size_t max) {
  return instruments_in(instrument_mask, picture_area, max, kVetted);
}

std::optional<ImageTip> find_tip(const cv::Mat& instrument_mask, const cv::Mat& picture_area) {
  const std::vector<ImageInstrument> found = instruments_in(instrument_mask, picture_area, 1, kByColours);
  if (found.empty()) return {};
  return found[0].tip;
}

}  // namespace palpate
