#include "palpate/contact/touched_body.h"

#include <algorithm>
#include <limits>

namespace palpate {

namespace {
/// The force of a frame is wanted to a per mille; the tip is not known better.
constexpr double kFrameResidual = 1e-4;

struct Tip {
  bool ended = false;
  Vec3 place_mm = Vec3::Zero();
  Footprint footprint;
  Vec3 displaced_at_begin_mm = Vec3::Zero();
  Vec3 displacement_mm = Vec3::Zero();
  Vec3 held_from_mm = Vec3::Zero();  // displacement that the solver counts from
};
}  // namespace

struct TouchedBody::State {
  MeshAround mesh_around;
  TissueOptions tissue;
  Element element;
  double radius_mm;

  std::vector<int> fixed_nodes;
  std::vector<Triangle> boundary;
  std::unique_ptr<TetModel> model;
  std::unique_ptr<EquilibriumSolver> solver;
  std::vector<Tip> tips;  // by number
  std::vector<int> held;  // numbers of those that the solver holds, in its order

  Tip& at(int number) { return tips.at(static_cast<size_t>(number)); }

  /// A mesh for the places as they are now; what is held stays displaced as it is.
  void rebuild() {
    std::vector<Vec3> places;
    for (const Tip& tip : tips)
      if (!tip.ended) places.push_back(tip.place_mm);
    AttachedMesh attached = mesh_around(places);
    boundary = boundary_triangles(attached.mesh);
    solver.reset();
    model = std::make_unique<TetModel>(attached.mesh, tissue, attached.fixed_nodes, element);
    fixed_nodes = std::move(attached.fixed_nodes);
    solver = std::make_unique<EquilibriumSolver>(*model, EquilibriumOptions{.relative_residual = kFrameResidual});
    for (Tip& tip : tips)
      if (!tip.ended) tip.footprint = make_footprint(*model, boundary, tip.place_mm, radius_mm);
    hold_from_rest();
  }

  void hold_from_rest() {
    solver->release();
    for (int number : held) {
      at(number).held_from_mm.setZero();
      solver->hold_also(at(number).footprint);
    }
  }

  Equilibrium solve() {
    std::vector<Vec3> displacements_mm;
    for (int number : held) displacements_mm.push_back(at(number).displacement_mm - at(number).held_from_mm);
    Equilibrium answer = solver->solve_all(displacements_mm);
    std::vector<ContactForce> by_number(tips.size());
    for (size_t i = 0; i < answer.contacts.size(); ++i) by_number[static_cast<size_t>(held[i])] = answer.contacts[i];
    answer.contacts = std::move(by_number);
    return answer;
  }

  bool is_held(int number) const { return std::find(held.begin(), held.end(), number) != held.end(); }

  void let_go(int number) {
    const auto found = std::find(held.begin(), held.end(), number);
    if (found == held.end()) return;
    solver->let_go(static_cast<size_t>(found - held.begin()));
    held.erase(found);
  }
};

TouchedBody::TouchedBody(MeshAround mesh_around, const TissueOptions& tissue, Element element,
                         double footprint_radius_mm)
    : state_(std::make_unique<State>()) {
  state_->mesh_around = std::move(mesh_around);
  state_->tissue = tissue;
  state_->element = element;
  state_->radius_mm = footprint_radius_mm;
}
TouchedBody::~TouchedBody() = default;
TouchedBody::TouchedBody(TouchedBody&&) noexcept = default;

int TouchedBody::begin(const Vec3& place_mm) {
  State& s = *state_;
  const int number = static_cast<int>(s.tips.size());
  s.tips.emplace_back();
  s.at(number).place_mm = place_mm;
  s.rebuild();
  Tip& tip = s.at(number);
  if (!s.held.empty()) {
    const Equilibrium before = s.solve();
    const Eigen::VectorXd means = constraint_matrix(*s.model, tip.footprint) * s.model->reduce(before.u);
    tip.displaced_at_begin_mm = Eigen::Map<const Eigen::Matrix3Xd>(means.data(), 3, means.size() / 3).rowwise().mean();
  }
  tip.displacement_mm = tip.held_from_mm = tip.displaced_at_begin_mm;
  s.solver->hold_also(tip.footprint);
  s.held.push_back(number);
  return number;
}

void TouchedBody::move_footprint(int tip, const Vec3& place_mm) {
  state_->at(tip).place_mm = place_mm;
  state_->at(tip).displacement_mm.setZero();
  state_->rebuild();
}

void TouchedBody::end(int tip) {
  state_->let_go(tip);
  state_->at(tip).ended = true;
}

Equilibrium TouchedBody::solve(int tip, const Vec3& displacement_mm) {
  State& s = *state_;
  if (!s.is_held(tip)) {
    s.held.push_back(tip);
    s.hold_from_rest();
  }
  s.at(tip).displacement_mm = displacement_mm;
  Equilibrium answer = s.solve();
  const ContactForce& own = answer.contacts[static_cast<size_t>(tip)];
  answer.force_N = own.force_N;
  answer.mean_nodal_force_N = own.mean_nodal_force_N;
  return answer;
}

Equilibrium TouchedBody::solve_without(int tip) {
  State& s = *state_;
  Equilibrium answer;
  if (s.held == std::vector<int>{tip} || s.held.empty()) {
    answer.converged = true;
    answer.u = Eigen::VectorXd::Zero(3 * s.model->node_count());
    answer.contacts.resize(s.tips.size());
    return answer;
  }
  s.let_go(tip);
  answer = s.solve();
  answer.force_N.setZero();
  answer.mean_nodal_force_N = 0;
  return answer;
}

const Footprint& TouchedBody::footprint(int tip) const {
  return state_->at(tip).footprint;
}

const Vec3& TouchedBody::displaced_at_begin_mm(int tip) const {
  return state_->at(tip).displaced_at_begin_mm;
}

double TouchedBody::distance_to_attachments_mm(int tip) const {
  double nearest_mm = std::numeric_limits<double>::infinity();
  for (int node : state_->fixed_nodes)
    nearest_mm = std::min(
        nearest_mm, (state_->model->rest_mm()[static_cast<size_t>(node)] - state_->at(tip).footprint.center_mm).norm());
  return nearest_mm;
}

const TetModel& TouchedBody::model() const {
  return *state_->model;
}

const std::vector<Triangle>& TouchedBody::boundary() const {
  return state_->boundary;
}

}  // namespace palpate
