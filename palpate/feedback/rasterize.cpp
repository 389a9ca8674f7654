#include "palpate/feedback/rasterize.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core/utility.hpp>

namespace palpate {
namespace {

constexpr int kBandRows = 16;

/// Linear in the pixel: value(x, y) = at_origin + x * per_x + y * per_y.
struct Plane {
  float at_origin = 0, per_x = 0, per_y = 0;
  float at(float x, float y) const { return at_origin + x * per_x + y * per_y; }
};

/// A triangle ready to be scanned.
struct ScreenTriangle {
  int number = -1;
  float left = 0, right = 0, top = 0, bottom = 0;
  Plane weight_0, weight_1;
  float nearness_0 = 0, nearness_1 = 0, nearness_2 = 0;
};

bool finite(const ScreenVertex& v) {
  return std::isfinite(v.px.x) && std::isfinite(v.px.y) && std::isfinite(v.nearness);
}

/// The weight that is 1 at `corner` and 0 on the line through `from` and `to`.
Plane weight_of(const cv::Point2f& corner, const cv::Point2f& from, const cv::Point2f& to) {
  const cv::Point2f edge = to - from, across(-edge.y, edge.x);
  const float height = across.dot(corner - from);
  return {-across.dot(from) / height, across.x / height, across.y / height};
}

std::vector<ScreenTriangle> prepare(const std::vector<ScreenVertex>& vertices, const std::vector<Triangle>& triangles,
                                    const cv::Size& image_size) {
  std::vector<ScreenTriangle> prepared;
  prepared.reserve(triangles.size());
  for (size_t i = 0; i < triangles.size(); ++i) {
    const ScreenVertex& a = vertices[static_cast<size_t>(triangles[i][0])];
    const ScreenVertex& b = vertices[static_cast<size_t>(triangles[i][1])];
    const ScreenVertex& c = vertices[static_cast<size_t>(triangles[i][2])];
    if (!finite(a) || !finite(b) || !finite(c)) continue;
    const float twice_area = (b.px - a.px).cross(c.px - a.px);
    if (std::abs(twice_area) < 1e-6f) continue;
    ScreenTriangle t;
    t.number = static_cast<int>(i);
    t.left = std::min({a.px.x, b.px.x, c.px.x});
    t.right = std::max({a.px.x, b.px.x, c.px.x});
    t.top = std::min({a.px.y, b.px.y, c.px.y});
    t.bottom = std::max({a.px.y, b.px.y, c.px.y});
    if (t.right < 0 || t.bottom < 0 || t.left > static_cast<float>(image_size.width - 1) ||
        t.top > static_cast<float>(image_size.height - 1))
      continue;
    t.weight_0 = weight_of(a.px, b.px, c.px);
    t.weight_1 = weight_of(b.px, c.px, a.px);
    t.nearness_0 = a.nearness;
    t.nearness_1 = b.nearness;
    t.nearness_2 = c.nearness;
    prepared.push_back(t);
  }
  return prepared;
}

cv::Rect bounding_box(const std::vector<ScreenTriangle>& triangles, const cv::Size& image_size) {
  float left = std::numeric_limits<float>::max(), top = left, right = -left, bottom = -left;
  for (const ScreenTriangle& t : triangles) {
    left = std::min(left, t.left);
    right = std::max(right, t.right);
    top = std::min(top, t.top);
    bottom = std::max(bottom, t.bottom);
  }
  if (triangles.empty()) return {};
  const int x0 = std::max(0, static_cast<int>(std::floor(std::max(left, 0.0f))));
  const int y0 = std::max(0, static_cast<int>(std::floor(std::max(top, 0.0f))));
  const int x1 = static_cast<int>(std::ceil(std::min(right, static_cast<float>(image_size.width - 1))));
  const int y1 = static_cast<int>(std::ceil(std::min(bottom, static_cast<float>(image_size.height - 1))));
  return {x0, y0, x1 - x0 + 1, y1 - y0 + 1};
}

/// Narrows [first, last] to the pixels of one row where a weight is not negative.
void clip(const Plane& weight, float y, float& first, float& last) {
  const float at_row = weight.at_origin + y * weight.per_y;
  if (weight.per_x > 0) {
    first = std::max(first, -at_row / weight.per_x);
  } else if (weight.per_x < 0) {
    last = std::min(last, -at_row / weight.per_x);
  } else if (at_row < 0) {
    last = first - 1;
  }
}

void scan_row(const ScreenTriangle& t, int y, VisibleTriangles& visible) {
  const float row = static_cast<float>(y);
  const Plane weight_2{1 - t.weight_0.at_origin - t.weight_1.at_origin, -t.weight_0.per_x - t.weight_1.per_x,
                       -t.weight_0.per_y - t.weight_1.per_y};
  float first = std::max(t.left, static_cast<float>(visible.area.x));
  float last = std::min(t.right, static_cast<float>(visible.area.br().x - 1));
  // Half a thousandth of a pixel of overlap, so that no pixel falls between two triangles.
  constexpr float kOverlap_px = 5e-4f;
  clip(t.weight_0, row, first, last);
  clip(t.weight_1, row, first, last);
  clip(weight_2, row, first, last);
  const int x0 = std::max(visible.area.x, static_cast<int>(std::ceil(first - kOverlap_px)));
  const int x1 = std::min(visible.area.br().x - 1, static_cast<int>(std::floor(last + kOverlap_px)));

  int* triangle = visible.triangle.ptr<int>(y - visible.area.y);
  float* nearness = visible.nearness.ptr<float>(y - visible.area.y);
  cv::Vec2f* barycentric = visible.barycentric.ptr<cv::Vec2f>(y - visible.area.y);
  for (int x = x0; x <= x1; ++x) {
    const float w0 = t.weight_0.at(static_cast<float>(x), row), w1 = t.weight_1.at(static_cast<float>(x), row);
    const float here = w0 * t.nearness_0 + w1 * t.nearness_1 + (1 - w0 - w1) * t.nearness_2;
    const int column = x - visible.area.x;
    if (here <= nearness[column]) continue;
    nearness[column] = here;
    triangle[column] = t.number;
    barycentric[column] = {w0, w1};
  }
}

/// A view of exactly `size` on a matrix that only grows.
void resize(cv::Mat& matrix, const cv::Size& size, int type) {
  if (matrix.type() != type || matrix.size() != size) matrix.create(size, type);
}

}  // namespace

void rasterize(const std::vector<ScreenVertex>& vertices, const std::vector<Triangle>& triangles,
               const cv::Size& image_size, VisibleTriangles& visible) {
  const std::vector<ScreenTriangle> prepared = prepare(vertices, triangles, image_size);
  visible.area = bounding_box(prepared, image_size);
  resize(visible.triangle, visible.area.size(), CV_32S);
  resize(visible.barycentric, visible.area.size(), CV_32FC2);
  resize(visible.nearness, visible.area.size(), CV_32F);
  if (prepared.empty()) return;

  const int bands = (visible.area.height + kBandRows - 1) / kBandRows;
  cv::parallel_for_(cv::Range(0, bands), [&](const cv::Range& range) {
    const int begin = visible.area.y + range.start * kBandRows;
    const int end = std::min(visible.area.br().y, visible.area.y + range.end * kBandRows);
    const cv::Range rows(begin - visible.area.y, end - visible.area.y);
    visible.triangle.rowRange(rows).setTo(-1);
    visible.nearness.rowRange(rows).setTo(-std::numeric_limits<float>::max());
    for (const ScreenTriangle& t : prepared) {
      const int first = std::max(begin, static_cast<int>(std::ceil(std::max(t.top, -1.0f))));
      const int last = std::min(static_cast<float>(end - 1), std::floor(t.bottom));
      for (int y = first; y <= last; ++y) scan_row(t, y, visible);
    }
  });
}

}  // namespace palpate
