#pragma once

#include <Eigen/Core>
#include <array>
#include <opencv2/core.hpp>
#include <vector>

/// The values that flow from stage to stage. Lengths in mm, left camera frame (OpenCV: x right, y down, z forward, the
/// axes of the calibrated left camera), unless a name says otherwise.
namespace palpate {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using Triangle = std::array<int, 3>;
using Tetrahedron = std::array<int, 4>;

/// Both images of one moment, as recorded (8-bit BGR, same size).
struct StereoFrame {
  int index = 0;
  double time_s = 0;
  cv::Mat left;
  cv::Mat right;
};

/// S of the paper: scattered points of the tissue surface. All vectors have the same length.
struct PointCloud {
  std::vector<Vec3> position_mm;
  std::vector<float> depth_deviation_mm;  ///< one standard deviation along the viewing ray
  std::vector<float> correlation;         ///< ZNCC of the match, -1..1
  std::vector<cv::Vec3b> colour;          ///< BGR of the left image

  size_t size() const { return position_mm.size(); }
};

/// S* of the paper, or any triangle mesh. Seen from outside, triangles run counter-clockwise (normals point outwards;
/// for a visible surface: towards the camera).
struct Surface {
  std::vector<Vec3> vertices_mm;
  std::vector<Triangle> triangles;
};

/// V of the paper: linear tetrahedra with positive volume.
struct TetMesh {
  std::vector<Vec3> nodes_mm;
  std::vector<Tetrahedron> tetrahedra;
  std::vector<int> label;  ///< tissue of each tetrahedron, 0 where there is one tissue only
};

/// det(b - a, c - a, d - a) / 6, in mm^3; positive in every element of a TetMesh.
double signed_volume_mm3(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

/// Faces that belong to one tetrahedron only, node numbers of the mesh, oriented outwards.
std::vector<Triangle> boundary_triangles(const TetMesh& mesh);

/// Area-weighted unit normals, one per vertex; zero where no triangle meets.
std::vector<Vec3> vertex_normals(const std::vector<Vec3>& vertices, const std::vector<Triangle>& triangles);

/// Vertices used by no triangle are dropped, the rest keep their order.
Surface without_unused_vertices(const Surface& surface);

struct ClosestPoint {
  int triangle = -1;
  Vec3 barycentric = Vec3::Zero();
  Vec3 point = Vec3::Zero();
  double distance = 0;
};

/// Nearest point of one triangle (Ericson, Real-Time Collision Detection, 5.1.5); `triangle` stays -1.
ClosestPoint closest_point_on_triangle(const Vec3& point, const Vec3& a, const Vec3& b, const Vec3& c);

/// Nearest point of a triangle mesh by exhaustive search; `triangle` is -1 when there is none.
ClosestPoint closest_point(const Vec3& point, const std::vector<Vec3>& vertices,
                           const std::vector<Triangle>& triangles);

}  // namespace palpate
