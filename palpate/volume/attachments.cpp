#include "palpate/volume/attachments.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>
#include <opencv2/imgproc.hpp>

#include "palpate/core/errors.h"

namespace palpate {

namespace {

using Kind = AttachmentRegion::Kind;

constexpr double kLooksAway = 0.5;  // cosine between outward normal and viewing ray of the underside: 60 degrees

/// Nodes within the depth of boundary faces that look away from the camera.
void select_underside(const TetMesh& mesh, double depth_mm, std::vector<char>& selected) {
  struct Face {
    std::array<Vec3, 3> corners;
    Vec3 min, max;
  };
  std::vector<Face> underside;
  for (const Triangle& t : boundary_triangles(mesh)) {
    const auto corner = [&](size_t k) -> const Vec3& { return mesh.nodes_mm[static_cast<size_t>(t[k])]; };
    const Vec3 &a = corner(0), &b = corner(1), &c = corner(2);
    const Vec3 normal = (b - a).cross(c - a).normalized(), ray = (a + b + c).normalized();
    if (normal.dot(ray) > kLooksAway)
      underside.push_back({{a, b, c},
                           a.cwiseMin(b).cwiseMin(c) - Vec3::Constant(depth_mm),
                           a.cwiseMax(b).cwiseMax(c) + Vec3::Constant(depth_mm)});
  }
  for (size_t i = 0; i < mesh.nodes_mm.size(); ++i) {
    const Vec3& p = mesh.nodes_mm[i];
    selected[i] |= std::any_of(underside.begin(), underside.end(), [&](const Face& face) {
      return (p.array() >= face.min.array()).all() && (p.array() <= face.max.array()).all() &&
             closest_point_on_triangle(p, face.corners[0], face.corners[1], face.corners[2]).distance <= depth_mm;
    });
  }
}

bool contains(const AttachmentRegion& region, const Vec3& p) {
  switch (region.kind) {
    case Kind::box:
      return (p.array() >= region.min_mm.array()).all() && (p.array() <= region.max_mm.array()).all();
    case Kind::oriented_box:
      return ((region.axes * (p - region.center_mm)).cwiseAbs().array() <= region.half_size_mm.array()).all();
    case Kind::sphere:
      return (p - region.center_mm).norm() <= region.radius_mm;
    default:
      return false;
  }
}

bool is_behind(const std::vector<cv::Point2f>& polygon_px, const Vec3& p,
               const std::function<cv::Point2d(const Vec3&)>& project_px) {
  return p.z() > 0 && cv::pointPolygonTest(polygon_px, cv::Point2f(project_px(p)), false) >= 0;
}

/// Which groups of one item stand in the file; `none` before reading, the region's kind before writing.
struct Presence {
  explicit Presence(Kind kind)
      : underside(kind == Kind::underside),
        box(kind == Kind::box),
        oriented_box(kind == Kind::oriented_box),
        sphere(kind == Kind::sphere) {}
  bool underside, box, oriented_box, sphere;
};

void check_region(const Presence& present, AttachmentRegion& region) {
  const int kinds =
      present.underside + present.box + present.oriented_box + present.sphere + !region.polygon_px.empty();
  if (kinds != 1)
    throw BadInput(
        fmt::format("names {} regions, expected exactly one of: underside, box, oriented_box, sphere, "
                    "polygon_px (write one item per region)",
                    kinds));
  region.kind = present.underside      ? Kind::underside
                : present.box          ? Kind::box
                : present.oriented_box ? Kind::oriented_box
                : present.sphere       ? Kind::sphere
                                       : Kind::polygon;
  if (region.kind == Kind::box && !(region.min_mm.array() < region.max_mm.array()).all())
    throw BadInput(fmt::format("box: min_mm [{}, {}, {}] is not below max_mm [{}, {}, {}]", region.min_mm.x(),
                               region.min_mm.y(), region.min_mm.z(), region.max_mm.x(), region.max_mm.y(),
                               region.max_mm.z()));
  constexpr double kRounding = 0.01;
  if (!(region.axes * region.axes.transpose()).isIdentity(kRounding))
    throw BadInput("oriented_box: the rows of axes are not three unit vectors at right angles");
}

void describe_region(Settings& item, AttachmentRegion& region) {
  const auto present = std::make_shared<Presence>(region.kind);
  const Range positive{0, 1000, true};
  const Range anywhere{-1e4, 1e4};
  item.group(
      "underside", "nodes near the faces that look away from the camera",
      [&region, positive](Settings& group) { group.number("depth_mm", region.depth_mm, positive, "how near"); },
      &present->underside);
  item.group(
      "box", "nodes in a box along the axes of the left camera",
      [&region, anywhere](Settings& group) {
        group.vector3("min_mm", region.min_mm, anywhere, "least corner");
        group.vector3("max_mm", region.max_mm, anywhere, "most corner");
        group.require("min_mm");
        group.require("max_mm");
      },
      &present->box);
  item.group(
      "oriented_box", "nodes in a turned box",
      [&region, positive, anywhere](Settings& group) {
        group.vector3("center_mm", region.center_mm, anywhere, "middle");
        group.vector3("half_size_mm", region.half_size_mm, positive, "half edge lengths along the box's axes");
        group.matrix3("axes", region.axes, "rows = the box's unit axes in the left camera frame");
        group.require("center_mm");
        group.require("half_size_mm");
      },
      &present->oriented_box);
  item.group(
      "sphere", "nodes in a sphere",
      [&region, positive, anywhere](Settings& group) {
        group.vector3("center_mm", region.center_mm, anywhere, "middle");
        group.number("radius_mm", region.radius_mm, positive, "radius");
        group.require("center_mm");
        group.require("radius_mm");
      },
      &present->sphere);
  item.polygon("polygon_px", region.polygon_px,
               "nodes behind this part of the left image as recorded, through the whole depth");
  item.after_reading([present, &region] { check_region(*present, region); });
}

}  // namespace

void describe(Settings& scene, AttachmentOptions& options) {
  scene.list(
      "attachments", "where the tissue is held: the union of these regions",
      [&options] { return static_cast<int>(options.regions.size()); },
      [&options](int count) {
        AttachmentRegion unread;
        unread.kind = Kind::none;
        options.regions.assign(static_cast<size_t>(count), unread);
      },
      [&options](Settings& item, int i) { describe_region(item, options.regions[static_cast<size_t>(i)]); });
}

std::vector<int> select_attachments(const TetMesh& mesh, const AttachmentOptions& options,
                                    const std::function<cv::Point2d(const Vec3&)>& project_px) {
  std::vector<char> selected(mesh.nodes_mm.size(), 0);
  for (const AttachmentRegion& region : options.regions) {
    if (region.kind == Kind::underside) {
      select_underside(mesh, region.depth_mm, selected);
      continue;
    }
    const std::vector<cv::Point2f> corners(region.polygon_px.begin(), region.polygon_px.end());
    for (size_t i = 0; i < selected.size(); ++i)
      selected[i] |= region.kind == Kind::polygon ? is_behind(corners, mesh.nodes_mm[i], project_px)
                                                  : contains(region, mesh.nodes_mm[i]);
  }
  std::vector<int> nodes;
  for (size_t i = 0; i < selected.size(); ++i)
    if (selected[i]) nodes.push_back(static_cast<int>(i));
  if (nodes.empty() || nodes.size() == mesh.nodes_mm.size()) {
    Vec3 min = Vec3::Constant(1e300), max = -min;
    for (const Vec3& node : mesh.nodes_mm) min = min.cwiseMin(node), max = max.cwiseMax(node);
    throw BadInput(fmt::format(
        "attachments: {} of {} nodes selected, expected some but not all; the tissue lies in x {:.1f}..{:.1f}, y "
        "{:.1f}..{:.1f}, z {:.1f}..{:.1f} mm of the left camera frame",
        nodes.size(), mesh.nodes_mm.size(), min.x(), max.x(), min.y(), max.y(), min.z(), max.z()));
  }
  return nodes;
}

}  // namespace palpate
