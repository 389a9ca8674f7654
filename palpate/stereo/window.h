#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

namespace palpate {

/// Disparity around a pixel as a plane: d + dx u + dy v at (u, v) px from it. Slopes are the same at every image size.
struct DisparityPlane {
  float d = 0;
  float dx = 0;
  float dy = 0;

  float at(float u, float v) const { return d + dx * u + dy * v; }
};

/// One image at one size, with a margin of `kMargin_px` all around that has no weight, so that windows need no bounds.
struct Level {
  static constexpr int kMargin_px = 16;
  cv::Size size;     ///< without the margin
  cv::Mat grey;      ///< CV_32F
  cv::Mat gradient;  ///< CV_32F, along the row, per px
  cv::Mat weight;    ///< CV_32F, 0 or 1

  const float* grey_at(int x, int y) const { return grey.ptr<float>(y + kMargin_px) + x + kMargin_px; }
  const float* gradient_at(int x, int y) const { return gradient.ptr<float>(y + kMargin_px) + x + kMargin_px; }
  const float* weight_at(int x, int y) const { return weight.ptr<float>(y + kMargin_px) + x + kMargin_px; }
  bool holds(cv::Point at) const { return cv::Rect({0, 0}, size).contains(at); }
};

/// Level of a grey image (CV_32F) where `mask` (8-bit) is not zero.
Level make_level(const cv::Mat& grey, const cv::Mat& mask);

/// What a fit of one window says.
struct WindowFit {
  DisparityPlane plane;
  float correlation = -1;  ///< ZNCC of the two windows under the plane
  float information = 0;   ///< gradient energy over residual variance, 1/px^2: inverse variance of d (Cramer-Rao)
};

/// The window of one pixel: grey levels, gradient and weights, kept in rows of `Lanes` values (one or two vector
/// registers; the last lane has no weight) so that the compiler turns the inner loops into vector instructions.
template <int Lanes>
class Window {
 public:
  static constexpr int kRadius = Lanes / 2 - 1;
  static constexpr int kRows = 2 * kRadius + 1;
  static_assert(kRadius < Level::kMargin_px);

  /// False where too little of the window can be used or where the row shows no texture.
  bool cut(const Level& from, cv::Point at) {
    at_ = at;
    Lane sums[2] = {};
    for (int r = 0; r < kRows; ++r) {
      const float* l = from.grey_at(at.x - kRadius, at.y + r - kRadius);
      const float* g = from.gradient_at(at.x - kRadius, at.y + r - kRadius);
      const float* m = from.weight_at(at.x - kRadius, at.y + r - kRadius);
      for (int i = 0; i < Lanes; ++i) {
        const float w = m[i] * falloff(i) * falloff(r);
        weight_[r][i] = w;
        grey_[r][i] = l[i];
        gradient_[r][i] = g[i];
        sums[0][i] += w;
        sums[1][i] += w * g[i] * g[i];
      }
    }
    const float weights = total(sums[0]);
    return weights > kLeastShare * full_weight() && total(sums[1]) > kLeastGradient * weights;
  }

  /// Gauss-Newton from a predicted plane on sum w (L - gain R(x - d) - offset)^2, gain and offset free in every step,
  /// the mean of both images' gradients as in efficient second-order minimisation. False when the window leaves the
  /// other image or the answer leaves the prediction by more than `most_step` px.
  bool fit(const Level& to, DisparityPlane predicted, float most_step, float steepest, int iterations,
           WindowFit& result) {
    result.plane = predicted;
    for (int i = 0; i < iterations; ++i) {
      Eigen::Vector3f step;
      if (!look(to, result, step)) return false;
      DisparityPlane& plane = result.plane;
      plane.d += step[0];
      plane.dx += step[1];
      plane.dy += step[2];
      if (!(std::abs(plane.d - predicted.d) <= most_step && std::abs(plane.dx) <= steepest &&
            std::abs(plane.dy) <= steepest))
        return false;
      if (std::abs(step[0]) < 0.02f) break;
    }
    return true;
  }

 private:
  using Lane = float[Lanes];
  static constexpr float kLeastShare = 0.3f;      // of the window's weight
  static constexpr float kLeastGradient = 0.02f;  // mean square of the gradient, grey levels per px
  // A weak belief in the predicted slopes: a deviation of 0.03, against noise of one grey level.
  static constexpr float kSlopeBelief = 1 / (0.03f * 0.03f);

  static float total(const Lane& lane) {
    float sum = 0;
    for (const float value : lane) sum += value;
    return sum;
  }
  static constexpr float falloff(int i) {
    const float t = static_cast<float>(i - kRadius) / static_cast<float>(kRadius + 1);
    return i - kRadius > kRadius ? 0 : 1 - t * t;
  }
  static constexpr float full_weight() {
    float sum = 0;
    for (int i = 0; i < Lanes; ++i) sum += falloff(i);
    return sum * sum;
  }

  // One look at the other image under the plane of `fit`: correlation and information there, and the step to take.
  bool look(const Level& to, WindowFit& fit, Eigen::Vector3f& step) const {
    const DisparityPlane& plane = fit.plane;
    const float reach = kRadius + 1, spread = (std::abs(plane.dx) + std::abs(plane.dy)) * reach;
    const float x0 = static_cast<float>(at_.x) - plane.d;
    if (!(x0 - reach - spread > 1 - Level::kMargin_px &&
          x0 + reach + spread < static_cast<float>(to.size.width + Level::kMargin_px - 3)))
      return false;
    Lane right[kRows], slope[kRows], weight[kRows];
    Lane s_w = {}, s_l = {}, s_r = {}, s_g = {}, s_gu = {}, s_gv = {};
    for (int r = 0; r < kRows; ++r) {
      const float v = static_cast<float>(r - kRadius);
      const float* row = to.grey_at(-Level::kMargin_px, at_.y + r - kRadius);
      const float* mask = to.weight_at(-Level::kMargin_px, at_.y + r - kRadius);
      const float start = x0 + Level::kMargin_px - plane.dy * v;
      for (int i = 0; i < Lanes; ++i) {
        const float u = static_cast<float>(i - kRadius);
        const float x = start + u * (1 - plane.dx);
        const int whole = static_cast<int>(x);
        const float t = x - static_cast<float>(whole);
        // Catmull-Rom and its derivative.
        const float a = row[whole - 1], b = row[whole], c = row[whole + 1], d = row[whole + 2];
        const float c1 = 0.5f * (c - a), c2 = a - 2.5f * b + 2 * c - 0.5f * d, c3 = 0.5f * (d - a) + 1.5f * (b - c);
        const float w = weight_[r][i] * mask[static_cast<int>(x + 0.5f)];
        const float value = b + t * (c1 + t * (c2 + t * c3));
        const float g = 0.5f * (gradient_[r][i] + c1 + t * (2 * c2 + 3 * t * c3));
        right[r][i] = value;
        slope[r][i] = g;
        weight[r][i] = w;
        s_w[i] += w;
        s_l[i] += w * grey_[r][i];
        s_r[i] += w * value;
        s_g[i] += w * g;
        s_gu[i] += w * g * u;
        s_gv[i] += w * g * v;
      }
    }
    const float n = total(s_w);
    if (n < kLeastShare * full_weight()) return false;
    const float mean_l = total(s_l) / n, mean_r = total(s_r) / n;
    const float mean_g = total(s_g) / n, mean_gu = total(s_gu) / n, mean_gv = total(s_gv) / n;
    Lane ll = {}, rr = {}, lr = {}, h[6] = {}, jl[3] = {}, jr[3] = {};
    for (int r = 0; r < kRows; ++r) {
      const float v = static_cast<float>(r - kRadius);
      for (int i = 0; i < Lanes; ++i) {
        const float u = static_cast<float>(i - kRadius);
        const float w = weight[r][i], l = grey_[r][i] - mean_l, m = right[r][i] - mean_r;
        const float a = slope[r][i] - mean_g, b = slope[r][i] * u - mean_gu, c = slope[r][i] * v - mean_gv;
        const float wa = w * a, wb = w * b, wc = w * c, wl = w * l, wm = w * m;
        ll[i] += wl * l, rr[i] += wm * m, lr[i] += wl * m;
        h[0][i] += wa * a, h[1][i] += wa * b, h[2][i] += wa * c;
        h[3][i] += wb * b, h[4][i] += wb * c, h[5][i] += wc * c;
        jl[0][i] += wa * l, jl[1][i] += wb * l, jl[2][i] += wc * l;
        jr[0][i] += wa * m, jr[1][i] += wb * m, jr[2][i] += wc * m;
      }
    }
    const float LL = total(ll), RR = total(rr), LR = total(lr);
    if (!(LL > 1e-3f && RR > 1e-3f && LR > 0)) return false;
    fit.correlation = LR / std::sqrt(LL * RR);
    const float gain = std::sqrt(LL / RR);
    Eigen::Matrix3f H;
    const float h1 = total(h[1]), h2 = total(h[2]), h4 = total(h[4]);
    H << total(h[0]), h1, h2, h1, total(h[3]) + kSlopeBelief, h4, h2, h4, total(h[5]) + kSlopeBelief;
    const Eigen::Vector3f descent(total(jl[0]) - gain * total(jr[0]), total(jl[1]) - gain * total(jr[1]),
                                  total(jl[2]) - gain * total(jr[2]));
    const Eigen::Matrix3f inverse = H.inverse();
    step = -(inverse * descent);
    // The residual that is left after the step.
    const float residual = std::max(1e-3f * n, 2 * LL - 2 * gain * LR - descent.dot(inverse * descent)) / n;
    fit.information = 1 / (inverse(0, 0) * residual);
    return true;
  }

  cv::Point at_;
  Lane grey_[kRows];
  Lane gradient_[kRows];
  Lane weight_[kRows];
};

}  // namespace palpate
