#include "palpate/feedback/overlay.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/utility.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "palpate/feedback/axis.h"
#include "palpate/feedback/draw.h"
#include "palpate/feedback/warnings.h"

namespace palpate {
namespace {

const cv::Scalar kGood{110, 210, 90}, kIdle{190, 190, 190}, kDoubt{60, 180, 250}, kCaution{60, 225, 250};

/// The colour bar begins at the stress of this strain, so that noise does not fill it.
constexpr double kStrainOfLowestScale = 0.02;
/// Share of the surface whose stress may lie above the scale: at the rim of the patch that the tip holds, stress grows
/// without limit under refinement, and a scale that followed it would show nothing of the rest.
constexpr double kFractionAboveScale = 0.01;
/// Share of the scale from which on stress has its full opacity.
constexpr double kFractionOfFullOpacity = 0.35;

struct Tint {
  float alpha = 0;
  cv::Vec3f bgr;
};

std::array<Tint, 256> tints_of(const ColourTable& colours, double opacity) {
  std::array<Tint, 256> tints;
  for (size_t i = 0; i < tints.size(); ++i) {
    const double t = std::min(1.0, static_cast<double>(i) / 255 / kFractionOfFullOpacity);
    tints[i].alpha = static_cast<float>(opacity * t * t * (3 - 2 * t));
    tints[i].bgr = cv::Vec3f(colours[i][0], colours[i][1], colours[i][2]);
  }
  return tints;
}

/// Rectified pixel of every pixel of the left image as recorded.
cv::Mat rectified_pixels(const Rectification& r, const cv::Size& size) {
  std::vector<cv::Point2d> recorded;
  recorded.reserve(static_cast<size_t>(size.area()));
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) recorded.emplace_back(x, y);
  cv::Mat pixels(size, CV_16SC2);
  auto pixel = pixels.begin<cv::Vec2s>();
  for (const cv::Point2d& place : undistorted(r.rig.left, recorded)) {
    const cv::Point2d px = project_to_rectified(r, Vec3(place.x, place.y, 1));
    *pixel++ = cv::Vec2s(cv::saturate_cast<short>(px.x), cv::saturate_cast<short>(px.y));
  }
  return pixels;
}

bool has_force(const ForceEstimate& estimate) {
  return estimate.status == FrameStatus::ok || estimate.status == FrameStatus::map_stale;
}

bool stress_is_trusted(const ForceEstimate& estimate) {
  const bool any_force =
      has_force(estimate) || std::any_of(estimate.further.begin(), estimate.further.end(), has_force);
  return any_force && !estimate.deformed_nodes_mm.empty() &&
         estimate.node_von_mises_kPa.size() == estimate.deformed_nodes_mm.size();
}

double greatest_stress_kPa(const ForceEstimate& estimate) {
  double greatest = estimate.max_von_mises_kPa;
  for (const ForceEstimate& other : estimate.further) greatest = std::max(greatest, other.max_von_mises_kPa);
  return greatest;
}

/// Of all instruments, each once.
std::vector<std::string> all_warnings(const ForceEstimate& estimate) {
  std::vector<std::string> warnings = estimate.warnings;
  for (const ForceEstimate& other : estimate.further)
    for (const std::string& name : other.warnings)
      if (std::find(warnings.begin(), warnings.end(), name) == warnings.end()) warnings.push_back(name);
  return warnings;
}

/// The stress that `kShareAboveScale` of the surface exceeds, kPa.
double characteristic_stress_kPa(const ForceEstimate& e) {
  std::vector<std::pair<double, double>> stress_and_area;
  double total_area = 0;
  for (const Triangle& t : e.boundary) {
    const size_t a = static_cast<size_t>(t[0]), b = static_cast<size_t>(t[1]), c = static_cast<size_t>(t[2]);
    const std::vector<Vec3>& p = e.deformed_nodes_mm;
    const double area = 0.5 * (p[b] - p[a]).cross(p[c] - p[a]).norm();
    const std::vector<double>& stress = e.node_von_mises_kPa;
    stress_and_area.emplace_back((stress[a] + stress[b] + stress[c]) / 3, area);
    total_area += area;
  }
  std::sort(stress_and_area.begin(), stress_and_area.end(), std::greater<>());
  double area_above = 0;
  for (const auto& [stress, area] : stress_and_area)
    if ((area_above += area) >= kFractionAboveScale * total_area) return stress;
  return 0;
}

std::pair<std::string, cv::Scalar> words_of(FrameStatus status) {
  switch (status) {
    case FrameStatus::ok:
      return {"contact", kGood};
    case FrameStatus::no_contact:
      return {"no contact", kIdle};
    case FrameStatus::tool_lost:
      return {"instrument not seen", kDoubt};
    case FrameStatus::not_converged:
      return {"contact, no solution", kDoubt};
    case FrameStatus::map_stale:
      return {"map out of date", kDoubt};
  }
  return {"", kIdle};
}

/// 1 inside the radius, falling to 0 over its last third.
float nearby(const Vec3& point, const Vec3& centre, double radius_mm) {
  const double t = std::clamp(3 * (1 - (point - centre).norm() / radius_mm), 0.0, 1.0);
  return static_cast<float>(t * t * (3 - 2 * t));
}

float near_a_tip(const Vec3& point, const ForceEstimate& estimate, double radius_mm) {
  float nearest = has_force(estimate) ? nearby(point, estimate.tip_mm, radius_mm) : 0;
  for (const ForceEstimate& other : estimate.further)
    if (has_force(other)) nearest = std::max(nearest, nearby(point, other.tip_mm, radius_mm));
  return nearest;
}

cv::Point clamped(const cv::Point& p, const cv::Rect& area) {
  return {std::clamp(p.x, area.x, area.br().x), std::clamp(p.y, area.y, area.br().y)};
}

}  // namespace

void describe(Settings& settings, OverlayOptions& o) {
  settings.choice("region", o.region, {{"whole", OverlayRegion::whole}, {"around", OverlayRegion::around}},
                  "stress on the whole organ, or only around the instrument");
  settings.number("radius_mm", o.radius_mm, {.min = 1, .max = 200}, "radius of region: around");
  settings.choice("colour_map", o.colour_map, {{"viridis", ColourMap::viridis}, {"jet", ColourMap::jet}},
                  "viridis: perceptually ordered; jet: as in the paper");
  settings.number("opacity", o.opacity, {.min = 0, .max = 1}, "of the colour at the highest stress");
  settings.number("stress_scale_kPa", o.stress_scale_kPa, {.min = 0, .max = 1e9},
                  "end of the colour bar; 0 = follows the stress in round steps, never down");
  settings.flag("chart", o.chart, "draw the force over time");
  settings.number("chart_duration_s", o.chart_duration_s, {.min = 1, .max = 600}, "time that the chart shows");
}

OverlayPainter::OverlayPainter(const Rectification& rectification, const TissueOptions& tissue,
                               const OverlayOptions& options)
    : rectification_(rectification),
      tissue_(tissue),
      options_(options),
      colours_(colour_table(options.colour_map)),
      stress_scale_kPa_(options.stress_scale_kPa > 0 ? options.stress_scale_kPa
                                                     : round_up(kStrainOfLowestScale * tissue.young_modulus_kPa)),
      chart_(options.chart_duration_s, force_unit(tissue)) {
  if (!rectification.identity) rectified_px_ = rectified_pixels(rectification, rectification.size);
}

cv::Mat OverlayPainter::paint(const cv::Mat& left_bgr, const ForceEstimate& estimate) {
  if (left_bgr.size() != rectification_.size || left_bgr.type() != CV_8UC3)
    throw std::invalid_argument("OverlayPainter::paint: the image is not an 8-bit BGR image of the rig's size");
  follow_scales(estimate);
  cv::Mat image = left_bgr.clone();
  if (stress_is_trusted(estimate)) paint_stress(image, estimate);
  if (estimate.status != FrameStatus::tool_lost) draw_force(image, estimate);
  for (const ForceEstimate& other : estimate.further)
    if (other.status != FrameStatus::tool_lost) draw_force(image, other);
  draw_readings(image, estimate);
  draw_frame(image, estimate);
  return image;
}

void OverlayPainter::follow_scales(const ForceEstimate& estimate) {
  std::optional<double> force_N;
  if (has_force(estimate)) force_N = estimate.force_N.norm();
  if (estimate.status == FrameStatus::no_contact) force_N = 0;
  chart_.add(estimate.time_s, force_N);
  if (has_force(estimate)) nodal_force_scale_N_ = std::max(nodal_force_scale_N_, round_up(estimate.mean_nodal_force_N));
  for (const ForceEstimate& other : estimate.further)
    if (has_force(other)) nodal_force_scale_N_ = std::max(nodal_force_scale_N_, round_up(other.mean_nodal_force_N));
  if (options_.stress_scale_kPa > 0 || !stress_is_trusted(estimate)) return;
  const double stress_kPa = characteristic_stress_kPa(estimate);
  if (stress_kPa > stress_scale_kPa_) stress_scale_kPa_ = round_up(stress_kPa);
}

bool OverlayPainter::shows_instrument(const cv::Mat& rectified_mask, int x, int y) const {
  if (rectified_mask.empty()) return false;
  if (rectified_px_.empty()) return rectified_mask.at<uchar>(y, x) > 0;
  const cv::Vec2s px = rectified_px_.at<cv::Vec2s>(y, x);
  if (px[0] < 0 || px[1] < 0 || px[0] >= rectified_mask.cols || px[1] >= rectified_mask.rows) return false;
  return rectified_mask.at<uchar>(px[1], px[0]) > 0;
}

void OverlayPainter::paint_stress(cv::Mat& image, const ForceEstimate& estimate) {
  const std::vector<Vec3>& nodes = estimate.deformed_nodes_mm;
  vertices_.assign(nodes.size(), ScreenVertex{{}, std::numeric_limits<float>::quiet_NaN()});
  for (size_t i = 0; i < nodes.size(); ++i) {
    if (!nodes[i].allFinite() || nodes[i].z() < 1) continue;
    const cv::Point2d px = project_to_recorded_left(rectification_.rig, nodes[i]);
    vertices_[i] = {px, static_cast<float>(1 / nodes[i].z())};
  }
  rasterize(vertices_, estimate.boundary, image.size(), visible_);

  const std::array<Tint, 256> tints = tints_of(colours_, options_.opacity);
  const double per_kPa = 255 / stress_scale_kPa_;
  const cv::Rect area = visible_.area;
  cv::parallel_for_(cv::Range(0, area.height), [&](const cv::Range& rows) {
    for (int row = rows.start; row < rows.end; ++row) {
      const int* triangle = visible_.triangle.ptr<int>(row);
      const cv::Vec2f* weights = visible_.barycentric.ptr<cv::Vec2f>(row);
      cv::Vec3b* pixel = image.ptr<cv::Vec3b>(area.y + row) + area.x;
      for (int column = 0; column < area.width; ++column) {
        if (triangle[column] < 0) continue;
        const Triangle& corners = estimate.boundary[static_cast<size_t>(triangle[column])];
        const double w0 = weights[column][0], w1 = weights[column][1], w2 = 1 - w0 - w1;
        const auto blend = [&](const auto& values) {
          return w0 * values[static_cast<size_t>(corners[0])] + w1 * values[static_cast<size_t>(corners[1])] +
                 w2 * values[static_cast<size_t>(corners[2])];
        };
        const double level = blend(estimate.node_von_mises_kPa) * per_kPa;
        if (!(level >= 1) || shows_instrument(estimate.left_instrument_mask, area.x + column, area.y + row)) continue;
        const Tint& tint = tints[static_cast<size_t>(std::min(level, 255.0))];
        float alpha = tint.alpha;
        if (options_.region == OverlayRegion::around)
          alpha *=
              near_a_tip(w0 * nodes[static_cast<size_t>(corners[0])] + w1 * nodes[static_cast<size_t>(corners[1])] +
                             w2 * nodes[static_cast<size_t>(corners[2])],
                         estimate, options_.radius_mm);
        for (int c = 0; c < 3; ++c)
          pixel[column][c] =
              cv::saturate_cast<uchar>(static_cast<float>(pixel[column][c]) * (1 - alpha) + tint.bgr[c] * alpha);
      }
    }
  });
}

/// The ends of a map that are too dark for lines and text are left out.
cv::Scalar OverlayPainter::force_colour(const ForceEstimate& estimate) const {
  if (estimate.status == FrameStatus::map_stale || estimate.status == FrameStatus::not_converged) return kDoubt;
  const double fraction = nodal_force_scale_N_ > 0 ? estimate.mean_nodal_force_N / nodal_force_scale_N_ : 0;
  return options_.colour_map == ColourMap::jet ? colour_at(colours_, 0.35 + 0.5 * fraction)
                                               : colour_at(colours_, 0.45 + 0.55 * fraction);
}

void OverlayPainter::draw_force(cv::Mat& image, const ForceEstimate& estimate) const {
  if (!estimate.tip_mm.allFinite() || estimate.tip_mm.z() < 1) return;
  const double scale = drawing_scale(image.size());
  const auto px = [scale](double size) { return cvRound(size * scale); };
  const cv::Point2d tip = project_to_recorded_left(rectification_.rig, estimate.tip_mm);
  if (!cv::Rect(0, 0, image.cols, image.rows).contains(cv::Point(tip))) return;
  const cv::Scalar dark = cv::Scalar::all(15), colour = force_colour(estimate);
  const double force_N = has_force(estimate) ? estimate.force_N.norm() : 0;
  if (!(force_N > 0)) {
    cv::circle(image, tip, px(6), dark, px(3), cv::LINE_AA);
    cv::circle(image, tip, px(6), kInk, std::max(1, px(1.3)), cv::LINE_AA);
    return;
  }

  // As long in the image as it would be in space; along the line of sight a cross (away) or a dot (towards the camera).
  const double length_px = (25 + 65 * force_N / chart_.max_N()) * scale;
  const double length_mm = length_px * estimate.tip_mm.z() / rectification_.focal_px;
  const Vec3 head_mm = estimate.tip_mm + estimate.force_N / force_N * length_mm;
  cv::Point2d head = head_mm.z() < 1 ? tip : project_to_recorded_left(rectification_.rig, head_mm);
  const bool along_sight = cv::norm(head - tip) < 16 * scale;
  if (along_sight) head = tip;
  for (const auto& [ink, extra] : {std::pair(dark, 3 * scale), std::pair(colour, 0.0)}) {
    cv::circle(image, tip, px(along_sight ? 11 : 5), ink, cvRound(1.5 * scale + extra), cv::LINE_AA);
    const int width = cvRound(2.5 * scale + extra);
    if (!along_sight) {
      cv::arrowedLine(image, tip, head, ink, width, cv::LINE_AA, 0, std::min(0.4, 12 * scale / cv::norm(head - tip)));
    } else if (estimate.force_N.z() > 0) {
      cv::drawMarker(image, tip, ink, cv::MARKER_TILTED_CROSS, px(10), width, cv::LINE_AA);
    } else {
      cv::circle(image, tip, cvRound(2.5 * scale + extra / 2), ink, cv::FILLED, cv::LINE_AA);
    }
  }

  const double text_px = 14 * scale;
  const std::string text =
      three_digits(force_N) + " " + force_unit(tissue_) + (estimate.status == FrameStatus::map_stale ? " ?" : "");
  const cv::Point2d away = along_sight ? cv::Point2d(0, -1) : (head - tip) * (1 / cv::norm(head - tip));
  const int half = text_width(text, text_px, true) / 2 + px(4);
  const double gap = std::abs(away.x) * half + std::abs(away.y) * text_px + (along_sight ? 18 : 8) * scale;
  const cv::Point centre(head + away * gap);
  const cv::Rect inside(half, px(24), std::max(0, image.cols - 2 * half), std::max(0, image.rows - px(60)));
  draw_rimmed_text(image, text, clamped(centre + cv::Point(0, cvRound(text_px / 2)), inside), text_px, colour,
                   TextAnchor::centre);
}

void OverlayPainter::draw_readings(cv::Mat& image, const ForceEstimate& estimate) const {
  const double scale = drawing_scale(image.size());
  const auto px = [scale](double size) { return cvRound(size * scale); };
  const auto [words, status_colour] = words_of(estimate.status);
  std::vector<std::string> warnings;
  for (const std::string& name : all_warnings(estimate)) warnings.push_back(warning_words(name));
  const bool caution = !warnings.empty() && status_colour != kDoubt;
  std::vector<std::string> others;
  for (size_t i = 0; i < estimate.further.size(); ++i)
    if (const FrameStatus status = estimate.further[i].status; status != FrameStatus::tool_lost)
      others.push_back(fmt::format("instrument {}: {}", i + 2, words_of(status).first));
  const std::string time = fmt::format("{:.2f} s   frame {}", estimate.time_s, estimate.frame);
  int width = std::max(text_width(words, 11 * scale) + px(20), text_width(time, 8 * scale));
  for (const std::string& warning : warnings) width = std::max(width, text_width(warning, 8 * scale));
  for (const std::string& other : others) width = std::max(width, text_width(other, 8 * scale));
  const int other_lines = static_cast<int>(others.size()), warning_lines = static_cast<int>(warnings.size());
  draw_veil(image, {px(8), px(8), width + px(20), px(46 + 15 * (other_lines + warning_lines))});
  cv::circle(image, {px(23), px(23)}, px(5), caution ? kCaution : status_colour, cv::FILLED, cv::LINE_AA);
  draw_text(image, words, {px(36), px(28)}, 11 * scale, kInk);
  draw_text(image, time, {px(18), px(46)}, 8 * scale, kFaintInk);
  for (int i = 0; i < other_lines; ++i)
    draw_text(image, others[static_cast<size_t>(i)], {px(18), px(61 + 15 * i)}, 8 * scale, kInk);
  for (int i = 0; i < warning_lines; ++i)
    draw_text(image, warnings[static_cast<size_t>(i)], {px(18), px(61 + 15 * (other_lines + i))}, 8 * scale, kCaution);

  const std::string greatest =
      stress_is_trusted(estimate) ? "max " + three_digits(greatest_stress_kPa(estimate)) : "max -";
  const int bar_width = px(118);
  draw_colour_bar(image, {image.cols - bar_width - px(8), px(8), bar_width, px(220)}, colours_,
                  {0, stress_scale_kPa_, "von Mises (" + stress_unit(tissue_) + ")", greatest}, scale);
}

void OverlayPainter::draw_frame(cv::Mat& image, const ForceEstimate& estimate) const {
  const double scale = drawing_scale(image.size()), text_px = 8 * scale;
  const auto px = [scale](double size) { return cvRound(size * scale); };
  const double force_N = has_force(estimate) ? estimate.force_N.norm() : 0;
  const std::string tissue = fmt::format(
      "{}, E {} {}, nu = {}, F/E = {} mm^2", law_name(tissue_.law), tissue_.modulus_unknown ? "is" : "=",
      modulus_text(tissue_), tick_text(tissue_.poisson_ratio), three_digits(force_N / tissue_.young_modulus_MPa()));
  const std::string purpose = "research use only";
  const bool two_lines = text_width(tissue, text_px) + text_width(purpose, text_px) + px(40) > image.cols;
  const int height = px(two_lines ? 34 : 20);
  draw_veil(image, {0, image.rows - height, image.cols, height});
  draw_text(image, tissue, {px(8), image.rows - height + px(14)}, text_px, kInk);
  draw_text(image, purpose, {image.cols - px(8), image.rows - px(6)}, text_px, kFaintInk, TextAnchor::right);
  if (!options_.chart) return;
  const cv::Size chart(px(300), px(124));
  chart_.draw(image, {px(8), image.rows - height - px(8) - chart.height, chart.width, chart.height},
              force_colour(estimate), scale);
}

}  // namespace palpate
