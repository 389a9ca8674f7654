#include "palpate/contact/contact_model.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <future>
#include <limits>

namespace palpate {

namespace {

/// Relative to the largest nodal force. Measured (rendered sequences; tests/app/slab.yaml): 1e-4 takes 5 % less of a
/// frame's time but lets rounding move a force by up to 3e-4; 1e-6 takes 4 % more and moves no force by more than 1e-4.
constexpr double kFrameResidual = 1e-5;
/// Ratio of the radii between which the derivative by log radius is differenced: wide enough to smooth over which
/// triangles a patch covers.
constexpr double kRadiusStep = 1.25;

struct Patch {
  Vec3 place_mm = Vec3::Zero();
  double radius_mm = 0;
  Footprint footprint;
};

/// A patch that is a quarter larger bears about a quarter more. On a stiffness that is nearly singular (tissue pressed
/// beneath another patch) it may seem to bear anything.
constexpr double kPlausibleRatio = 2;

bool is_plausible(const ContactSensitivity& changed, const ContactSensitivity& now, size_t contact) {
  const auto at = 3 * static_cast<Eigen::Index>(contact);
  const Mat3 force = changed.force.block<3, 3>(at, at);
  const double ratio = force.trace() / now.force.block<3, 3>(at, at).trace();
  return Eigen::LLT<Mat3>(0.5 * (force + force.transpose())).info() == Eigen::Success && ratio > 1 / kPlausibleRatio &&
         ratio < kPlausibleRatio;
}

/// A body that was made ready for a patch serves one that has come this near to it.
constexpr double kSamePlace_radii = 0.25;

/// Unit response of all contacts with one patch made larger, minus with it made smaller, per log radius.
struct RadiusDerivative {
  Eigen::MatrixXd motion, force;
};

}  // namespace

struct ContactModel::State {
  /// What hangs on the mesh.
  struct Body {
    std::vector<int> fixed_nodes;
    std::vector<Triangle> boundary;
    std::unique_ptr<TetModel> model;
    std::unique_ptr<EquilibriumSolver> solver;
    std::vector<Patch> patches;  // the last one may be where a contact is expected

    Footprint footprint_of(const Patch& patch, double radius_mm) const {
      return make_footprint(*model, boundary, patch.place_mm, radius_mm);
    }

    void lay(Patch& patch) const {
      patch.footprint = footprint_of(patch, patch.radius_mm);
      patch.place_mm = patch.footprint.center_mm;
    }

    void hold_from_rest() {
      solver->release();
      for (const Patch& patch : patches) solver->hold_also(patch.footprint);
    }
  };

  MeshAround mesh_around;
  TissueOptions tissue;
  Element element;
  int mesh_version = 0;

  Body body;
  std::future<Body> expected;
  std::vector<Patch> expected_patches;  // of that body
  int factorizations = -1;              // of the solver when the derivatives by radius were taken
  std::vector<RadiusDerivative> radius_derivatives;

  Body body_with(std::vector<Patch> patches) const {
    std::vector<Vec3> places;
    for (const Patch& patch : patches) places.push_back(patch.place_mm);
    AttachedMesh attached = mesh_around(places);
    Body made;
    made.boundary = boundary_triangles(attached.mesh);
    made.model = std::make_unique<TetModel>(attached.mesh, tissue, attached.fixed_nodes, element);
    made.fixed_nodes = std::move(attached.fixed_nodes);
    made.solver =
        std::make_unique<EquilibriumSolver>(*made.model, EquilibriumOptions{.relative_residual = kFrameResidual});
    made.patches = std::move(patches);
    for (Patch& patch : made.patches) made.lay(patch);
    made.hold_from_rest();
    return made;
  }

  void take(Body made) {
    body = std::move(made);
    forget_derivatives();
    ++mesh_version;
  }

  void forget_derivatives() {
    radius_derivatives.clear();
    factorizations = -1;
  }

  /// The body that was made ready serves these patches.
  bool is_expected(const std::vector<Patch>& patches) const {
    if (!expected.valid() || patches.size() != expected_patches.size()) return false;
    for (size_t i = 0; i < patches.size(); ++i)
      if ((patches[i].place_mm - expected_patches[i].place_mm).norm() > kSamePlace_radii * patches[i].radius_mm)
        return false;
    return true;
  }

  std::vector<Footprint> footprints_with(size_t changed, double radius_mm) const {
    std::vector<Footprint> footprints;
    for (size_t i = 0; i < body.patches.size(); ++i)
      footprints.push_back(i == changed ? body.footprint_of(body.patches[i], radius_mm) : body.patches[i].footprint);
    return footprints;
  }

  void differentiate() {
    const ContactSensitivity sensitivity = body.solver->sensitivity();
    radius_derivatives.clear();
    for (size_t i = 0; i < body.patches.size(); ++i) {
      const auto of_radius = [&](double ratio) {
        return body.solver->sensitivity_with(footprints_with(i, body.patches[i].radius_mm * ratio));
      };
      ContactSensitivity larger = of_radius(kRadiusStep), smaller = of_radius(1 / kRadiusStep);
      double steps = 2;
      for (ContactSensitivity* changed : {&larger, &smaller})
        if (!is_plausible(*changed, sensitivity, i)) {
          *changed = sensitivity;
          --steps;
        }
      const double per_log = 1 / (std::max(steps, 1.0) * std::log(kRadiusStep));
      radius_derivatives.push_back(
          {per_log * (larger.motion - smaller.motion), per_log * (larger.force - smaller.force)});
    }
    factorizations = body.solver->factorizations();
  }
};

ContactModel::ContactModel(MeshAround mesh_around, const TissueOptions& tissue, Element element)
    : state_(std::make_unique<State>()) {
  state_->mesh_around = std::move(mesh_around);
  state_->tissue = tissue;
  state_->element = element;
}
ContactModel::~ContactModel() = default;
ContactModel::ContactModel(ContactModel&&) noexcept = default;

size_t ContactModel::contact_count() const {
  return state_->body.patches.size();
}

void ContactModel::expect(const Vec3& place_mm, double radius_mm) {
  State& s = *state_;
  std::vector<Patch> patches = s.body.patches;
  patches.push_back({place_mm, radius_mm, {}});
  if (s.is_expected(patches)) return;
  if (s.expected.valid()) s.expected.wait();
  s.expected_patches = patches;
  s.expected = std::async(std::launch::async, [&s, patches] {
    State::Body made = s.body_with(patches);
    made.solver->refresh();  // what a first factorization loads and sets up is not left to the frame of the touch
    return made;
  });
}

void ContactModel::begin(const Vec3& place_mm, double radius_mm) {
  State& s = *state_;
  std::vector<Patch> patches = s.body.patches;
  patches.push_back({place_mm, radius_mm, {}});
  if (!s.is_expected(patches)) {
    s.take(s.body_with(patches));
    return;
  }
  State::Body made = s.expected.get();
  made.patches = std::move(patches);
  for (Patch& patch : made.patches) made.lay(patch);
  made.hold_from_rest();
  s.take(std::move(made));
}

void ContactModel::end(size_t contact) {
  State::Body& body = state_->body;
  body.patches.erase(body.patches.begin() + static_cast<std::ptrdiff_t>(contact));
  body.solver->release(contact);
  state_->forget_derivatives();
}

void ContactModel::move(size_t contact, const Vec3& place_mm) {
  std::vector<Patch> patches = state_->body.patches;
  patches.at(contact).place_mm = place_mm;
  state_->take(state_->body_with(std::move(patches)));
}

std::optional<Equilibrium> ContactModel::set_radius(size_t contact, double radius_mm, const std::vector<Vec3>& q_mm) {
  State::Body& body = state_->body;
  const Patch before = body.patches.at(contact);
  body.patches[contact] = {before.place_mm, radius_mm, body.footprint_of(before, radius_mm)};
  std::vector<Footprint> footprints;
  for (const Patch& patch : body.patches) footprints.push_back(patch.footprint);
  body.solver->replace(footprints);
  state_->factorizations = -1;
  Equilibrium equilibrium = body.solver->solve_all(q_mm);
  if (equilibrium.converged) return equilibrium;
  body.hold_from_rest();
  equilibrium = body.solver->solve_all(q_mm);
  if (equilibrium.converged) return equilibrium;
  body.patches[contact] = before;
  body.hold_from_rest();
  body.solver->solve_all(q_mm);
  return std::nullopt;
}

Equilibrium ContactModel::solve(const std::vector<Vec3>& q_mm) {
  State::Body& body = state_->body;
  Equilibrium equilibrium = body.solver->solve_all(q_mm);
  if (equilibrium.converged) return equilibrium;
  // The way from the last state may be closed where the way from rest is not.
  body.hold_from_rest();
  state_->factorizations = -1;
  return body.solver->solve_all(q_mm);
}

void ContactModel::refresh() {
  State& s = *state_;
  if (s.body.patches.empty()) return;
  s.body.solver->refresh();
  if (s.factorizations != s.body.solver->factorizations()) s.differentiate();
}

ContactResponse ContactModel::respond(const Equilibrium& equilibrium, const std::vector<Vec3>& q_mm) {
  State& s = *state_;
  const auto contacts = static_cast<Eigen::Index>(s.body.patches.size());
  Eigen::VectorXd q(3 * contacts);
  for (Eigen::Index i = 0; i < contacts; ++i) q.segment<3>(3 * i) = q_mm.at(static_cast<size_t>(i));
  ContactSensitivity sensitivity = s.body.solver->sensitivity();
  ContactResponse response;
  response.equilibrium = equilibrium;
  response.motion = std::move(sensitivity.motion);
  response.force = std::move(sensitivity.force);
  response.motion_per_log_radius.setZero(3 * s.body.model->node_count(), contacts);
  response.force_per_log_radius.setZero(3 * contacts, contacts);
  // At rest, as in the first frame of a contact, no radius makes a difference.
  if (q.isZero(0)) return response;
  if (s.radius_derivatives.empty()) s.differentiate();
  for (Eigen::Index i = 0; i < contacts; ++i) {
    const RadiusDerivative& derivative = s.radius_derivatives[static_cast<size_t>(i)];
    response.motion_per_log_radius.col(i) = derivative.motion * q;
    response.force_per_log_radius.col(i) = derivative.force * q;
  }
  return response;
}

const Footprint& ContactModel::footprint(size_t contact) const {
  return state_->body.patches.at(contact).footprint;
}

double ContactModel::radius_mm(size_t contact) const {
  return state_->body.patches.at(contact).radius_mm;
}

double ContactModel::distance_to_attachments_mm(size_t contact) const {
  const State::Body& body = state_->body;
  double nearest_mm = std::numeric_limits<double>::infinity();
  for (int node : body.fixed_nodes)
    nearest_mm =
        std::min(nearest_mm, (body.model->rest_mm()[static_cast<size_t>(node)] - footprint(contact).center_mm).norm());
  return nearest_mm;
}

const TetModel& ContactModel::model() const {
  return *state_->body.model;
}

const std::vector<Triangle>& ContactModel::boundary() const {
  return state_->body.boundary;
}

int ContactModel::mesh_version() const {
  return state_->mesh_version;
}

}  // namespace palpate
