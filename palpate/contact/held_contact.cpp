#include "palpate/contact/held_contact.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate {

namespace {
/// Slip corrections per frame: each brings the tangential force back to the cone, the next one mends the nonlinearity.
constexpr int kSlipCorrections = 4;
constexpr double kConeTolerance = 1.02;
/// The force of a frame is wanted to a per mille; the tip is not known better.
constexpr double kFrameResidual = 1e-4;
/// In footprint radii: a push that has slid farther stands on other tissue.
constexpr double kFarthestSlip = 0.5;
}  // namespace

struct HeldContact::State {
  std::vector<Triangle> boundary;
  TetModel model;
  Footprint footprint;
  EquilibriumSolver solver;
  ContactOptions options;
  Vec3 place_mm;  // of the tip on the surface at rest, from where it has slid
  bool near_attachment = false;

  State(const TetMesh& mesh, const std::vector<int>& fixed, const TissueOptions& tissue, const Vec3& touch_mm,
        const ContactOptions& o, Element element)
      : boundary(boundary_triangles(mesh)),
        model(mesh, tissue, fixed, element),
        footprint(make_footprint(model, boundary, touch_mm, o.footprint_radius_mm)),
        solver(model, EquilibriumOptions{.relative_residual = kFrameResidual}),
        options(o),
        place_mm(footprint.center_mm) {
    solver.hold(footprint);
    double nearest_mm = std::numeric_limits<double>::infinity();
    for (int node : fixed)
      nearest_mm = std::min(nearest_mm, (mesh.nodes_mm[static_cast<size_t>(node)] - footprint.center_mm).norm());
    near_attachment = nearest_mm < 2 * o.footprint_radius_mm;
  }

  Answer grasp(const Vec3& displacement_mm) { return {solver.solve(displacement_mm), false, false}; }

  /// Tangential part of a force beyond Coulomb's cone, as a share of the whole; 0 within the cone.
  double share_beyond_cone(const Vec3& force_N) const {
    const double normal_N = -force_N.dot(footprint.normal);
    const double tangential_N = tangential(force_N).norm();
    if (tangential_N <= kConeTolerance * options.friction * normal_N) return 0;
    return 1 - options.friction * normal_N / tangential_N;
  }

  Vec3 tangential(const Vec3& v) const { return v - v.dot(footprint.normal) * footprint.normal; }

  Answer apart() const {
    Answer answer;
    answer.let_go = true;
    answer.equilibrium.converged = true;
    answer.equilibrium.u = Eigen::VectorXd::Zero(3 * model.node_count());
    return answer;
  }

  Answer push(const Vec3& displacement_mm, const Answer* tied) {
    const Vec3 tip_mm = footprint.center_mm + displacement_mm;
    bool slid = false;
    for (int correction = 0;; ++correction) {
      const Vec3 pressed_mm = tip_mm - place_mm;
      if (pressed_mm.dot(footprint.normal) >= 0) return apart();
      const bool is_tied = tied && correction == 0 && place_mm == footprint.center_mm;
      Answer answer = is_tied ? *tied : grasp(pressed_mm);
      answer.slid = slid;
      if (!answer.equilibrium.converged) return answer;
      if (answer.equilibrium.force_N.dot(footprint.normal) >= 0) return apart();
      const double beyond = share_beyond_cone(answer.equilibrium.force_N);
      if (beyond == 0 || correction == kSlipCorrections) return answer;
      slid = true;
      place_mm = closest_point(place_mm + beyond * tangential(pressed_mm), model.rest_mm(), boundary).point;
    }
  }
};

HeldContact::HeldContact(const TetMesh& mesh, const std::vector<int>& fixed_nodes, const TissueOptions& tissue,
                         const Vec3& touch_mm, const ContactOptions& options, Element element)
    : state_(std::make_unique<State>(mesh, fixed_nodes, tissue, touch_mm, options, element)) {}
HeldContact::~HeldContact() = default;
HeldContact::HeldContact(HeldContact&&) noexcept = default;
HeldContact& HeldContact::operator=(HeldContact&&) noexcept = default;

HeldContact::Answer HeldContact::grasp(const Vec3& displacement_mm) {
  return state_->grasp(displacement_mm);
}

HeldContact::Answer HeldContact::push(const Vec3& displacement_mm, const Answer* tied) {
  return state_->push(displacement_mm, tied);
}

HeldContact::Answer HeldContact::move(const Vec3& displacement_mm) {
  return state_->options.grip == Grip::push ? push(displacement_mm) : grasp(displacement_mm);
}

const Vec3& HeldContact::place_mm() const {
  return state_->place_mm;
}

bool HeldContact::has_left_its_footprint() const {
  return (state_->place_mm - state_->footprint.center_mm).norm() > kFarthestSlip * state_->options.footprint_radius_mm;
}

const TetModel& HeldContact::model() const {
  return state_->model;
}
const std::vector<Triangle>& HeldContact::boundary() const {
  return state_->boundary;
}
const Footprint& HeldContact::footprint() const {
  return state_->footprint;
}
bool HeldContact::near_attachment() const {
  return state_->near_attachment;
}

std::vector<Vec3> displacement_at(const TetModel& model, const std::vector<Triangle>& boundary,
                                  const Eigen::VectorXd& u, const std::vector<Vec3>& rest_points_mm) {
  std::vector<Vec3> displacement;
  displacement.reserve(rest_points_mm.size());
  for (const Vec3& point : rest_points_mm) {
    const ClosestPoint nearest = closest_point(point, model.rest_mm(), boundary);
    Vec3 moved = Vec3::Zero();
    for (int c = 0; c < 3 && nearest.triangle >= 0; ++c) {
      const int node = boundary[static_cast<size_t>(nearest.triangle)][static_cast<size_t>(c)];
      moved += nearest.barycentric[c] * u.segment<3>(3 * node);
    }
    displacement.push_back(moved);
  }
  return displacement;
}

}  // namespace palpate
