#include "palpate/instrument/patch_cells.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace palpate {

namespace {

constexpr int kCell = 12;        // px of the level that a cell belongs to
constexpr float kOutlierAt = 3;  // noise levels at which a residual loses half its weight

constexpr float kOutside = -1e9f;
constexpr size_t kMinSamples = 12;

/// Negative outside the image; the layers are never negative.
float sample_bilinear(const cv::Mat& image, float x, float y) {
  const int ix = static_cast<int>(x), iy = static_cast<int>(y);
  if (!(x >= 0) || !(y >= 0) || ix + 1 >= image.cols || iy + 1 >= image.rows) return -1;
  const float fx = x - static_cast<float>(ix), fy = y - static_cast<float>(iy);
  const float* a = image.ptr<float>(iy) + ix;
  const float* b = image.ptr<float>(iy + 1) + ix;
  return (1 - fy) * (a[0] + fx * (a[1] - a[0])) + fy * (b[0] + fx * (b[1] - b[0]));
}

CellSample sample_at(const cv::Mat& image, int x, int y, int step, const cv::Point2d& from_center) {
  const float per_px = 0.5f / static_cast<float>(step);
  return {static_cast<float>(from_center.x), static_cast<float>(from_center.y), image.at<float>(y, x),
          per_px * (image.at<float>(y, x + 1) - image.at<float>(y, x - 1)),
          per_px * (image.at<float>(y + 1, x) - image.at<float>(y - 1, x))};
}

/// Edges of the instrument along its axis, from the tip backwards.
class Profile {
 public:
  Profile(const cv::Mat& mask, const ImageTip& tip, const cv::Rect& region, double length_px)
      : tip_(tip), low_(static_cast<size_t>(length_px) + 1, 1e9), high_(low_.size(), -1e9) {
    for (int y = 0; y < mask.rows; ++y)
      for (int x = 0; x < mask.cols; ++x) {
        if (!mask.at<uchar>(y, x)) continue;
        const auto [back, across] = coordinates({x + region.x * 1.0, y + region.y * 1.0});
        if (back < 0 || back >= static_cast<double>(low_.size())) continue;
        const size_t slice = static_cast<size_t>(back);
        low_[slice] = std::min(low_[slice], across);
        high_[slice] = std::max(high_[slice], across);
      }
  }

  /// Of a round body's surface over the plane through its outline.
  double height_px(const cv::Point2d& px) const {
    const auto [back, across] = coordinates(px);
    const size_t slice = static_cast<size_t>(std::clamp(back, 0.0, static_cast<double>(low_.size()) - 1));
    const double radius = 0.5 * (high_[slice] - low_[slice] + 1);
    const double aside = across - 0.5 * (high_[slice] + low_[slice]);
    return std::sqrt(std::max(0.0, radius * radius - aside * aside));
  }

 private:
  std::pair<double, double> coordinates(const cv::Point2d& px) const {
    const cv::Point2d from_tip = px - tip_.tip_px;
    return {-from_tip.dot(tip_.axis), from_tip.y * tip_.axis.x - from_tip.x * tip_.axis.y};
  }

  ImageTip tip_;
  std::vector<double> low_, high_;
};

ImageLayers layers_of(const cv::Mat& bgr, const cv::Rect& region, const cv::Mat& metal) {
  ImageLayers layers;
  layers.region = region;
  cv::Mat grey;
  cv::cvtColor(bgr(region), grey, cv::COLOR_BGR2GRAY);
  grey.convertTo(layers.brightness[0], CV_32F);
  metal.convertTo(layers.metal[0], CV_32F);
  cv::GaussianBlur(layers.brightness[0], layers.brightness[0], {5, 5}, 0.9);
  cv::GaussianBlur(layers.metal[0], layers.metal[0], {7, 7}, 1.3);
  for (size_t level = 1; level < ImageLayers::kLevels; ++level) {
    cv::pyrDown(layers.brightness[level - 1], layers.brightness[level]);
    cv::pyrDown(layers.metal[level - 1], layers.metal[level]);
  }
  return layers;
}

}  // namespace

ImageLayers make_layers(const cv::Mat& bgr, const cv::Rect& region, const SegmentationModel& model) {
  const cv::Rect inside = region & cv::Rect({}, bgr.size());
  return inside.area() == 0 ? ImageLayers() : layers_of(bgr, inside, metalness(bgr, inside, model));
}

ImageLayers make_layers(const cv::Mat& bgr, const cv::Rect& region, const cv::Mat& mask) {
  const cv::Rect inside = region & cv::Rect({}, bgr.size());
  return inside.area() == 0 ? ImageLayers() : layers_of(bgr, inside, mask(inside));
}

PatchTemplate make_template(const ImageLayers& layers, const cv::Mat& mask, const ImageTip& tip, double length_px) {
  PatchTemplate result;
  if (layers.region.area() == 0) return result;
  const Profile profile(mask(layers.region), tip, layers.region, length_px);
  cv::Mat inner, outer;
  cv::erode(mask(layers.region), inner, cv::getStructuringElement(cv::MORPH_ELLIPSE, {7, 7}));
  cv::dilate(mask(layers.region), outer, cv::getStructuringElement(cv::MORPH_ELLIPSE, {9, 9}));
  for (size_t level = 0; level < ImageLayers::kLevels; ++level) {
    const cv::Mat& brightness = layers.brightness[level];
    const int step = 1 << level;
    const int columns = brightness.cols / kCell + 1, rows = brightness.rows / kCell + 1;
    for (int cell_y = 0; cell_y < rows; ++cell_y)
      for (int cell_x = 0; cell_x < columns; ++cell_x) {
        const cv::Rect square = cv::Rect(cell_x * kCell, cell_y * kCell, kCell, kCell) &
                                cv::Rect(1, 1, brightness.cols - 2, brightness.rows - 2);
        PatchCell inside, outline;
        outline.outline = true;
        inside.center_px = outline.center_px = {(cell_x + 0.5) * kCell * step + layers.region.x,
                                                (cell_y + 0.5) * kCell * step + layers.region.y};
        for (int y = square.y; y < square.br().y; ++y)
          for (int x = square.x; x < square.br().x; ++x) {
            const cv::Point at(std::min(x * step, inner.cols - 1), std::min(y * step, inner.rows - 1));
            if (!outer.at<uchar>(at)) continue;
            const cv::Point2d full(x * step + layers.region.x, y * step + layers.region.y);
            if ((tip.tip_px - full).dot(tip.axis) > length_px) continue;
            const bool is_inside = inner.at<uchar>(at) != 0;
            PatchCell& cell = is_inside ? inside : outline;
            if (is_inside) cell.height_px += profile.height_px(full);
            cell.samples.push_back(
                sample_at(is_inside ? brightness : layers.metal[level], x, y, step, full - cell.center_px));
          }
        for (PatchCell* cell : {&inside, &outline}) {
          if (cell->samples.size() < kMinSamples) continue;
          cell->height_px /= static_cast<double>(cell->samples.size());
          result.cells[level].push_back(std::move(*cell));
        }
      }
  }
  return result;
}

CellEquations cell_equations(const PatchCell& cell, const ImageLayers& layers, int level, const CellWarp& warp,
                             const LayerNoise& noise, Light light_model) {
  const cv::Mat& image =
      cell.outline ? layers.metal[static_cast<size_t>(level)] : layers.brightness[static_cast<size_t>(level)];
  const float per_noise = 1 / (cell.outline ? noise.metal : noise.brightness);
  const float scale = 1.0f / static_cast<float>(1 << level);
  const float cx = scale * static_cast<float>(warp.center_px.x - layers.region.x);
  const float cy = scale * static_cast<float>(warp.center_px.y - layers.region.y);
  const float a00 = scale * static_cast<float>(warp.linear(0, 0)), a01 = scale * static_cast<float>(warp.linear(0, 1));
  const float a10 = scale * static_cast<float>(warp.linear(1, 0)), a11 = scale * static_cast<float>(warp.linear(1, 1));

  thread_local std::vector<float> residual;
  residual.resize(cell.samples.size());
  float sum = 0;
  int inside = 0;
  for (size_t i = 0; i < cell.samples.size(); ++i) {
    const CellSample& s = cell.samples[i];
    const float value = sample_bilinear(image, cx + a00 * s.dx + a01 * s.dy, cy + a10 * s.dx + a11 * s.dy);
    residual[i] = value < 0 ? kOutside : per_noise * (value - s.value);
    if (value >= 0) sum += residual[i], ++inside;
  }
  const float offset = cell.outline || inside == 0 ? 0 : sum / static_cast<float>(inside);

  CellEquations e;
  Eigen::Matrix2f normal = Eigen::Matrix2f::Zero();
  Eigen::Vector2f right = Eigen::Vector2f::Zero();
  Eigen::Matrix4f light_normal = 1e-3f * Eigen::Matrix4f::Identity();
  Eigen::Vector4f light_right = Eigen::Vector4f::Zero();
  Eigen::Matrix<float, 2, 4> cross = Eigen::Matrix<float, 2, 4>::Zero();
  float rr = 0, kept = 0, full = 0, w1 = 0;
  const float per_length = scale * 2.0f / kCell;
  for (size_t i = 0; i < cell.samples.size(); ++i) {
    const CellSample& s = cell.samples[i];
    const Eigen::Vector2f g = per_noise * Eigen::Vector2f(s.gradient_x, s.gradient_y);
    full += g.squaredNorm();
    if (residual[i] == kOutside) continue;
    const float r = residual[i] - offset;
    const float w = 1 / (1 + r * r / (kOutlierAt * kOutlierAt));
    kept += w * g.squaredNorm();
    normal += w * g * g.transpose();
    right += w * r * g;
    rr += w * r * r;
    w1 += w;
    if (cell.outline) continue;
    // What light does to a cell while it moves: brighter, and more so towards one side.
    Eigen::Vector4f light(1, per_length * s.dx, per_length * s.dy, s.value / 100);
    if (light_model == Light::offset) light.tail<3>().setZero();
    light_normal += w * light * light.transpose();
    light_right += w * r * light;
    cross += w * g * light.transpose();
  }
  if (!cell.outline && w1 > 0) {
    const Eigen::Matrix<float, 4, 2> solved = light_normal.ldlt().solve(cross.transpose());
    normal -= cross * solved;
    right -= solved.transpose() * light_right;
  }
  e.normal = normal.cast<double>();
  e.right = -right.cast<double>();
  e.information = kept;
  e.full_information = full;
  e.squared_error = rr;
  e.weight = w1;
  return e;
}

}  // namespace palpate
