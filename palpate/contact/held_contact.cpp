#include "palpate/contact/held_contact.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace palpate {

namespace {
/// Slip corrections per frame: each brings the tangential force back to the cone, the next one mends the nonlinearity.
constexpr int kSlipCorrections = 4;
constexpr double kConeTolerance = 1.02;
/// In footprint radii: a push that has slid farther stands on other tissue.
constexpr double kFarthestSlip = 0.5;
}  // namespace

struct HeldContact::State {
  std::shared_ptr<TouchedBody> body;
  ContactOptions options;
  int number;
  Vec3 place_mm;  // of the tip on the surface at rest: the middle of the footprint, from where a push has slid

  State(std::shared_ptr<TouchedBody> b, const Vec3& touch_mm, const ContactOptions& o)
      : body(std::move(b)), options(o), number(body->begin(touch_mm)), place_mm(footprint().center_mm) {}
  ~State() { body->end(number); }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  const Footprint& footprint() const { return body->footprint(number); }

  Answer grasp(const Vec3& displacement_mm) {
    return {body->solve(number, displacement_mm), false, false, displacement_mm};
  }

  /// Tangential part of a force beyond Coulomb's cone, as a share of the whole; 0 within the cone.
  double share_beyond_cone(const Vec3& force_N) const {
    const double normal_N = -force_N.dot(footprint().normal);
    const double tangential_N = tangential(force_N).norm();
    if (tangential_N <= kConeTolerance * options.friction * normal_N) return 0;
    return 1 - options.friction * normal_N / tangential_N;
  }

  Vec3 tangential(const Vec3& v) const { return v - v.dot(footprint().normal) * footprint().normal; }

  Answer apart() { return {body->solve_without(number), true, false, std::nullopt}; }

  Answer push(const Vec3& displacement_mm, const Answer* tied) {
    const Vec3 tip_mm = footprint().center_mm + displacement_mm;
    bool slid = false;
    for (int correction = 0;; ++correction) {
      const Vec3 pressed_mm = tip_mm - place_mm;
      if ((pressed_mm - body->displaced_at_begin_mm(number)).dot(footprint().normal) >= 0) return apart();
      const bool is_tied = tied && correction == 0 && place_mm == footprint().center_mm;
      Answer answer = is_tied ? *tied : grasp(pressed_mm);
      answer.slid = slid;
      if (!answer.equilibrium.converged) return answer;
      if (answer.equilibrium.force_N.dot(footprint().normal) >= 0) return apart();
      const double beyond = share_beyond_cone(answer.equilibrium.force_N);
      if (beyond == 0 || correction == kSlipCorrections) return answer;
      slid = true;
      place_mm =
          closest_point(place_mm + beyond * tangential(pressed_mm), body->model().rest_mm(), body->boundary()).point;
    }
  }
};

HeldContact::HeldContact(std::shared_ptr<TouchedBody> body, const Vec3& touch_mm, const ContactOptions& options)
    : state_(std::make_unique<State>(std::move(body), touch_mm, options)) {}
HeldContact::~HeldContact() = default;
HeldContact::HeldContact(HeldContact&&) noexcept = default;
HeldContact& HeldContact::operator=(HeldContact&&) noexcept = default;

HeldContact::Answer HeldContact::grasp(const Vec3& displacement_mm) {
  return state_->grasp(displacement_mm);
}

HeldContact::Answer HeldContact::push(const Vec3& displacement_mm, const Answer* tied) {
  return state_->push(displacement_mm, tied);
}

void HeldContact::raise_friction(double coefficient) {
  state_->options.friction = std::max(state_->options.friction, coefficient);
}

HeldContact::Answer HeldContact::move(const Vec3& displacement_mm) {
  return state_->options.grip == Grip::push ? push(displacement_mm) : grasp(displacement_mm);
}

const Vec3& HeldContact::place_mm() const {
  return state_->place_mm;
}

bool HeldContact::has_left_its_footprint() const {
  return (state_->place_mm - footprint().center_mm).norm() > kFarthestSlip * state_->options.footprint_radius_mm;
}

void HeldContact::move_footprint() {
  state_->body->move_footprint(state_->number, state_->place_mm);
  state_->place_mm = footprint().center_mm;
}

const TouchedBody& HeldContact::body() const {
  return *state_->body;
}
int HeldContact::number() const {
  return state_->number;
}
const Footprint& HeldContact::footprint() const {
  return state_->footprint();
}
const Vec3& HeldContact::displaced_at_begin_mm() const {
  return state_->body->displaced_at_begin_mm(state_->number);
}
bool HeldContact::near_attachment() const {
  return state_->body->distance_to_attachments_mm(state_->number) < 2 * state_->options.footprint_radius_mm;
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
