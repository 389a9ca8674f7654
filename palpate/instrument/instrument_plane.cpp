#include "palpate/instrument/instrument_plane.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "palpate/stereo/seeds.h"

namespace palpate {

namespace {

using Vector4 = Eigen::Vector4d;  // disparity at the tip, slope in x, slope in y, row offset
using Matrix4 = Eigen::Matrix4d;

// The outline lies in the plane of the axis whatever the shape of the instrument; how far the surface stands out of it
// is only a guess, so the texture has little to say here.
constexpr LayerNoise kNoise{30, 24};
constexpr double kSlopeDeviation = 0.05;  // px/px along the axis; a shaft that halves its depth over the image has 0.05
constexpr double kSlopeAcross = 0.01;     // the outline of a round shaft lies square to the line of sight
/// From frame to frame: a hand that goes 6 mm in one turns a steep shaft by as much.
constexpr double kSlopeChange = 0.01;
constexpr double kRowFloor_px = 0.06;  // of an outline, which light moves differently in both cameras
constexpr size_t kMinMatches = 60;
constexpr double kMinDisparity_px = 2, kMaxDisparity_px = 200;
constexpr double kMinAgreement = 0.35;
constexpr double kCorrelatedNoise = 12;  // pixels that share one noise sample after smoothing and video coding

struct System {
  Matrix4 normal = Matrix4::Zero();
  Vector4 right = Vector4::Zero();
  double information = 0, full_information = 0, squared_error = 0, weight = 0;
  double agreement() const { return full_information > 0 ? information / full_information : 0; }
};

struct Problem {
  const PatchTemplate& left;
  cv::Point2d tip;
  const ImageLayers& right;
  double focal_px;
};

CellWarp warp_cell(const PatchCell& cell, const Problem& problem, const Vector4& p) {
  CellWarp warp;
  const cv::Point2d center = cell.center_px, tip = problem.tip;
  // A surface that stands h px out of the plane is nearer by h z / f, so its disparity larger by d h / f.
  const double nearer = 1 + cell.height_px / problem.focal_px;
  const double d = nearer * (p[0] + p[1] * (center.x - tip.x) + p[2] * (center.y - tip.y));
  warp.center_px = {center.x - d, center.y + p[3]};
  warp.linear = {1 - p[1], -p[2], 0, 1};
  return warp;
}

System assemble(const Problem& problem, int level, const Vector4& p) {
  System system;
  const cv::Point2d tip = problem.tip;
  for (const PatchCell& cell : problem.left.cells[static_cast<size_t>(level)]) {
    const CellEquations e =
        cell_equations(cell, problem.right, level, warp_cell(cell, problem, p), kNoise, Light::offset);
    Eigen::Matrix<double, 2, 4> jacobian;
    jacobian << -1, -(cell.center_px.x - tip.x), -(cell.center_px.y - tip.y), 0, 0, 0, 0, 1;
    system.normal += jacobian.transpose() * e.normal * jacobian;
    system.right += jacobian.transpose() * e.right;
    system.information += e.information;
    system.full_information += e.full_information;
    system.squared_error += e.squared_error;
    system.weight += e.weight;
  }
  return system;
}

/// Best disparity of a coarse search along the row, where Gauss-Newton alone could settle on the wrong edge.
double search_disparity(const Problem& problem, double guess) {
  const int level = ImageLayers::kLevels - 1;
  double best = guess, best_agreement = -1;
  for (double d = guess - 12; d <= guess + 12; d += 2) {
    const System system = assemble(problem, level, Vector4(d, 0, 0, 0));
    if (system.agreement() > best_agreement) best_agreement = system.agreement(), best = d;
  }
  return best;
}

/// What is known of slopes and row offset without the picture; nothing of the disparity itself.
struct Expected {
  Vector4 mean = Vector4::Zero();
  Matrix4 information = Matrix4::Zero();
};

Expected expected_plane(const ImageTip& tip, const PlanePrior& prior) {
  const Eigen::Vector2d along(tip.axis.x, tip.axis.y), across(-tip.axis.y, tip.axis.x);
  const double along_deviation =
      prior.before ? std::min(kSlopeDeviation, std::hypot(prior.before->slope_deviation, kSlopeChange))
                   : kSlopeDeviation;
  Expected expected;
  expected.information.block<2, 2>(1, 1) = along * along.transpose() / std::pow(along_deviation, 2) +
                                           across * across.transpose() / std::pow(kSlopeAcross, 2);
  if (prior.before) expected.mean.segment<2>(1) = along.dot(prior.before->disparity.tail<2>()) * along;
  expected.information(3, 3) = 1 / std::pow(prior.rows.deviation_px, 2);
  expected.mean[3] = prior.rows.px;
  return expected;
}

}  // namespace

RowOffset measure_row_offset(const cv::Mat& left_bgr, const cv::Mat& right_bgr) {
  const cv::Mat everywhere(left_bgr.size(), CV_8U, cv::Scalar(255));
  const Seeds seeds = find_seeds(prepare_pair(left_bgr, right_bgr, everywhere), kMinDisparity_px, kMaxDisparity_px);
  if (seeds.matches.size() < kMinMatches) return {};
  return {seeds.row_offset_px, std::hypot(kRowFloor_px, seeds.calibration_deviation_px)};
}

std::optional<InstrumentPlane> match_instrument(const PatchTemplate& left, const ImageTip& tip,
                                                const ImageLayers& right, double focal_px, const PlanePrior& prior) {
  const Problem problem{left, tip.tip_px, right, focal_px};
  const Expected expected = expected_plane(tip, prior);
  const Matrix4 expected_normal = kCorrelatedNoise * expected.information;
  Vector4 p = expected.mean;
  p[0] = search_disparity(problem, prior.disparity_px);
  System system;
  for (int level = ImageLayers::kLevels - 1; level >= 0; --level) {
    for (int pass = 0; pass < 8; ++pass) {
      system = assemble(problem, level, p);
      const Matrix4 normal = system.normal + expected_normal + 1e-6 * Matrix4::Identity();
      const Vector4 step = normal.ldlt().solve(system.right - expected_normal * (p - expected.mean));
      p += step;
      if (std::abs(step[0]) < 0.003 && std::abs(step[3]) < 0.003) break;
    }
  }
  if (system.agreement() < kMinAgreement || !(p[0] > 0.5)) return {};
  InstrumentPlane plane;
  plane.origin_px = tip.tip_px;
  plane.disparity = p.head<3>();
  plane.row_offset_px = p[3];
  plane.agreement = system.agreement();
  const double noise = std::max(0.1, system.squared_error / std::max(system.weight, 1.0));
  const Matrix4 covariance = kCorrelatedNoise * noise * (system.normal + expected_normal).inverse();
  plane.disparity_deviation_px = std::sqrt(covariance(0, 0));
  const Eigen::Vector2d along(tip.axis.x, tip.axis.y);
  plane.slope_deviation = std::sqrt(along.dot(covariance.block<2, 2>(1, 1) * along));
  return plane;
}

}  // namespace palpate
