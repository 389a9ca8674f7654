#include "palpate/feedback/map_confidence.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <opencv2/imgproc.hpp>

#include "palpate/feedback/colour_map.h"
#include "palpate/feedback/draw.h"
#include "palpate/feedback/rasterize.h"

namespace palpate {
namespace {

const cv::Scalar kRim{255, 255, 255}, kOtherRim{250, 170, 60}, kOther{150, 90, 30}, kContinued{200, 60, 210};
constexpr int kBarWidth_px = 110, kBarHeight_px = 260;
constexpr double kOpacity = 0.75;

VisibleTriangles seen_of(const Surface& surface, const Rectification& rectification) {
  std::vector<ScreenVertex> vertices;
  for (const Vec3& v : surface.vertices_mm)
    vertices.push_back({cv::Point2f(project_to_rectified(rectification, v)), static_cast<float>(1 / v.z())});
  VisibleTriangles visible;
  rasterize(vertices, surface.triangles, rectification.size, visible);
  return visible;
}

void blend(cv::Vec3b& pixel, const cv::Scalar& colour) {
  for (int c = 0; c < 3; ++c) pixel[c] = cv::saturate_cast<uchar>(pixel[c] * (1 - kOpacity) + colour[c] * kOpacity);
}

/// Directed edges of the rim, from each vertex to the next.
std::multimap<int, int> rim_of(const Surface& surface) {
  std::map<std::pair<int, int>, int> users;
  for (const Triangle& t : surface.triangles)
    for (size_t k = 0; k < 3; ++k) ++users[{t[k], t[(k + 1) % 3]}];
  std::multimap<int, int> rim;
  for (const auto& [edge, unused] : users)
    if (!users.count({edge.second, edge.first})) rim.emplace(edge.first, edge.second);
  return rim;
}

void draw_rim(cv::Mat& image, const Surface& surface, const Rectification& rectification, const cv::Scalar& colour) {
  const auto pixel = [&](int i) {
    return cv::Point(project_to_rectified(rectification, surface.vertices_mm[static_cast<size_t>(i)]));
  };
  for (const auto& [a, b] : rim_of(surface)) cv::line(image, pixel(a), pixel(b), colour, 2, cv::LINE_AA);
}

/// Deviation of the depth in mm at a rectified pixel; NaN where nothing was measured.
float deviation_mm(const TissueMap& map, const Rectification& rectification, const cv::Point& px) {
  const float disparity = map.disparity.disparity_px.at<float>(px);
  if (!(disparity > 0)) return std::numeric_limits<float>::quiet_NaN();
  return static_cast<float>(rectification.depth_mm(static_cast<double>(disparity))) / disparity *
         map.disparity.deviation_px.at<float>(px);
}

}  // namespace

std::vector<cv::Point2d> outline_px(const Surface& surface, const StereoRig& rig) {
  std::multimap<int, int> rim = rim_of(surface);
  std::vector<cv::Point2f> longest;
  double longest_px = -1;
  while (!rim.empty()) {
    std::vector<cv::Point2f> loop;
    for (auto edge = rim.begin(); edge != rim.end();) {
      loop.emplace_back(project_to_recorded_left(rig, surface.vertices_mm[static_cast<size_t>(edge->first)]));
      const int next = edge->second;
      rim.erase(edge);
      edge = rim.find(next);
    }
    const double length_px = cv::arcLength(loop, true);
    if (length_px > longest_px) longest_px = length_px, longest = loop;
  }
  std::vector<cv::Point2f> corners;
  if (longest.size() > 2) cv::approxPolyDP(longest, corners, 1, true);
  return {corners.begin(), corners.end()};
}

cv::Mat draw_map_confidence(const cv::Mat& left_bgr, const Rectification& rectification, const TissueMap& map) {
  StereoFrame frame;
  frame.left = left_bgr;
  frame.right = left_bgr;
  cv::Mat grey, image;
  cv::cvtColor(rectify(rectification, frame).left, grey, cv::COLOR_BGR2GRAY);
  cv::cvtColor(grey * 0.6, image, cv::COLOR_GRAY2BGR);

  const VisibleTriangles organ = seen_of(map.surface, rectification);
  cv::Mat1f deviations(image.size(), std::numeric_limits<float>::quiet_NaN());
  std::vector<float> sorted;
  for (int row = 0; row < organ.area.height; ++row)
    for (int column = 0; column < organ.area.width; ++column) {
      if (organ.triangle.at<int>(row, column) < 0) continue;
      const cv::Point px = organ.area.tl() + cv::Point(column, row);
      deviations(px) = deviation_mm(map, rectification, px);
      if (std::isfinite(deviations(px))) sorted.push_back(deviations(px));
    }
  std::sort(sorted.begin(), sorted.end());
  const double max_mm = sorted.empty() ? 1 : std::max(0.05, static_cast<double>(sorted[sorted.size() * 49 / 50]));

  for (size_t i = 1; i < map.pieces.size(); ++i) {
    const VisibleTriangles other = seen_of(map.pieces[i].surface, rectification);
    for (int row = 0; row < other.area.height; ++row)
      for (int column = 0; column < other.area.width; ++column)
        if (other.triangle.at<int>(row, column) >= 0)
          blend(image.at<cv::Vec3b>(other.area.y + row, other.area.x + column), kOther);
  }
  const ColourTable table = colour_table(ColourMap::viridis);
  for (int row = 0; row < organ.area.height; ++row)
    for (int column = 0; column < organ.area.width; ++column) {
      if (organ.triangle.at<int>(row, column) < 0) continue;
      const cv::Point px = organ.area.tl() + cv::Point(column, row);
      if (const float deviation = deviations(px); std::isfinite(deviation)) {
        blend(image.at<cv::Vec3b>(px), colour_at(table, static_cast<double>(deviation) / max_mm));
      } else if ((px.x + px.y) % 8 < 3) {
        blend(image.at<cv::Vec3b>(px), kContinued);
      }
    }
  for (size_t i = 1; i < map.pieces.size(); ++i) draw_rim(image, map.pieces[i].surface, rectification, kOtherRim);
  draw_rim(image, map.surface, rectification, kRim);

  const double scale = drawing_scale(image.size()), text_px = 10 * scale;
  const std::string title = "depth deviation of the organ; hatched: continued, not measured; blue: other surfaces";
  draw_veil(image, {0, 0, text_width(title, text_px) + 24, cvRound(30 * scale)});
  draw_text(image, title, {12, cvRound(20 * scale)}, text_px, kInk);
  cv::Mat bar(image.rows, cvRound(kBarWidth_px * scale), CV_8UC3, cv::Scalar(32, 28, 26)), both;
  draw_colour_bar(bar, {0, 0, bar.cols, std::min(bar.rows, cvRound(kBarHeight_px * scale))}, table, {0, max_mm, "mm"},
                  scale);
  cv::hconcat(image, bar, both);
  return both;
}

}  // namespace palpate
