#include "tests/support/dome.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace palpate::test {

namespace {

/// From 0 to 1 in steps that begin with about `first` and grow by `growth`.
std::vector<double> graded(double first, double growth) {
  std::vector<double> at = {0};
  for (double step = first; at.back() < 1; step *= growth) at.push_back(at.back() + step);
  for (double& x : at) x /= at.back();
  return at;
}

/// A quarter disc of rings; one more sector from ring to ring up to `sectors`.
struct Rings {
  struct Point {
    int ring = 0;
    double angle = 0;
  };
  std::vector<Point> points;
  std::vector<Triangle> triangles;

  Rings(int rings, int sectors) {
    int inner = 0, inner_sectors = 0;
    for (int ring = 0; ring < rings; ++ring) {
      const int outer = static_cast<int>(points.size()), outer_sectors = std::min(ring, sectors);
      for (int i = 0; i <= outer_sectors; ++i)
        points.push_back({ring, outer_sectors == 0 ? 0 : 0.5 * std::numbers::pi * i / outer_sectors});
      for (int i = 0; i < outer_sectors; ++i) triangles.push_back({inner + i, outer + i, outer + i + 1});
      for (int i = 0; i < inner_sectors; ++i) triangles.push_back({inner + i, outer + i + 1, inner + i + 1});
      inner = outer;
      inner_sectors = outer_sectors;
    }
  }
};

/// A prism into three tetrahedra; the order of the numbers makes neighbours cut their common face alike.
void add_prism(TetMesh& mesh, Triangle base, int below, int above) {
  std::sort(base.begin(), base.end());
  const auto& [a, b, c] = base;
  for (Tetrahedron tet : {Tetrahedron{below + a, below + b, below + c, above + c},
                          Tetrahedron{below + a, below + b, above + b, above + c},
                          Tetrahedron{below + a, above + a, above + b, above + c}}) {
    const auto at = [&mesh](int n) { return mesh.nodes_mm[static_cast<size_t>(n)]; };
    if (signed_volume_mm3(at(tet[0]), at(tet[1]), at(tet[2]), at(tet[3])) < 0) std::swap(tet[2], tet[3]);
    mesh.tetrahedra.push_back(tet);
    mesh.label.push_back(0);
  }
}

}  // namespace

double Dome::top_z_mm(double x, double y) const {
  return (depth_mm - wall_mm) * (std::pow(x / half_length_mm, 2) + std::pow(y / half_width_mm, 2));
}

Surface dome_surface(const Dome& dome, double edge_mm) {
  const int sectors = static_cast<int>(std::ceil(2 * std::numbers::pi * dome.half_length_mm / edge_mm));
  const int rings = static_cast<int>(std::ceil(dome.half_length_mm / edge_mm));
  Surface surface;
  std::vector<int> last(static_cast<size_t>(sectors), 0);
  const auto add_ring = [&](double scale, auto z_of) {
    std::vector<int> ring;
    for (int i = 0; i < sectors; ++i) {
      const double angle = 2 * std::numbers::pi * i / sectors;
      const double x = scale * dome.half_length_mm * std::cos(angle), y = scale * dome.half_width_mm * std::sin(angle);
      ring.push_back(static_cast<int>(surface.vertices_mm.size()));
      surface.vertices_mm.emplace_back(x, y, z_of(x, y));
    }
    for (size_t i = 0; i < ring.size(); ++i) {
      const size_t j = (i + 1) % ring.size();
      if (last[i] != last[j]) surface.triangles.push_back({last[i], last[j], ring[i]});
      surface.triangles.push_back({ring[i], last[j], ring[j]});
    }
    last = ring;
  };
  const auto top = [&dome](double x, double y) { return dome.top_z_mm(x, y); };
  const auto bottom = [&dome](double, double) { return dome.depth_mm; };
  surface.vertices_mm.emplace_back(0, 0, 0);
  for (int k = 1; k <= rings; ++k) add_ring(static_cast<double>(k) / rings, top);
  for (int k = rings; k >= 1; --k) add_ring(static_cast<double>(k) / rings, bottom);
  const int middle = static_cast<int>(surface.vertices_mm.size());
  surface.vertices_mm.emplace_back(0, 0, dome.depth_mm);
  for (size_t i = 0; i < last.size(); ++i) surface.triangles.push_back({last[i], last[(i + 1) % last.size()], middle});
  return surface;
}

TetMesh quarter_dome(const Dome& dome, double radius_mm, int sectors) {
  const double rim_step = std::pow(1.0 / sectors, 1.5), growth = 1 + 2.4 / sectors;
  const std::vector<double> outside = graded(rim_step * radius_mm / dome.half_width_mm, growth),
                            layers = graded(rim_step * radius_mm / dome.depth_mm, growth);
  const Rings rings(sectors + static_cast<int>(outside.size()), sectors);
  const auto place = [&](const Rings::Point& p) {
    const Eigen::Vector2d direction(std::cos(p.angle), std::sin(p.angle));
    const double to_rim = 1 / std::hypot(direction[0] / dome.half_length_mm, direction[1] / dome.half_width_mm);
    const double fraction = 1 - static_cast<double>(p.ring) / sectors;
    if (fraction >= 0) return Eigen::Vector2d(radius_mm * (1 - std::pow(fraction, 1.5)) * direction);
    const double t = outside[static_cast<size_t>(p.ring - sectors)];
    return Eigen::Vector2d((radius_mm + t * (to_rim - radius_mm)) * direction);
  };
  TetMesh mesh;
  for (double depth : layers)
    for (const Rings::Point& p : rings.points) {
      const Eigen::Vector2d xy = place(p);
      const double top = dome.top_z_mm(xy[0], xy[1]);
      mesh.nodes_mm.emplace_back(xy[0], xy[1], top + depth * (dome.depth_mm - top));
    }
  const int layer = static_cast<int>(rings.points.size());
  for (int k = 0; k + 1 < static_cast<int>(layers.size()); ++k)
    for (const Triangle& t : rings.triangles) add_prism(mesh, t, layer * k, layer * (k + 1));
  return mesh;
}

}  // namespace palpate::test
