#include "palpate/feedback/map_preview.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "palpate/core/quantile.h"
#include "palpate/feedback/axis.h"
#include "palpate/feedback/colour_map.h"
#include "palpate/feedback/draw.h"
#include "palpate/feedback/rasterize.h"

namespace palpate {
namespace {

const cv::Scalar kMeshColour{240, 220, 120}, kFixedColour{70, 130, 255};
constexpr int kPanelWidth_px = 800;
constexpr double kPanelScale = 1.2;
/// Beside its panel: on it, the bar would hide the map.
constexpr int kBarWidth_px = 100, kBarHeight_px = 260;
const cv::Scalar kBackground{32, 28, 26};

/// Distance from a pixel to the nearest edge of its triangle, px: a weight times the triangle's height over that edge.
double edge_distance_px(const Triangle& corners, const std::vector<ScreenVertex>& vertices, const cv::Vec2f& weights) {
  cv::Point2f p[3];
  for (size_t i = 0; i < 3; ++i) p[i] = vertices[static_cast<size_t>(corners[i])].px;
  const double twice_area = std::abs((p[1] - p[0]).cross(p[2] - p[0]));
  const double weight[3] = {weights[0], weights[1], 1 - weights[0] - weights[1]};
  double nearest = std::numeric_limits<double>::max();
  for (int i = 0; i < 3; ++i)
    nearest = std::min(nearest, weight[i] * twice_area / cv::norm(p[(i + 1) % 3] - p[(i + 2) % 3]));
  return nearest;
}

void blend(cv::Vec3b& pixel, const cv::Scalar& colour, double alpha) {
  for (int c = 0; c < 3; ++c) pixel[c] = cv::saturate_cast<uchar>(pixel[c] * (1 - alpha) + colour[c] * alpha);
}

/// Calls `paint(pixel, triangle, coverage of its edges)` for every pixel that shows the mesh.
void for_each_mesh_pixel(cv::Mat& image, const VisibleTriangles& visible, const std::vector<ScreenVertex>& vertices,
                         const std::vector<Triangle>& triangles,
                         const std::function<void(cv::Vec3b&, size_t, double)>& paint) {
  for (int row = 0; row < visible.area.height; ++row)
    for (int column = 0; column < visible.area.width; ++column) {
      const int number = visible.triangle.at<int>(row, column);
      if (number < 0) continue;
      const Triangle& corners = triangles[static_cast<size_t>(number)];
      const double distance_px = edge_distance_px(corners, vertices, visible.barycentric.at<cv::Vec2f>(row, column));
      paint(image.at<cv::Vec3b>(visible.area.y + row, visible.area.x + column), static_cast<size_t>(number),
            std::clamp(1.1 - distance_px, 0.0, 1.0));
    }
}

/// Filled where the node is seen, a ring where the mesh hides it (by more than a few percent of its depth).
void mark_fixed_nodes(cv::Mat& image, const VisibleTriangles& visible, const std::vector<ScreenVertex>& vertices,
                      const std::vector<int>& fixed_nodes) {
  const cv::Rect inside(0, 0, visible.area.width, visible.area.height);
  float min = std::numeric_limits<float>::max(), max = -min;
  for (const ScreenVertex& v : vertices) {
    if (!std::isfinite(v.nearness)) continue;
    min = std::min(min, v.nearness);
    max = std::max(max, v.nearness);
  }
  const float tolerance = 0.04f * (max - min);
  for (const int node : fixed_nodes) {
    const ScreenVertex& v = vertices[static_cast<size_t>(node)];
    if (!std::isfinite(v.nearness)) continue;
    const cv::Point px(v.px), local = px - visible.area.tl();
    const bool hidden = inside.contains(local) && visible.triangle.at<int>(local) >= 0 &&
                        v.nearness < visible.nearness.at<float>(local) - tolerance;
    cv::circle(image, px, hidden ? 3 : 4, kFixedColour, hidden ? 1 : cv::FILLED, cv::LINE_AA);
  }
}

cv::Mat panel_of(const cv::Mat& image) {
  cv::Mat panel;
  const cv::Size size(kPanelWidth_px, cvRound(static_cast<double>(kPanelWidth_px) * image.rows / image.cols));
  cv::resize(image, panel, size, 0, 0, image.cols > kPanelWidth_px ? cv::INTER_AREA : cv::INTER_LINEAR);
  return panel;
}

void draw_title(cv::Mat& panel, const std::string& title) {
  const double text_px = 10 * kPanelScale;
  draw_veil(panel, {0, 0, text_width(title, text_px) + 24, 30});
  draw_text(panel, title, {12, 21}, text_px, kInk);
}

cv::Mat draw_mesh_panel(const cv::Mat& left_bgr, const Rectification& rectification, const TissueMap& map,
                        const std::vector<Triangle>& boundary) {
  cv::Mat panel = panel_of(left_bgr);
  const double zoom = static_cast<double>(panel.cols) / left_bgr.cols;
  std::vector<ScreenVertex> vertices(map.mesh.nodes_mm.size(), {{}, std::numeric_limits<float>::quiet_NaN()});
  for (size_t i = 0; i < vertices.size(); ++i) {
    const Vec3& node = map.mesh.nodes_mm[i];
    if (node.z() < 1) continue;
    const cv::Point2d px = project_to_recorded_left(rectification.rig, node) * zoom;
    vertices[i] = {px, static_cast<float>(1 / node.z())};
  }
  VisibleTriangles visible;
  rasterize(vertices, boundary, panel.size(), visible);
  for_each_mesh_pixel(panel, visible, vertices, boundary,
                      [](cv::Vec3b& pixel, size_t, double edge) { blend(pixel, kMeshColour, 0.75 * edge); });
  mark_fixed_nodes(panel, visible, vertices, map.fixed_nodes);
  draw_title(panel, fmt::format("left image, {} elements, {} nodes, {} fixed", map.mesh.tetrahedra.size(),
                                map.mesh.nodes_mm.size(), map.fixed_nodes.size()));
  return panel;
}

/// Values that bound the middle 96 % of what is finite, widened to something that can be divided by.
std::pair<double, double> middle_range(const cv::Mat& values) {
  std::vector<float> finite;
  for (int y = 0; y < values.rows; ++y)
    for (int x = 0; x < values.cols; ++x)
      if (std::isfinite(values.at<float>(y, x))) finite.push_back(values.at<float>(y, x));
  if (finite.empty()) return {0, 1};
  const double min = static_cast<double>(quantile_of(finite, 0.02)),
               max = static_cast<double>(quantile_of(finite, 0.98));
  return {min, std::max(max, min + 1e-3 * std::max(1.0, std::abs(min)))};
}

/// The rectified image in grey, coloured where there is a value; its colour bar at the right.
cv::Mat draw_value_panel(const cv::Mat& rectified_bgr, const cv::Mat& values, bool from_zero,
                         const std::string& title) {
  cv::Mat grey, image;
  cv::cvtColor(rectified_bgr, grey, cv::COLOR_BGR2GRAY);
  cv::cvtColor(grey * 0.5, image, cv::COLOR_GRAY2BGR);
  auto [min, max] = middle_range(values);
  if (from_zero) min = 0;
  const ColourTable table = colour_table(ColourMap::viridis);
  for (int y = 0; y < values.rows; ++y)
    for (int x = 0; x < values.cols; ++x)
      if (const float value = values.at<float>(y, x); std::isfinite(value))
        blend(image.at<cv::Vec3b>(y, x), colour_at(table, (value - min) / (max - min)), 0.85);
  cv::Mat panel = panel_of(image);
  draw_title(panel, title);
  cv::Mat bar(panel.rows, kBarWidth_px, CV_8UC3, kBackground), both;
  draw_colour_bar(bar, {0, 0, kBarWidth_px, std::min(bar.rows, kBarHeight_px)}, table, {min, max, "mm"}, kPanelScale);
  cv::hconcat(panel, bar, both);
  return both;
}

cv::Mat depth_mm(const Rectification& rectification, const cv::Mat& disparity_px) {
  cv::Mat depth(disparity_px.size(), CV_32F, cv::Scalar(std::numeric_limits<float>::quiet_NaN()));
  for (int y = 0; y < depth.rows; ++y)
    for (int x = 0; x < depth.cols; ++x)
      if (const float d = disparity_px.at<float>(y, x); d > 0)
        depth.at<float>(y, x) = static_cast<float>(rectification.depth_mm(d));
  return depth;
}

/// z^2 / (f b) * sigma_d.
cv::Mat depth_deviation_mm(const Rectification& rectification, const cv::Mat& depth, const cv::Mat& deviation_px) {
  cv::Mat deviation(depth.size(), CV_32F, cv::Scalar(std::numeric_limits<float>::quiet_NaN()));
  for (int y = 0; y < depth.rows; ++y)
    for (int x = 0; x < depth.cols; ++x) {
      const float z = depth.at<float>(y, x);
      deviation.at<float>(y, x) = static_cast<float>(z * z / (rectification.focal_px * rectification.baseline_mm)) *
                                  deviation_px.at<float>(y, x);
    }
  return deviation;
}

/// Orthographic, seen along +x: depth runs to the right (the camera is at the left), y runs down.
cv::Mat draw_side_panel(const TissueMap& map, const std::vector<Triangle>& boundary, const cv::Size& size) {
  cv::Mat panel(size, CV_8UC3, kBackground);
  const std::vector<Vec3>& nodes = map.mesh.nodes_mm;
  if (!nodes.empty()) {
    Vec3 min = nodes.front(), max = nodes.front();
    for (const Vec3& node : nodes) {
      min = min.cwiseMin(node);
      max = max.cwiseMax(node);
    }
    const cv::Rect plot(70, 50, size.width - 100, size.height - 100);
    const double px_per_mm = std::min(plot.width / (max.z() - min.z()), plot.height / (max.y() - min.y())) * 0.92;
    const Vec3 middle = 0.5 * (min + max);
    const cv::Point2d centre = 0.5 * cv::Point2d(plot.tl() + plot.br());
    const auto x_of = [&](double z) { return centre.x + (z - middle.z()) * px_per_mm; };
    const auto y_of = [&](double y) { return centre.y + (y - middle.y()) * px_per_mm; };

    const double text_px = 9 * kPanelScale;
    const auto z_at = [&](double x) { return middle.z() + (x - centre.x) / px_per_mm; };
    const auto y_at = [&](double y) { return middle.y() + (y - centre.y) / px_per_mm; };
    for (const double tick : round_ticks(z_at(plot.x), z_at(plot.br().x), 8)) {
      const int x = cvRound(x_of(tick));
      cv::line(panel, {x, plot.y}, {x, plot.br().y}, cv::Scalar::all(60));
      draw_text(panel, tick_text(tick), {x, plot.br().y + 18}, text_px, kInk, TextAnchor::centre);
    }
    for (const double tick : round_ticks(y_at(plot.y), y_at(plot.br().y), 6)) {
      const int y = cvRound(y_of(tick));
      cv::line(panel, {plot.x, y}, {plot.br().x, y}, cv::Scalar::all(60));
      draw_text(panel, tick_text(tick), {plot.x - 8, y + cvRound(text_px / 2)}, text_px, kInk, TextAnchor::right);
    }
    draw_text(panel, "depth z (mm)", {plot.br().x, plot.br().y + 40}, text_px, kFaintInk, TextAnchor::right);
    draw_text(panel, "y (mm), down", {12, plot.br().y + 40}, text_px, kFaintInk);

    std::vector<ScreenVertex> vertices;
    for (const Vec3& node : nodes)
      vertices.push_back({cv::Point2f(cv::Point2d(x_of(node.z()), y_of(node.y()))), static_cast<float>(-node.x())});
    VisibleTriangles visible;
    rasterize(vertices, boundary, size, visible);
    std::vector<double> brightness;
    for (const Triangle& t : boundary) {
      const Vec3 a = nodes[static_cast<size_t>(t[0])], b = nodes[static_cast<size_t>(t[1])],
                 c = nodes[static_cast<size_t>(t[2])];
      brightness.push_back(0.25 + 0.5 * std::abs((b - a).cross(c - a).normalized().x()));
    }
    for_each_mesh_pixel(panel, visible, vertices, boundary, [&](cv::Vec3b& pixel, size_t triangle, double edge) {
      blend(pixel, cv::Scalar(150, 140, 190) * brightness[triangle], 1);
      blend(pixel, kMeshColour, 0.6 * edge);
    });
    mark_fixed_nodes(panel, visible, vertices, map.fixed_nodes);
  }
  draw_title(panel, "from the side (camera at the left), fixed nodes in orange");
  return panel;
}

}  // namespace

cv::Mat draw_map_preview(const cv::Mat& left_bgr, const Rectification& rectification, const TissueMap& map) {
  const std::vector<Triangle> boundary = boundary_triangles(map.mesh);
  StereoFrame frame;
  frame.left = left_bgr;
  frame.right = left_bgr;
  const cv::Mat rectified = rectify(rectification, frame).left;
  const cv::Mat depth = depth_mm(rectification, map.disparity.disparity_px);
  const cv::Mat deviation = depth_deviation_mm(rectification, depth, map.disparity.deviation_px);

  const cv::Mat mesh = draw_mesh_panel(left_bgr, rectification, map, boundary);
  const cv::Mat from_side = draw_side_panel(map, boundary, mesh.size());
  const cv::Mat depth_panel = draw_value_panel(rectified, depth, false,
                                               fmt::format("depth, {:.0f} % of the region", 100 * map.report.coverage));
  const cv::Mat deviation_panel = draw_value_panel(
      rectified, deviation, true,
      fmt::format("depth deviation, median {} mm", three_digits(map.report.median_depth_deviation_mm)));
  cv::Mat top, bottom, preview;
  cv::hconcat(mesh, depth_panel, top);
  cv::hconcat(from_side, deviation_panel, bottom);
  cv::vconcat(top, bottom, preview);
  return preview;
}

}  // namespace palpate
