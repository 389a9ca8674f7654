#include "palpate/instrument/patch_cells.h"

#include <algorithm>
#include <map>
#include <opencv2/imgproc.hpp>

namespace palpate {

namespace {

constexpr int kCell = 12;              // px of the level that a cell belongs to
constexpr float kBrightnessNoise = 3;  // grey levels
constexpr float kMetalNoise = 24;      // of 255; colour is recorded at half resolution
constexpr float kOutlierAt = 3;        // noise levels at which a residual loses half its weight

float sample_bilinear(const cv::Mat& image, float x, float y, bool& inside) {
  const int ix = static_cast<int>(x), iy = static_cast<int>(y);
  if (!(x >= 0) || !(y >= 0) || ix + 1 >= image.cols || iy + 1 >= image.rows) {
    inside = false;
    return 0;
  }
  const float fx = x - static_cast<float>(ix), fy = y - static_cast<float>(iy);
  const float* a = image.ptr<float>(iy) + ix;
  const float* b = image.ptr<float>(iy + 1) + ix;
  return (1 - fy) * (a[0] + fx * (a[1] - a[0])) + fy * (b[0] + fx * (b[1] - b[0]));
}

}  // namespace

ImageLayers make_layers(const cv::Mat& bgr, const cv::Rect& region, const SegmentationModel& model) {
  ImageLayers layers;
  layers.region = region & cv::Rect({}, bgr.size());
  if (layers.region.area() == 0) return layers;
  const cv::Mat part = bgr(layers.region);
  cv::Mat grey;
  cv::cvtColor(part, grey, cv::COLOR_BGR2GRAY);
  grey.convertTo(layers.brightness[0], CV_32F);
  metalness(part, model).convertTo(layers.metal[0], CV_32F);
  cv::GaussianBlur(layers.brightness[0], layers.brightness[0], {5, 5}, 0.9);
  cv::GaussianBlur(layers.metal[0], layers.metal[0], {7, 7}, 1.3);
  for (size_t level = 1; level < ImageLayers::kLevels; ++level) {
    cv::pyrDown(layers.brightness[level - 1], layers.brightness[level]);
    cv::pyrDown(layers.metal[level - 1], layers.metal[level]);
  }
  return layers;
}

PatchTemplate make_template(const ImageLayers& layers, const cv::Mat& mask, const ImageTip& tip, double length_px) {
  PatchTemplate result;
  if (layers.region.area() == 0) return result;
  cv::Mat inner, outer;
  cv::erode(mask(layers.region), inner, cv::getStructuringElement(cv::MORPH_ELLIPSE, {7, 7}));
  cv::dilate(mask(layers.region), outer, cv::getStructuringElement(cv::MORPH_ELLIPSE, {9, 9}));
  for (int level = 0; level < ImageLayers::kLevels; ++level) {
    const cv::Mat& brightness = layers.brightness[static_cast<size_t>(level)];
    const cv::Mat& metal = layers.metal[static_cast<size_t>(level)];
    const int step = 1 << level;
    std::map<std::pair<int, int>, PatchCell> cells;
    for (int y = 1; y + 1 < brightness.rows; ++y)
      for (int x = 1; x + 1 < brightness.cols; ++x) {
        const cv::Point at(std::min(x * step, inner.cols - 1), std::min(y * step, inner.rows - 1));
        if (!outer.at<uchar>(at)) continue;
        const cv::Point2d full(x * step + layers.region.x, y * step + layers.region.y);
        const double back = (tip.tip_px - full).dot(tip.axis);
        if (back > length_px) continue;
        CellSample sample;
        sample.outline = !inner.at<uchar>(at);
        const cv::Mat& image = sample.outline ? metal : brightness;
        sample.value = image.at<float>(y, x);
        const float per_px = 0.5f / static_cast<float>(step);
        sample.gradient_x = per_px * (image.at<float>(y, x + 1) - image.at<float>(y, x - 1));
        sample.gradient_y = per_px * (image.at<float>(y + 1, x) - image.at<float>(y - 1, x));
        PatchCell& cell = cells[{y / kCell, x / kCell}];
        if (cell.samples.empty())
          cell.center_px = {(x / kCell + 0.5) * kCell * step + layers.region.x,
                            (y / kCell + 0.5) * kCell * step + layers.region.y};
        sample.dx = static_cast<float>(full.x - cell.center_px.x);
        sample.dy = static_cast<float>(full.y - cell.center_px.y);
        cell.samples.push_back(sample);
      }
    for (auto& [where, cell] : cells)
      if (cell.samples.size() >= 12) result.cells[static_cast<size_t>(level)].push_back(std::move(cell));
  }
  return result;
}

CellEquations cell_equations(const PatchCell& cell, const ImageLayers& layers, int level, const CellWarp& warp) {
  const cv::Mat& brightness = layers.brightness[static_cast<size_t>(level)];
  const cv::Mat& metal = layers.metal[static_cast<size_t>(level)];
  const float scale = 1.0f / static_cast<float>(1 << level);
  const float cx = static_cast<float>(warp.center_px.x - layers.region.x);
  const float cy = static_cast<float>(warp.center_px.y - layers.region.y);
  const float a00 = static_cast<float>(warp.linear(0, 0)), a01 = static_cast<float>(warp.linear(0, 1));
  const float a10 = static_cast<float>(warp.linear(1, 0)), a11 = static_cast<float>(warp.linear(1, 1));

  // First the cell's brightness offset, as the median would be too slow: the mean, then once more without outliers.
  thread_local std::vector<float> residual;
  residual.resize(cell.samples.size());
  float sum = 0;
  int inner = 0;
  for (size_t i = 0; i < cell.samples.size(); ++i) {
    const CellSample& s = cell.samples[i];
    bool inside = true;
    const float value = sample_bilinear(s.outline ? metal : brightness, scale * (cx + a00 * s.dx + a01 * s.dy),
                                        scale * (cy + a10 * s.dx + a11 * s.dy), inside);
    residual[i] = inside ? value - s.value : std::numeric_limits<float>::quiet_NaN();
    if (inside && !s.outline) sum += residual[i], ++inner;
  }
  const float offset = inner > 0 ? sum / static_cast<float>(inner) : 0;

  CellEquations e;
  double bxx = 0, bxy = 0, byy = 0, bx = 0, by = 0, bxr = 0, byr = 0, br = 0, bw = 0;
  for (size_t i = 0; i < cell.samples.size(); ++i) {
    const CellSample& s = cell.samples[i];
    const float noise = s.outline ? kMetalNoise : kBrightnessNoise;
    const float gx = s.gradient_x / noise, gy = s.gradient_y / noise;
    const float energy = gx * gx + gy * gy;
    e.full_information += energy;
    if (std::isnan(residual[i])) continue;
    const float r = (s.outline ? residual[i] : residual[i] - offset) / noise;
    const float ratio = r / kOutlierAt;
    const float w = 1 / (1 + ratio * ratio);
    e.information += w * energy;
    e.squared_error += w * r * r;
    e.weight += w;
    if (s.outline) {
      e.normal(0, 0) += w * gx * gx;
      e.normal(0, 1) += w * gx * gy;
      e.normal(1, 1) += w * gy * gy;
      e.right.x() -= w * gx * r;
      e.right.y() -= w * gy * r;
    } else {
      bxx += w * gx * gx, bxy += w * gx * gy, byy += w * gy * gy;
      bx += w * gx, by += w * gy, br += w * r, bw += w;
      bxr += w * gx * r, byr += w * gy * r;
    }
  }
  if (bw > 0) {
    e.normal(0, 0) += bxx - bx * bx / bw;
    e.normal(0, 1) += bxy - bx * by / bw;
    e.normal(1, 1) += byy - by * by / bw;
    e.right.x() -= bxr - bx * br / bw;
    e.right.y() -= byr - by * br / bw;
  }
  e.normal(1, 0) = e.normal(0, 1);
  return e;
}

}  // namespace palpate
