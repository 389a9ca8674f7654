#include "palpate/infer/measurement.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate {

namespace {

/// Tissue farther from the body's surface than this does not belong to it.
constexpr double kFarthestFromBody_mm = 4;

Mat3 cross_matrix(const Vec3& v) {
  Mat3 m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

Vec3 interpolated(const SurfacePlace& place, const Eigen::Ref<const Eigen::VectorXd>& nodal) {
  Vec3 sum = Vec3::Zero();
  for (size_t c = 0; c < 3; ++c) sum += place.barycentric[static_cast<int>(c)] * nodal.segment<3>(3 * place.nodes[c]);
  return sum;
}

/// A dx/d(scene) of the point of the body at y = X + u - about in the map, x = R (1 + strain) y now.
void fill_scene_columns(const SceneMotion& scene, const Vec3& y_mm, const Mat3& A, decltype(Measurement::H)& H) {
  Mat3 by_strain;
  by_strain << y_mm.x(), 0, y_mm.y(), 0, y_mm.y(), y_mm.x(), 0, 0, 0;
  H.middleCols<3>(Unknowns::kTranslation) = A;
  H.middleCols<3>(Unknowns::kRotation) = -A * cross_matrix(scene.linear() * y_mm);
  H.middleCols<3>(Unknowns::kStrain) = A * scene.rotation() * by_strain;
}

}  // namespace

std::vector<SurfacePlace> places_of(const std::vector<TissuePoint>& points, const std::vector<Vec3>& nodes_mm,
                                    const std::vector<Triangle>& boundary) {
  std::vector<Vec3> middle;
  std::vector<double> reach_mm;
  for (const Triangle& t : boundary) {
    const Vec3 &a = nodes_mm[static_cast<size_t>(t[0])], &b = nodes_mm[static_cast<size_t>(t[1])],
               &c = nodes_mm[static_cast<size_t>(t[2])];
    middle.push_back((a + b + c) / 3);
    reach_mm.push_back(std::max({(a - middle.back()).norm(), (b - middle.back()).norm(), (c - middle.back()).norm()}));
  }
  std::vector<SurfacePlace> places(points.size());
  for (size_t i = 0; i < points.size(); ++i) {
    double nearest_mm = kFarthestFromBody_mm;
    for (size_t t = 0; t < boundary.size(); ++t) {
      if ((middle[t] - points[i].rest_mm).norm() - reach_mm[t] >= nearest_mm) continue;
      const auto corner = [&](size_t k) -> const Vec3& { return nodes_mm[static_cast<size_t>(boundary[t][k])]; };
      const ClosestPoint found = closest_point_on_triangle(points[i].rest_mm, corner(0), corner(1), corner(2));
      if (found.distance >= nearest_mm) continue;
      nearest_mm = found.distance;
      places[i] = {boundary[t], found.barycentric, true};
    }
  }
  return places;
}

double model_error_mm(const TissuePoint& point, const PredictedBody& body, const InferenceParameters& parameters) {
  if (!body.response || !body.patches) return parameters.motion_error * body.displacement_mm(point).norm();
  const Belief at{body.x0, {}};
  double error2_mm2 = 0;
  for (size_t k = 0; k < body.patches->size(); ++k) {
    const PatchReach& patch = (*body.patches)[k];
    const double decay = std::min(1.0, patch.radius_mm / (point.rest_mm - patch.center_mm).norm());
    double displaced_mm = at.q_mm(k).norm();
    if (patch.tip_mm) {
      const Vec3 told_mm = at.scene(body.about_mm).undo(*patch.tip_mm) - patch.tip_offset_mm - patch.center_mm;
      displaced_mm = std::max(displaced_mm, told_mm.norm());
    }
    error2_mm2 += std::pow(parameters.motion_error * displaced_mm * decay, 2);
  }
  return std::sqrt(error2_mm2);
}

Vec3 PredictedBody::displacement_mm(const TissuePoint& point) const {
  if (!response || !places) return Vec3::Zero();
  const SurfacePlace& place = places->at(static_cast<size_t>(point.number));
  if (!place.on_body) return Vec3::Zero();
  const Belief at{x0, {}};
  Vec3 u_mm = interpolated(place, response->equilibrium.u);
  for (size_t k = 0; k < at.contacts(); ++k) u_mm += motion_by(point, k) * at.skew(k) * at.q_mm(k).norm();
  return u_mm;
}

Mat3 PredictedBody::motion_by(const TissuePoint& point, size_t contact) const {
  const SurfacePlace& place = places->at(static_cast<size_t>(point.number));
  Mat3 motion;
  for (Eigen::Index axis = 0; axis < 3; ++axis)
    motion.col(axis) = interpolated(place, response->motion.col(3 * static_cast<Eigen::Index>(contact) + axis));
  return motion;
}

StereoProjection project_stereo(const Rectification& rectification, const Vec3& point_mm) {
  const Vec3 p = rectification.rectified_from_left * point_mm;
  const double f = rectification.focal_px, fb = f * rectification.baseline_mm, z = p.z();
  Mat3 by_rectified;
  by_rectified << f / z, 0, -f * p.x() / (z * z), 0, f / z, -f * p.y() / (z * z), 0, 0, -fb / (z * z);
  return {{f * p.x() / z + rectification.principal_x_px, f * p.y() / z + rectification.principal_y_px, fb / z},
          by_rectified * rectification.rectified_from_left};
}

std::vector<Measurement> tissue_measurements(const std::vector<TissuePoint>& seen, const PredictedBody& body,
                                             const Rectification& rectification,
                                             const InferenceParameters& parameters) {
  const Eigen::Index unknowns = body.x0.size();
  const Belief at{body.x0, {}};
  const SceneMotion scene = at.scene(body.about_mm);
  const Mat3 L = scene.linear();
  const size_t contacts = at.contacts();
  Mat3 noise_px2;  // of left x, left y and left x minus right x
  noise_px2 << 1, 0, 1, 0, 1, 0, 1, 0, 2;
  noise_px2 *= parameters.point_px * parameters.point_px;
  const double weight =
      std::min(1.0, parameters.effective_points / std::max<double>(1, static_cast<double>(seen.size())));
  std::vector<Measurement> measurements;
  measurements.reserve(seen.size());
  for (const TissuePoint& point : seen) {
    const Vec3 u_mm = body.displacement_mm(point);
    const Vec3 y_mm = point.rest_mm + u_mm - body.about_mm;
    const StereoProjection rest = project_stereo(rectification, point.rest_mm),
                           now = project_stereo(rectification, body.about_mm + scene.translation_mm + L * y_mm);
    Measurement m;
    m.residual = point.motion_px - (now.px - rest.px) - Vec3(0, 0, body.x0[Unknowns::kBias]);
    m.H.setZero(3, unknowns);
    fill_scene_columns(scene, y_mm, now.per_mm, m.H);
    m.H(2, Unknowns::kBias) = 1;
    if (body.response) {
      const SurfacePlace& place = body.places->at(static_cast<size_t>(point.number));
      const Mat3 A = now.per_mm * L;
      for (size_t k = 0; k < contacts && place.on_body; ++k) {
        const auto column = static_cast<Eigen::Index>(k);
        const Mat3 motion = A * body.motion_by(point, k);
        m.H.middleCols<3>(Unknowns::q(k)) = motion;
        m.H.col(Unknowns::log_radius(k)) = A * interpolated(place, body.response->motion_per_log_radius.col(column));
        m.H.middleCols<3>(Unknowns::skew(k)) = motion * at.q_mm(k).norm();
      }
    }
    const double model_mm2 = std::pow(std::max(point.model_mm, model_error_mm(point, body, parameters)), 2);
    m.covariance = point.noise * point.noise * noise_px2 + model_mm2 * now.per_mm * now.per_mm.transpose();
    m.dof = parameters.point_dof;
    m.weight = weight;
    measurements.push_back(std::move(m));
  }
  return measurements;
}

Mat3 tip_floor_covariance_mm2(const TipObservation& tip, const Rectification& rectification,
                              const InferenceParameters& parameters) {
  const Mat3 floor_mm2 = std::pow(parameters.tip_floor_mm, 2) * Mat3::Identity();
  if (!tip.is_seen) return floor_mm2;
  const double z_mm = rectified_depth_mm(rectification, tip.tip_mm);
  const double along_mm =
      z_mm * z_mm / (rectification.focal_px * rectification.baseline_mm) * parameters.tip_disparity_px;
  const Vec3 ray = tip.tip_mm.normalized();
  return floor_mm2 + along_mm * along_mm * ray * ray.transpose();
}

Measurement tip_measurement(const Vec3& tip_mm, const Mat3& covariance_mm2, size_t contact, const Vec3& center_mm,
                            const PredictedBody& body, const InferenceParameters& parameters) {
  const Belief at{body.x0, {}};
  const SceneMotion scene = at.scene(body.about_mm);
  const Mat3 L = scene.linear();
  const Vec3 y_mm = center_mm + at.q_mm(contact) + at.offset_mm(contact) - body.about_mm;
  Measurement m;
  m.residual = tip_mm - (body.about_mm + scene.translation_mm + L * y_mm);
  m.H.setZero(3, body.x0.size());
  fill_scene_columns(scene, y_mm, Mat3::Identity(), m.H);
  m.H.middleCols<3>(Unknowns::q(contact)) = L;
  m.H.middleCols<3>(Unknowns::offset(contact)) = L;
  m.covariance = covariance_mm2;
  m.dof = parameters.tip_dof;
  return m;
}

std::vector<Vec3> expected_motion_px(const std::vector<TissuePoint>& points, const PredictedBody& body,
                                     const Rectification& rectification) {
  const SceneMotion scene = Belief{body.x0, {}}.scene(body.about_mm);
  std::vector<Vec3> motion_px;
  motion_px.reserve(points.size());
  for (const TissuePoint& point : points)
    motion_px.push_back(project_stereo(rectification, scene.apply(point.rest_mm + body.displacement_mm(point))).px -
                        project_stereo(rectification, point.rest_mm).px);
  return motion_px;
}

}  // namespace palpate
