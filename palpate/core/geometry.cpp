#include "palpate/core/geometry.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

namespace palpate {

double signed_volume_mm3(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  return (b - a).cross(c - a).dot(d - a) / 6.0;
}

std::vector<Triangle> boundary_triangles(const TetMesh& mesh) {
  // Each face with its sorted nodes as key; a face seen twice is inside.
  struct Face {
    Triangle key;
    Triangle oriented;
  };
  std::vector<Face> faces;
  faces.reserve(mesh.tetrahedra.size() * 4);
  for (const Tetrahedron& t : mesh.tetrahedra) {
    const Triangle outwards[4] = {{t[1], t[2], t[3]}, {t[0], t[3], t[2]}, {t[0], t[1], t[3]}, {t[0], t[2], t[1]}};
    for (const Triangle& face : outwards) {
      Triangle key = face;
      std::sort(key.begin(), key.end());
      faces.push_back({key, face});
    }
  }
  std::stable_sort(faces.begin(), faces.end(), [](const Face& a, const Face& b) { return a.key < b.key; });
  std::vector<Triangle> boundary;
  for (size_t i = 0; i < faces.size();) {
    size_t next = i + 1;
    while (next < faces.size() && faces[next].key == faces[i].key) ++next;
    if (next - i == 1) boundary.push_back(faces[i].oriented);
    i = next;
  }
  return boundary;
}

std::vector<Vec3> vertex_normals(const std::vector<Vec3>& vertices, const std::vector<Triangle>& triangles) {
  std::vector<Vec3> normals(vertices.size(), Vec3::Zero());
  for (const Triangle& t : triangles) {
    const Vec3& a = vertices[static_cast<size_t>(t[0])];
    const Vec3 doubled_area = (vertices[static_cast<size_t>(t[1])] - a).cross(vertices[static_cast<size_t>(t[2])] - a);
    for (int corner : t) normals[static_cast<size_t>(corner)] += doubled_area;
  }
  for (Vec3& normal : normals) {
    const double length = normal.norm();
    if (length > 0) normal /= length;
  }
  return normals;
}

Surface without_unused_vertices(const Surface& surface) {
  std::vector<int> new_number(surface.vertices_mm.size(), -1);
  for (const Triangle& t : surface.triangles)
    for (int corner : t) new_number[static_cast<size_t>(corner)] = 0;
  Surface used;
  for (size_t i = 0; i < new_number.size(); ++i) {
    if (new_number[i] < 0) continue;
    new_number[i] = static_cast<int>(used.vertices_mm.size());
    used.vertices_mm.push_back(surface.vertices_mm[i]);
  }
  for (const Triangle& t : surface.triangles)
    used.triangles.push_back({new_number[static_cast<size_t>(t[0])], new_number[static_cast<size_t>(t[1])],
                              new_number[static_cast<size_t>(t[2])]});
  return used;
}

ClosestPoint closest_point_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap), d3 = ab.dot(bp), d4 = ac.dot(bp), d5 = ab.dot(cp), d6 = ac.dot(cp);
  const double va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
  ClosestPoint found;
  if (d1 <= 0 && d2 <= 0) {
    found.barycentric = {1, 0, 0};
  } else if (d3 >= 0 && d4 <= d3) {
    found.barycentric = {0, 1, 0};
  } else if (d6 >= 0 && d5 <= d6) {
    found.barycentric = {0, 0, 1};
  } else if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    const double t = d1 / (d1 - d3);
    found.barycentric = {1 - t, t, 0};
  } else if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    const double t = d2 / (d2 - d6);
    found.barycentric = {1 - t, 0, t};
  } else if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    found.barycentric = {0, 1 - t, t};
  } else {
    const double sum = va + vb + vc;
    found.barycentric = {va / sum, vb / sum, vc / sum};
  }
  found.point = found.barycentric[0] * a + found.barycentric[1] * b + found.barycentric[2] * c;
  found.distance = (p - found.point).norm();
  return found;
}

ClosestPoint closest_point(const Vec3& point, const std::vector<Vec3>& vertices,
                           const std::vector<Triangle>& triangles) {
  ClosestPoint nearest;
  nearest.distance = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < triangles.size(); ++i) {
    const Triangle& t = triangles[i];
    ClosestPoint candidate =
        closest_point_on_triangle(point, vertices[static_cast<size_t>(t[0])], vertices[static_cast<size_t>(t[1])],
                                  vertices[static_cast<size_t>(t[2])]);
    if (candidate.distance < nearest.distance) {
      nearest = candidate;
      nearest.triangle = static_cast<int>(i);
    }
  }
  return nearest;
}

}  // namespace palpate
