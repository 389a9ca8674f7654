#include "palpate/simulate/truth_body.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "palpate/core/errors.h"

namespace palpate {
namespace {

const double kFocusRadii = 1.5;        // the mesh is finer within so many radii of the patch
const double kFocusEdgeRatio = 0.25;   // of edges there to edges elsewhere
const double kFurtherEdgeRadii = 0.5;  // longest edges around further patches, in radii

const Vec3& at(const std::vector<Vec3>& values, int i) {
  return values[static_cast<size_t>(i)];
}

const double kEllipseStretch = std::numbers::sqrt2;   // semi-axes 1:2 with the area of the disc
const double kJawRadius = 0.6, kJawFromMiddle = 0.8;  // in radii of the patch
const double kRimBegins = 0.5, kRimEnds = 1.3;        // in radii of the patch

// How much a point of the patch is moved with it, 0 .. 1; `at` in radii of the patch, its long axis first.
double held_at(SimulatedTruth::Patch shape, const Eigen::Vector2d& at) {
  using Patch = SimulatedTruth::Patch;
  switch (shape) {
    case Patch::disc:
      return at.norm() <= 1;
    case Patch::ellipse:
      return Eigen::Vector2d(at.x() / kEllipseStretch, at.y() * kEllipseStretch).norm() <= 1;
    case Patch::two_jaws:
      return Eigen::Vector2d(std::abs(at.x()) - kJawFromMiddle, at.y()).norm() <= kJawRadius;
    case Patch::soft_rim: {
      const double beyond = std::clamp((at.norm() - kRimBegins) / (kRimEnds - kRimBegins), 0.0, 1.0);
      return 0.5 * (1 + std::cos(std::numbers::pi * beyond));
    }
  }
  return 0;
}

// Surface nodes that the contact holds, along its tangent plane and on its side of the body, and how much.
std::map<int, double> held_nodes(const TruthBody& body, const TruthContact& contact) {
  const std::vector<Vec3> normals = vertex_normals(body.mesh.nodes_mm, body.boundary);
  const Vec3 across = contact.normal.cross(contact.along);
  std::map<int, double> held;
  for (int i = 0; i < static_cast<int>(normals.size()); ++i) {
    if (at(normals, i).dot(contact.normal) < 0.3) continue;
    const Vec3 offset = (at(body.mesh.nodes_mm, i) - contact.point_mm) / contact.radius_mm;
    if (std::abs(offset.dot(contact.normal)) >= 1) continue;
    const double weight = held_at(contact.shape, {offset.dot(contact.along), offset.dot(across)});
    if (weight > 0) held[i] = weight;
  }
  return held;
}

// Integral over the surface of how much each point moves with the held nodes, by node.
std::map<int, double> areas_moved_mm2(const TruthBody& body, const std::map<int, double>& held) {
  std::map<int, double> areas;
  for (const auto& [a, b, c] : body.boundary) {
    const Vec3& pa = at(body.mesh.nodes_mm, a);
    const double whole = 0.5 * (at(body.mesh.nodes_mm, b) - pa).cross(at(body.mesh.nodes_mm, c) - pa).norm();
    for (int node : {a, b, c})
      if (const auto found = held.find(node); found != held.end()) areas[node] += found->second * whole / 3;
  }
  return areas;
}

TruthPatch patch_of(const TruthBody& body, const TruthContact& contact) {
  const std::map<int, double> held = held_nodes(body, contact);
  for (const auto& [node, weight] : held)
    if (std::binary_search(body.fixed_nodes.begin(), body.fixed_nodes.end(), node))
      throw BadInput("simulate.gesture: the instrument touches attached tissue; at_px has to lie outside attachments");
  if (held.empty())
    throw BadInput(
        fmt::format("simulate.gesture: footprint_radius_mm {} holds no node of the true body", contact.radius_mm));
  TruthPatch patch;
  Eigen::RowVectorXd areas(static_cast<Eigen::Index>(held.size()));
  for (const auto& [node, area] : areas_moved_mm2(body, held)) {
    areas[static_cast<Eigen::Index>(patch.footprint.samples.size())] = area;
    patch.footprint.samples.push_back({{node, node, node}, Vec3::UnitX()});
  }
  if (contact.shape == SimulatedTruth::Patch::soft_rim) patch.footprint.means = areas / areas.sum();
  patch.footprint.center_mm = contact.point_mm;
  patch.footprint.normal = contact.normal;
  patch.radius_mm = std::sqrt(areas.sum() / std::numbers::pi);
  return patch;
}

}  // namespace

TruthBody make_truth_body(const Surface& organ, int elements, const AttachmentOptions& attachments,
                          const std::function<cv::Point2d(const Vec3&)>& project_px,
                          const std::vector<TruthContact>& contacts) {
  TruthBody body;
  const TruthContact& first = contacts.at(0);
  const auto reach_mm = [](const TruthContact& contact) { return kFocusRadii * contact.radius_mm + contact.drag_mm; };
  body.mesh = tetrahedralize(organ, elements, MeshFocus{first.point_mm, reach_mm(first), kFocusEdgeRatio});
  for (size_t i = 1; i < contacts.size(); ++i)
    body.mesh =
        refine_near(body.mesh, contacts[i].point_mm, reach_mm(contacts[i]), kFurtherEdgeRadii * contacts[i].radius_mm);
  body.boundary = boundary_triangles(body.mesh);
  body.fixed_nodes = select_attachments(body.mesh, attachments, project_px);
  for (const TruthContact& contact : contacts) body.patches.push_back(patch_of(body, contact));
  return body;
}

Vec3 patch_moved_mm(const TruthPatch& patch, const Eigen::VectorXd& u) {
  const auto& samples = patch.footprint.samples;
  const Eigen::MatrixXd& means = patch.footprint.means;
  Vec3 mean = Vec3::Zero();
  for (size_t i = 0; i < samples.size(); ++i)
    mean += (means.size() > 0 ? means(0, static_cast<Eigen::Index>(i)) : 1.0 / static_cast<double>(samples.size())) *
            u.segment<3>(3 * samples[i].nodes[0]);
  return mean;
}

Skin attach_skin(const std::vector<Vec3>& points_mm, const std::vector<Vec3>& nodes_mm,
                 const std::vector<Triangle>& boundary) {
  // A ball around each triangle rules most of them out.
  std::vector<Vec3> center;
  std::vector<double> reach;
  for (const auto& [a, b, c] : boundary) {
    const Vec3 middle = (at(nodes_mm, a) + at(nodes_mm, b) + at(nodes_mm, c)) / 3;
    center.push_back(middle);
    reach.push_back(std::max(
        {(at(nodes_mm, a) - middle).norm(), (at(nodes_mm, b) - middle).norm(), (at(nodes_mm, c) - middle).norm()}));
  }
  Skin skin;
  skin.nodes.resize(points_mm.size());
  skin.barycentric.resize(points_mm.size());
  tbb::parallel_for(size_t{0}, points_mm.size(), [&](size_t i) {
    double nearest = std::numeric_limits<double>::infinity();
    for (size_t t = 0; t < boundary.size(); ++t) {
      if ((center[t] - points_mm[i]).norm() - reach[t] >= nearest) continue;
      const auto& [a, b, c] = boundary[t];
      const ClosestPoint found =
          closest_point_on_triangle(points_mm[i], at(nodes_mm, a), at(nodes_mm, b), at(nodes_mm, c));
      if (found.distance >= nearest) continue;
      nearest = found.distance;
      skin.nodes[i] = boundary[t];
      skin.barycentric[i] = found.barycentric;
    }
  });
  return skin;
}

std::vector<Vec3> moved_skin(const Skin& skin, const std::vector<Vec3>& points_mm, const Eigen::VectorXd& u) {
  std::vector<Vec3> moved = points_mm;
  for (size_t i = 0; i < moved.size(); ++i)
    for (int k = 0; k < 3; ++k)
      moved[i] += skin.barycentric[i][k] * u.segment<3>(3 * skin.nodes[i][static_cast<size_t>(k)]);
  return moved;
}

}  // namespace palpate
