#include "palpate/volume/fit_boundary.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <optional>

#include "palpate/volume/mesh_quality.h"

namespace palpate {

namespace {

constexpr int kRounds = 4;
constexpr int kHalvings = 12;
// In edge lengths: chords of a smooth surface are less than this away from it; what is farther off is a sharp rim.
constexpr double kReach = 0.2;
constexpr double kLargestMove = 0.15;

/// Way from `q` along `outwards` to the surface of the body (negative: back), within `reach`.
std::optional<double> gap(const InsideTest& inside, const Vec3& q, const Vec3& outwards, double reach) {
  const bool starts_inside = inside(q);
  const double side = starts_inside ? 1 : -1;
  if (inside(q + side * reach * outwards) == starts_inside) return std::nullopt;
  double near = 0, far = reach;
  for (int i = 0; i < kHalvings; ++i) {
    const double t = (near + far) / 2;
    (inside(q + side * t * outwards) == starts_inside ? near : far) = t;
  }
  return side * (near + far) / 2;
}

double dihedral_deg(const std::vector<Vec3>& nodes, const Tetrahedron& t) {
  return smallest_dihedral_deg(nodes[static_cast<size_t>(t[0])], nodes[static_cast<size_t>(t[1])],
                               nodes[static_cast<size_t>(t[2])], nodes[static_cast<size_t>(t[3])]);
}

/// Takes back moves, by halves and then wholly, at elements that they would spoil.
void apply(TetMesh& mesh, std::vector<Vec3> moved, double min_dihedral_deg) {
  const std::vector<Vec3> rest = mesh.nodes_mm;
  for (bool is_spoilt = true; is_spoilt;) {
    is_spoilt = false;
    std::vector<char> retreats(moved.size(), 0);
    for (const Tetrahedron& t : mesh.tetrahedra) {
      const bool has_moved = std::any_of(
          t.begin(), t.end(), [&](int n) { return moved[static_cast<size_t>(n)] != rest[static_cast<size_t>(n)]; });
      if (!has_moved) continue;
      const double before = dihedral_deg(rest, t);
      if (dihedral_deg(moved, t) >= std::min(before, min_dihedral_deg)) continue;
      for (int n : t) retreats[static_cast<size_t>(n)] = 1;
      is_spoilt = true;
    }
    for (size_t i = 0; i < moved.size(); ++i) {
      if (!retreats[i]) continue;
      const Vec3 half = (moved[i] - rest[i]) / 2;
      moved[i] = half.norm() < 1e-3 ? rest[i] : Vec3(rest[i] + half);
    }
  }
  mesh.nodes_mm = std::move(moved);
}

}  // namespace

void fit_boundary(TetMesh& mesh, const InsideTest& inside, double min_dihedral_deg) {
  const std::vector<Triangle> boundary = boundary_triangles(mesh);
  std::vector<Vec3> moved = mesh.nodes_mm;
  std::vector<double> edge(moved.size(), 1e300);  // shortest one on the boundary
  for (const Triangle& t : boundary)
    for (size_t k = 0; k < 3; ++k) {
      const auto a = static_cast<size_t>(t[k]), b = static_cast<size_t>(t[(k + 1) % 3]);
      const double length = (moved[a] - moved[b]).norm();
      edge[a] = std::min(edge[a], length);
      edge[b] = std::min(edge[b], length);
    }
  const std::vector<Vec3> normals = vertex_normals(moved, boundary);
  for (int round = 0; round < kRounds; ++round) {
    std::vector<double> pull(moved.size(), 0), weight(moved.size(), 0);
    for (const Triangle& t : boundary) {
      const Vec3 &a = moved[static_cast<size_t>(t[0])], &b = moved[static_cast<size_t>(t[1])],
                 &c = moved[static_cast<size_t>(t[2])];
      const Vec3 doubled_area = (b - a).cross(c - a), outwards = doubled_area.normalized();
      const double reach = kReach * std::sqrt(doubled_area.norm());
      for (size_t corner = 0; corner < 3; ++corner) {
        Vec3 barycentric = Vec3::Constant(1.0 / 6);
        barycentric[static_cast<Eigen::Index>(corner)] = 2.0 / 3;
        const Vec3 q = barycentric[0] * a + barycentric[1] * b + barycentric[2] * c;
        const std::optional<double> distance = gap(inside, q, outwards, reach);
        if (!distance) continue;
        for (size_t k = 0; k < 3; ++k) {
          const double fraction = barycentric[static_cast<Eigen::Index>(k)] * doubled_area.norm();
          pull[static_cast<size_t>(t[k])] += fraction * *distance;
          weight[static_cast<size_t>(t[k])] += fraction;
        }
      }
    }
    for (size_t i = 0; i < moved.size(); ++i) {
      if (weight[i] <= 0) continue;
      const double max = kLargestMove * edge[i];
      const double so_far = (moved[i] - mesh.nodes_mm[i]).dot(normals[i]);
      moved[i] = mesh.nodes_mm[i] + std::clamp(so_far + pull[i] / weight[i], -max, max) * normals[i];
    }
  }
  apply(mesh, std::move(moved), min_dihedral_deg);
}

}  // namespace palpate
