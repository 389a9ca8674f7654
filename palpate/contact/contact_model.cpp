#include "palpate/contact/contact_model.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate {

namespace {

/// The force of a frame is wanted to a per mille; the tip is not known better.
constexpr double kFrameResidual = 1e-4;
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

/// Unit response of all contacts with one patch made larger, minus with it made smaller, per log radius.
struct RadiusDerivative {
  Eigen::MatrixXd motion, force;
};

}  // namespace

struct ContactModel::State {
  MeshAround mesh_around;
  TissueOptions tissue;
  Element element;
  int mesh_version = 0;

  std::vector<int> fixed_nodes;
  std::vector<Triangle> boundary;
  std::unique_ptr<TetModel> model;
  std::unique_ptr<EquilibriumSolver> solver;
  std::vector<Patch> patches;
  int factorizations = -1;  // of the solver when the derivatives were taken
  ContactSensitivity sensitivity;
  std::vector<RadiusDerivative> radius_derivatives;

  Footprint footprint_of(const Patch& patch, double radius_mm) const {
    return make_footprint(*model, boundary, patch.place_mm, radius_mm);
  }

  void rebuild() {
    std::vector<Vec3> places;
    for (const Patch& patch : patches) places.push_back(patch.place_mm);
    AttachedMesh attached = mesh_around(places);
    boundary = boundary_triangles(attached.mesh);
    solver.reset();
    model = std::make_unique<TetModel>(attached.mesh, tissue, attached.fixed_nodes, element);
    fixed_nodes = std::move(attached.fixed_nodes);
    solver = std::make_unique<EquilibriumSolver>(*model, EquilibriumOptions{.relative_residual = kFrameResidual});
    for (Patch& patch : patches) {
      patch.footprint = footprint_of(patch, patch.radius_mm);
      patch.place_mm = patch.footprint.center_mm;
    }
    hold_from_rest();
    ++mesh_version;
  }

  void hold_from_rest() {
    solver->release();
    for (const Patch& patch : patches) solver->hold_also(patch.footprint);
    factorizations = -1;
  }

  std::vector<Footprint> footprints_with(size_t changed, double radius_mm) const {
    std::vector<Footprint> footprints;
    for (size_t i = 0; i < patches.size(); ++i)
      footprints.push_back(i == changed ? footprint_of(patches[i], radius_mm) : patches[i].footprint);
    return footprints;
  }

  void differentiate() {
    sensitivity = solver->sensitivity();
    radius_derivatives.clear();
    for (size_t i = 0; i < patches.size(); ++i) {
      const auto of_radius = [&](double ratio) {
        return solver->sensitivity_with(footprints_with(i, patches[i].radius_mm * ratio));
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
    factorizations = solver->factorizations();
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
  return state_->patches.size();
}

void ContactModel::begin(const Vec3& place_mm, double radius_mm) {
  state_->patches.push_back({place_mm, radius_mm, {}});
  state_->rebuild();
}

void ContactModel::end(size_t contact) {
  state_->patches.erase(state_->patches.begin() + static_cast<std::ptrdiff_t>(contact));
  state_->solver->let_go(contact);
  state_->factorizations = -1;
}

void ContactModel::move(size_t contact, const Vec3& place_mm) {
  state_->patches.at(contact).place_mm = place_mm;
  state_->rebuild();
}

std::optional<Equilibrium> ContactModel::set_radius(size_t contact, double radius_mm, const std::vector<Vec3>& q_mm) {
  State& s = *state_;
  const Patch before = s.patches.at(contact);
  s.patches[contact] = {before.place_mm, radius_mm, s.footprint_of(before, radius_mm)};
  std::vector<Footprint> footprints;
  for (const Patch& patch : s.patches) footprints.push_back(patch.footprint);
  s.solver->replace(footprints);
  s.factorizations = -1;
  Equilibrium equilibrium = s.solver->solve_all(q_mm);
  if (equilibrium.converged) return equilibrium;
  s.hold_from_rest();
  equilibrium = s.solver->solve_all(q_mm);
  if (equilibrium.converged) return equilibrium;
  s.patches[contact] = before;
  s.hold_from_rest();
  s.solver->solve_all(q_mm);
  return std::nullopt;
}

Equilibrium ContactModel::solve(const std::vector<Vec3>& q_mm) {
  Equilibrium equilibrium = state_->solver->solve_all(q_mm);
  if (equilibrium.converged) return equilibrium;
  // The way from the last state may be closed where the way from rest is not.
  state_->hold_from_rest();
  return state_->solver->solve_all(q_mm);
}

ContactResponse ContactModel::respond(const Equilibrium& equilibrium, const std::vector<Vec3>& q_mm) {
  State& s = *state_;
  if (s.factorizations != s.solver->factorizations()) s.differentiate();
  ContactResponse response;
  response.equilibrium = equilibrium;
  response.motion = s.sensitivity.motion;
  response.force = s.sensitivity.force;
  const auto contacts = static_cast<Eigen::Index>(s.patches.size());
  Eigen::VectorXd q(3 * contacts);
  for (Eigen::Index i = 0; i < contacts; ++i) q.segment<3>(3 * i) = q_mm.at(static_cast<size_t>(i));
  response.motion_per_log_radius.resize(3 * s.model->node_count(), contacts);
  response.force_per_log_radius.resize(3 * contacts, contacts);
  for (Eigen::Index i = 0; i < contacts; ++i) {
    const RadiusDerivative& derivative = s.radius_derivatives[static_cast<size_t>(i)];
    response.motion_per_log_radius.col(i) = derivative.motion * q;
    response.force_per_log_radius.col(i) = derivative.force * q;
  }
  return response;
}

const Footprint& ContactModel::footprint(size_t contact) const {
  return state_->patches.at(contact).footprint;
}

double ContactModel::radius_mm(size_t contact) const {
  return state_->patches.at(contact).radius_mm;
}

double ContactModel::distance_to_attachments_mm(size_t contact) const {
  double nearest_mm = std::numeric_limits<double>::infinity();
  for (int node : state_->fixed_nodes)
    nearest_mm = std::min(nearest_mm,
                          (state_->model->rest_mm()[static_cast<size_t>(node)] - footprint(contact).center_mm).norm());
  return nearest_mm;
}

const TetModel& ContactModel::model() const {
  return *state_->model;
}

const std::vector<Triangle>& ContactModel::boundary() const {
  return state_->boundary;
}

int ContactModel::mesh_version() const {
  return state_->mesh_version;
}

}  // namespace palpate
