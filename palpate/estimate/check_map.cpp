#include "palpate/estimate/check_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "palpate/core/errors.h"
#include "palpate/core/quantile.h"

namespace palpate {

namespace {

/// A registration is good to a few millimetres; further off, the contact would meet another place of the organ.
constexpr double kFarthest_mm = 10;
/// Fewer vertices than this in view say nothing about the depth.
constexpr size_t kMinSeen = 5;

/// Depth of each vertex that looks at the camera minus the measured depth at its pixel, mm.
std::vector<double> depth_errors_mm(const Surface& body, const DisparityMap& disparity,
                                    const Rectification& rectification, const cv::Mat& organ_mask) {
  const std::vector<Vec3> normals = vertex_normals(body.vertices_mm, body.triangles);
  const cv::Rect image({0, 0}, disparity.disparity_px.size());
  std::vector<double> errors;
  for (size_t v = 0; v < normals.size(); ++v) {
    const Vec3& point = body.vertices_mm[v];
    if (point.z() <= 0 || normals[v].dot(point) >= 0) continue;
    const cv::Point pixel = project_to_rectified(rectification, point);
    if (!image.contains(pixel) || organ_mask.at<uchar>(pixel) == 0) continue;
    const float seen_px = disparity.disparity_px.at<float>(pixel);
    if (!(seen_px > 0)) continue;
    errors.push_back(point.z() - triangulate_pixel(rectification, pixel, seen_px).z());
  }
  return errors;
}

std::string extent(const Surface& body) {
  Vec3 min = Vec3::Constant(1e300), max = -min;
  for (const Vec3& v : body.vertices_mm) min = min.cwiseMin(v), max = max.cwiseMax(v);
  return fmt::format("x {:.4g}..{:.4g}, y {:.4g}..{:.4g}, z {:.4g}..{:.4g} mm", min.x(), max.x(), min.y(), max.y(),
                     min.z(), max.z());
}

}  // namespace

void require_body_where_seen(const Surface& body, const DisparityMap& disparity, const Rectification& rectification,
                             const cv::Mat& organ_mask, const std::filesystem::path& volume_file) {
  constexpr const char* kExpected = "expected the organ in the left camera frame (is volume_unit right?)";
  std::vector<double> errors = depth_errors_mm(body, disparity, rectification, organ_mask);
  if (errors.size() < kMinSeen)
    throw BadInput(fmt::format("map.volume: {} lies at {}, outside of the measured tissue, {}", volume_file.string(),
                               extent(body), kExpected));
  const auto middle = median_of(errors);
  if (std::abs(middle) > kFarthest_mm)
    throw BadInput(fmt::format("map.volume: {} lies {:.0f} mm {} the measured tissue (it is at {}), {}",
                               volume_file.string(), std::abs(middle), middle > 0 ? "behind" : "in front of",
                               extent(body), kExpected));
}

void require_every_piece_held(const TetMesh& mesh, const std::vector<int>& fixed_nodes) {
  std::vector<int> piece(mesh.nodes_mm.size());
  std::iota(piece.begin(), piece.end(), 0);
  const auto root = [&piece](int node) {
    while (piece[static_cast<size_t>(node)] != node) {
      int& parent = piece[static_cast<size_t>(node)];
      parent = piece[static_cast<size_t>(parent)];
      node = parent;
    }
    return node;
  };
  for (const Tetrahedron& t : mesh.tetrahedra)
    for (size_t k = 1; k < 4; ++k) piece[static_cast<size_t>(root(t[k]))] = root(t[0]);
  std::set<int> pieces, held;
  for (const Tetrahedron& t : mesh.tetrahedra) pieces.insert(root(t[0]));
  for (int node : fixed_nodes) held.insert(root(node));
  if (held.size() < pieces.size())
    throw BadInput(
        fmt::format("attachments: the body has {} separate pieces and only {} of them are held, expected "
                    "one piece, or attachments on each",
                    pieces.size(), held.size()));
}

}  // namespace palpate
