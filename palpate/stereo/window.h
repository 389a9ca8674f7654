#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "palpate/stereo/simd.h"

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

/// What the sums over a window say: the step of the plane that Gauss-Newton takes on
/// sum w (L - gain R - offset)^2 with gain and offset free, the correlation before it and the information after it.
struct WindowSums {
  float n = 0, l = 0, r = 0, ll = 0, rr = 0, lr = 0;             // of w, w L, w R, ...
  float g = 0, gu = 0, gv = 0;                                   // of w g, w g u, ...; g = slope of the images
  float gg = 0, ggu = 0, ggv = 0, gguu = 0, gguv = 0, ggvv = 0;  // of w g g, ...
  float gl = 0, glu = 0, glv = 0, gr = 0, gru = 0, grv = 0;      // of w g L, ...

  /// False where one of the windows shows nothing or they have nothing in common.
  bool solve(Eigen::Vector3f& step, float& correlation, float& information) const {
    // A weak belief in the predicted slopes: a deviation of 0.03, against noise of one grey level.
    constexpr float slope_belief = 1 / (0.03f * 0.03f);
    const float LL = ll - l * l / n, RR = rr - r * r / n, LR = lr - l * r / n;
    if (!(LL > 1e-3f && RR > 1e-3f && LR > 0)) return false;
    correlation = LR / std::sqrt(LL * RR);
    const float gain = std::sqrt(LL / RR);
    Eigen::Matrix3f H;
    const float h1 = ggu - g * gu / n, h2 = ggv - g * gv / n, h4 = gguv - gu * gv / n;
    H << gg - g * g / n, h1, h2, h1, gguu - gu * gu / n + slope_belief, h4, h2, h4, ggvv - gv * gv / n + slope_belief;
    const float residual_mean = (l - gain * r) / n;
    const Eigen::Vector3f descent(gl - gain * gr - g * residual_mean, glu - gain * gru - gu * residual_mean,
                                  glv - gain * grv - gv * residual_mean);
    const Eigen::Matrix3f inverse = H.inverse();
    step = -(inverse * descent);
    // The residual that is left after the step.
    const float residual = std::max(1e-3f * n, 2 * LL - 2 * gain * LR - descent.dot(inverse * descent)) / n;
    information = 1 / (inverse(0, 0) * residual);
    return true;
  }
};

/// The window of one pixel, 7 x 7, kept as pairs of rows of eight (the last column and the last row have no weight).
class Window {
 public:
  static constexpr int kRadius = 3;

  /// False where too little of the window can be used or where the row shows no texture.
  bool cut(const Level& from, cv::Point at) {
    at_ = at;
    middle_ = *from.grey_at(at.x, at.y);
    FloatLanes weights = {}, energy = {};
    for (int k = 0; k < kPairs; ++k) {
      const int x = at.x - kRadius, y = at.y + 2 * k - kRadius;
      weight_[k] = load_halves(from.weight_at(x, y), from.weight_at(x, y + 1)) * falloff(k);
      grey_[k] = load_halves(from.grey_at(x, y), from.grey_at(x, y + 1)) - middle_;
      gradient_[k] = load_halves(from.gradient_at(x, y), from.gradient_at(x, y + 1));
      weights += weight_[k];
      energy += weight_[k] * gradient_[k] * gradient_[k];
    }
    const float sum = total(weights);
    return sum > kMinFraction * kFullWeight && total(energy) > kMinGradient * sum;
  }

  /// Gauss-Newton from a predicted plane, gain and offset free in every step, the mean of both images' gradients as in
  /// efficient second-order minimisation. False when the window leaves the other image or the answer leaves the
  /// prediction by more than `most_step` px.
  bool fit(const Level& to, DisparityPlane predicted, float max_step, float steepest, int iterations,
           WindowFit& result) {
    result.plane = predicted;
    for (int i = 0; i < iterations; ++i) {
      Eigen::Vector3f step;
      if (!look(to, result, step)) return false;
      DisparityPlane& plane = result.plane;
      plane.d += step[0];
      plane.dx += step[1];
      plane.dy += step[2];
      if (!(std::abs(plane.d - predicted.d) <= max_step && std::abs(plane.dx) <= steepest &&
            std::abs(plane.dy) <= steepest))
        return false;
      if (std::abs(step[0]) < 0.02f) break;
    }
    return true;
  }

 private:
  static constexpr int kPairs = 4;
  static constexpr float kMinFraction = 0.2f;   // of the window's weight
  static constexpr float kMinGradient = 0.02f;  // mean square of the gradient, grey levels per px
  static constexpr float kFullWeight = 27.5625f;

  // Columns -3..3 and nothing, twice; the row of the first half is 2 k - 3.
  static constexpr FloatLanes kColumn = {-3, -2, -1, 0, 1, 2, 3, 4, -3, -2, -1, 0, 1, 2, 3, 4};
  static constexpr FloatLanes kSecondRow = {0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1};

  static FloatLanes row_of(int k) { return kSecondRow + static_cast<float>(2 * k - kRadius); }
  static FloatLanes falloff(int k) {
    const FloatLanes row = row_of(k);
    return (1 - kColumn * kColumn / 16) * (1 - row * row / 16);
  }

  // One look at the other image under the plane of `fit`: correlation and information there, and the step to take.
  bool look(const Level& to, WindowFit& fit, Eigen::Vector3f& step) const {
    const DisparityPlane& plane = fit.plane;
    const float reach = kRadius + 1, spread = (std::abs(plane.dx) + std::abs(plane.dy)) * reach;
    const float x0 = static_cast<float>(at_.x) - plane.d;
    if (!(x0 - reach - spread > 1 - Level::kMargin_px &&
          x0 + reach + spread < static_cast<float>(to.size.width + Level::kMargin_px - 3)))
      return false;
    const int stride = static_cast<int>(to.grey.step1());
    const IntLanes second_row = __builtin_convertvector(kSecondRow, IntLanes) * stride;
    FloatLanes n = {}, l = {}, r = {}, ll = {}, rr = {}, lr = {}, g = {}, gv = {}, gg = {}, ggv = {}, ggvv = {};
    FloatLanes gl = {}, glv = {}, gr = {}, grv = {};
    for (int k = 0; k < kPairs; ++k) {
      const int y = at_.y + 2 * k - kRadius;
      const float* row = to.grey_at(-Level::kMargin_px, y);
      const float* mask = to.weight_at(-Level::kMargin_px, y);
      const FloatLanes v = row_of(k);
      const FloatLanes x = x0 + Level::kMargin_px - plane.dy * v + kColumn * (1 - plane.dx);
      const IntLanes whole = __builtin_convertvector(x, IntLanes);
      const FloatLanes t = x - __builtin_convertvector(whole, FloatLanes);
      const IntLanes index = whole + second_row;
      // Catmull-Rom and its derivative.
      const FloatLanes a = gather(row - 1, index), b = gather(row, index), c = gather(row + 1, index),
                       d = gather(row + 2, index);
      const FloatLanes c1 = 0.5f * (c - a), c2 = a - 2.5f * b + 2 * c - 0.5f * d, c3 = 0.5f * (d - a) + 1.5f * (b - c);
      const FloatLanes other = b + t * (c1 + t * (c2 + t * c3)) - middle_;
      const FloatLanes slope = 0.5f * (gradient_[k] + c1 + t * (2 * c2 + 3 * t * c3));
      const FloatLanes w = weight_[k] * gather(mask, index);
      const FloatLanes wl = w * grey_[k], wr = w * other, wg = w * slope, wgg = wg * slope;
      const FloatLanes wgl = wg * grey_[k], wgr = wg * other;
      n += w, l += wl, r += wr, g += wg, gv += wg * v;
      ll += wl * grey_[k], rr += wr * other, lr += wl * other;
      gg += wgg, ggv += wgg * v, ggvv += wgg * v * v;
      gl += wgl, glv += wgl * v, gr += wgr, grv += wgr * v;
    }
    WindowSums sums;
    sums.n = total(n);
    if (sums.n < kMinFraction * kFullWeight) return false;
    sums.l = total(l), sums.r = total(r), sums.ll = total(ll), sums.rr = total(rr), sums.lr = total(lr);
    sums.g = total(g), sums.gu = total(g * kColumn), sums.gv = total(gv);
    sums.gg = total(gg), sums.ggu = total(gg * kColumn), sums.ggv = total(ggv);
    sums.gguu = total(gg * kColumn * kColumn), sums.gguv = total(ggv * kColumn), sums.ggvv = total(ggvv);
    sums.gl = total(gl), sums.glu = total(gl * kColumn), sums.glv = total(glv);
    sums.gr = total(gr), sums.gru = total(gr * kColumn), sums.grv = total(grv);
    return sums.solve(step, fit.correlation, fit.information);
  }

  cv::Point at_;
  float middle_ = 0;
  FloatLanes grey_[kPairs];
  FloatLanes gradient_[kPairs];
  FloatLanes weight_[kPairs];
};

}  // namespace palpate
