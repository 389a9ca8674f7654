#pragma once

#include <functional>

#include "palpate/contact/footprint.h"
#include "palpate/simulate/simulate_options.h"
#include "palpate/volume/attachments.h"
#include "palpate/volume/tetrahedralize.h"

namespace palpate {

/// Where an instrument will hold a body, at rest.
struct TruthContact {
  Vec3 point_mm = Vec3::Zero();
  Vec3 normal = Vec3::UnitZ();  ///< outward
  double radius_mm = 0;         ///< of the patch
  double drag_mm = 0;           ///< how far it is dragged over the surface
  SimulatedTruth::Patch shape = SimulatedTruth::Patch::disc;
  Vec3 along = Vec3::UnitX();  ///< tangent: long axis of an ellipse, from jaw to jaw
};

/// What an instrument holds of a body.
struct TruthPatch {
  Footprint footprint;   ///< every surface node of the patch, tied to one displacement, or a mean of them
  double radius_mm = 0;  ///< of a disc with the area that the tied nodes move along
};

/// By how much a patch is moved in a state u (mm, three entries per node).
Vec3 patch_moved_mm(const TruthPatch& patch, const Eigen::VectorXd& u);

/// The body whose forces count as true: finer than the estimator's map and cut differently.
struct TruthBody {
  TetMesh mesh;
  std::vector<Triangle> boundary;
  std::vector<int> fixed_nodes;
  std::vector<TruthPatch> patches;  ///< one for each contact
};

/// Fills the closed organ with about `elements` tetrahedra, finer around each of `contacts` (at least one), so that the
/// patch is well sampled, also where it is dragged to. `project_px` as in select_attachments. Throws BadInput when the
/// body cannot be filled, when attachments select nothing or everything, or when a patch lies on attached tissue.
TruthBody make_truth_body(const Surface& organ, int elements, const AttachmentOptions& attachments,
                          const std::function<cv::Point2d(const Vec3&)>& project_px,
                          const std::vector<TruthContact>& contacts);

/// A fine surface that rides on the boundary of a mesh: each point moves like the nearest point of the boundary.
struct Skin {
  std::vector<Triangle> nodes;
  std::vector<Vec3> barycentric;
};

Skin attach_skin(const std::vector<Vec3>& points_mm, const std::vector<Vec3>& nodes_mm,
                 const std::vector<Triangle>& boundary);

/// The points of the skin after the nodes have moved by u (mm, three entries per node).
std::vector<Vec3> moved_skin(const Skin& skin, const std::vector<Vec3>& points_mm, const Eigen::VectorXd& u);

}  // namespace palpate
