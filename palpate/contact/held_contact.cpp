#include "palpate/contact/held_contact.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate {

namespace {
/// Slip corrections per frame: each brings the tangential force back to the cone, the next one mends the nonlinearity.
constexpr int kSlipCorrections = 3;
constexpr double kConeTolerance = 1.02;
/// The force of a frame is wanted to a per mille; the tip is not known better.
constexpr double kFrameResidual = 1e-4;
}  // namespace

struct HeldContact::State {
  std::vector<Triangle> boundary;
  TetModel model;
  Footprint footprint;
  EquilibriumSolver solver;
  ContactOptions options;
  Vec3 slip_mm = Vec3::Zero();  // tangential path that the tip has slid over the tissue
  bool near_attachment = false;

  State(const TetMesh& mesh, const std::vector<int>& fixed, const TissueOptions& tissue, const Vec3& touch_mm,
        const ContactOptions& o, Element element)
      : boundary(boundary_triangles(mesh)),
        model(mesh, tissue, fixed, element),
        footprint(make_footprint(model, boundary, touch_mm, o.footprint_radius_mm)),
        solver(model, EquilibriumOptions{.relative_residual = kFrameResidual}),
        options(o) {
    solver.hold(footprint);
    double nearest_mm = std::numeric_limits<double>::infinity();
    for (int node : fixed)
      nearest_mm = std::min(nearest_mm, (mesh.nodes_mm[static_cast<size_t>(node)] - footprint.center_mm).norm());
    near_attachment = nearest_mm < 2 * o.footprint_radius_mm;
  }

  Answer push(const Vec3& displacement_mm) {
    Answer answer;
    for (int correction = 0; correction <= kSlipCorrections; ++correction) {
      answer.equilibrium = solver.solve(displacement_mm - slip_mm);
      if (!answer.equilibrium.converged) return answer;
      const Vec3& force = answer.equilibrium.force_N;
      const double normal_N = -force.dot(footprint.normal);
      if (normal_N < 0) {
        answer.let_go = true;
        return answer;
      }
      const Vec3 tangential = force + normal_N * footprint.normal;
      const double largest_N = options.friction * normal_N;
      if (tangential.norm() <= kConeTolerance * largest_N || correction == kSlipCorrections) return answer;
      answer.slid = true;
      const Vec3 tied = displacement_mm - slip_mm;
      const Vec3 tied_tangential = tied - tied.dot(footprint.normal) * footprint.normal;
      slip_mm += (1 - largest_N / tangential.norm()) * tied_tangential;
    }
    return answer;
  }
};

HeldContact::HeldContact(const TetMesh& mesh, const std::vector<int>& fixed_nodes, const TissueOptions& tissue,
                         const Vec3& touch_mm, const ContactOptions& options, Element element)
    : state_(std::make_unique<State>(mesh, fixed_nodes, tissue, touch_mm, options, element)) {}
HeldContact::~HeldContact() = default;
HeldContact::HeldContact(HeldContact&&) noexcept = default;

HeldContact::Answer HeldContact::move(const Vec3& displacement_mm) {
  if (state_->options.grip == Grip::push) return state_->push(displacement_mm);
  Answer answer;
  answer.equilibrium = state_->solver.solve(displacement_mm);
  return answer;
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
