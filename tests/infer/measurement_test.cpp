#include "palpate/infer/measurement.h"

#include <gtest/gtest.h>

namespace palpate {
namespace {

Rectification turned_rig() {
  Rectification r;
  r.size = {960, 540};
  r.focal_px = 700;
  r.principal_x_px = 470;
  r.principal_y_px = 280;
  r.baseline_mm = 5;
  const SceneMotion turn{Vec3::Zero(), {0.02, -0.03, 0.01}, Vec3::Zero()};
  r.rectified_from_left = turn.rotation();
  return r;
}

TEST(Measurement, TheDerivativeOfTheProjectionIsThatOfFiniteDifferences) {
  const Rectification rig = turned_rig();
  const Vec3 point(12, -9, 95);
  const StereoProjection at = project_stereo(rig, point);
  constexpr double kStep_mm = 1e-4;
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 step = kStep_mm * Vec3::Unit(axis);
    const Vec3 per_mm = (project_stereo(rig, point + step).px - project_stereo(rig, point - step).px) / (2 * kStep_mm);
    EXPECT_LT((per_mm - at.per_mm.col(axis)).norm(), 1e-5) << axis;
  }
  EXPECT_NEAR(at.px.z(), rig.disparity_px(rectified_depth_mm(rig, point)), 1e-9);
}

TEST(Measurement, TheDerivativesByTheScenesMotionAreThoseOfFiniteDifferences) {
  const Rectification rig = turned_rig();
  const InferenceParameters parameters;
  TissuePoint point;
  point.rest_mm = {12, -9, 95};
  const Vec3 about_mm(0, 0, 100);
  Eigen::VectorXd x0 = Eigen::VectorXd::Zero(Unknowns::kScene);
  x0.head<9>() << 0.5, -1, 2, 0.001, -0.002, 0.0005, 0.01, -0.02, 0.005;
  const auto residual = [&](const Eigen::VectorXd& x) -> Eigen::VectorXd {
    return tissue_measurements({point}, {nullptr, nullptr, x, about_mm}, rig, parameters)[0].residual;
  };
  const Measurement m = tissue_measurements({point}, {nullptr, nullptr, x0, about_mm}, rig, parameters)[0];
  constexpr double kStep = 1e-5;
  for (int i = 0; i < Unknowns::kScene; ++i) {
    Eigen::VectorXd more = x0, less = x0;
    more[i] += kStep, less[i] -= kStep;
    const Eigen::VectorXd per_unknown = -(residual(more) - residual(less)) / (2 * kStep);
    EXPECT_LT((per_unknown - m.H.col(i)).norm(), 0.02 * per_unknown.norm() + 1e-6) << i;
  }
}

TEST(Measurement, TheModelErrsByARatioOfWhatAHalfSpaceWouldDo) {
  const InferenceParameters parameters;
  ContactResponse response;
  const std::vector<SurfacePlace> places(1);
  const std::vector<PatchReach> patches = {{Vec3(0, 0, 90), 3}};
  Eigen::VectorXd x0 = Eigen::VectorXd::Zero(Unknowns::count(1));
  x0.segment<3>(Unknowns::q(0)) << 0, 3, 4;
  const PredictedBody body{&response, &places, x0, Vec3::Zero(), &patches};
  const auto error_mm = [&](double distance_mm) {
    TissuePoint point;
    point.rest_mm = {distance_mm, 0, 90};
    return model_error_mm(point, body, parameters);
  };
  EXPECT_NEAR(error_mm(2), 5 * parameters.motion_error, 1e-12);
  EXPECT_NEAR(error_mm(6), 2.5 * parameters.motion_error, 1e-12);
  EXPECT_NEAR(error_mm(30), 0.5 * parameters.motion_error, 1e-12);
}

TEST(Measurement, ASmallDisplacementThatTheTipContradictsDoesNotMakeTheModelSurer) {
  const InferenceParameters parameters;
  ContactResponse response;
  const std::vector<SurfacePlace> places(1);
  const std::vector<PatchReach> patches = {{Vec3(0, 0, 90), 3, Vec3(0.5, 4, 90), Vec3(0.5, 0, 0)}};
  TissuePoint point;
  point.rest_mm = {6, 0, 90};
  for (const double q_mm : {0.1, 2.0, 4.0}) {
    Eigen::VectorXd x0 = Eigen::VectorXd::Zero(Unknowns::count(1));
    x0[Unknowns::q(0)] = q_mm;
    const PredictedBody body{&response, &places, x0, Vec3::Zero(), &patches};
    EXPECT_NEAR(model_error_mm(point, body, parameters), 0.5 * 4 * parameters.motion_error, 1e-12) << q_mm;
  }
}

TEST(Measurement, ATipIsLessSureAlongTheViewingRayWhereTheCamerasTellIt) {
  const InferenceParameters parameters;
  const Rectification rig = turned_rig();
  TipObservation near, far;
  near.tip_mm = Vec3(0, 0, 100);
  far.tip_mm = Vec3(0, 0, 200);
  const Mat3 covariance = tip_floor_covariance_mm2(near, rig, parameters);
  EXPECT_GT(covariance(2, 2), covariance(0, 0));
  EXPECT_GT(tip_floor_covariance_mm2(far, rig, parameters)(2, 2), covariance(2, 2));
  far.is_seen = false;
  const Mat3 told = tip_floor_covariance_mm2(far, rig, parameters);
  EXPECT_DOUBLE_EQ(told(2, 2), told(0, 0));
}

}  // namespace
}  // namespace palpate
