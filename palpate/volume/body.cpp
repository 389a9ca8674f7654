#include "palpate/volume/body.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "palpate/core/errors.h"
#include "palpate/volume/inside.h"
#include "palpate/volume/polygon_soup.h"

namespace palpate {

namespace {

using DirectedEdge = std::pair<int, int>;

std::map<DirectedEdge, std::vector<int>> directed_edges(const std::vector<Triangle>& triangles) {
  std::map<DirectedEdge, std::vector<int>> edges;
  for (size_t t = 0; t < triangles.size(); ++t)
    for (size_t k = 0; k < 3; ++k) edges[{triangles[t][k], triangles[t][(k + 1) % 3]}].push_back(static_cast<int>(t));
  return edges;
}

/// Every edge used as often in one direction as in the other.
bool is_closed_and_oriented(const std::vector<Triangle>& triangles) {
  const auto edges = directed_edges(triangles);
  return std::all_of(edges.begin(), edges.end(), [&](const auto& edge) {
    const auto twin = edges.find({edge.first.second, edge.first.first});
    return twin != edges.end() && twin->second.size() == edge.second.size();
  });
}

/// Turns triangles over until neighbours agree, each piece then outwards.
void orient(Surface& surface) {
  std::map<DirectedEdge, std::vector<int>> edges;
  for (size_t t = 0; t < surface.triangles.size(); ++t)
    for (size_t k = 0; k < 3; ++k) {
      const int a = surface.triangles[t][k], b = surface.triangles[t][(k + 1) % 3];
      edges[std::minmax(a, b)].push_back(static_cast<int>(t));
    }
  std::vector<char> visited(surface.triangles.size(), 0);
  const auto runs = [&](int t, int a, int b) {
    const Triangle& n = surface.triangles[static_cast<size_t>(t)];
    return (n[0] == a && n[1] == b) || (n[1] == a && n[2] == b) || (n[2] == a && n[0] == b);
  };
  for (size_t seed = 0; seed < surface.triangles.size(); ++seed) {
    if (visited[seed]) continue;
    visited[seed] = 1;
    std::vector<int> piece = {static_cast<int>(seed)};
    for (size_t head = 0; head < piece.size(); ++head) {
      const Triangle t = surface.triangles[static_cast<size_t>(piece[head])];
      for (size_t k = 0; k < 3; ++k) {
        const auto& users = edges[std::minmax(t[k], t[(k + 1) % 3])];
        if (users.size() != 2) continue;
        const int other = users[0] == piece[head] ? users[1] : users[0];
        if (visited[static_cast<size_t>(other)]) continue;
        visited[static_cast<size_t>(other)] = 1;
        if (runs(other, t[k], t[(k + 1) % 3]))
          std::swap(surface.triangles[static_cast<size_t>(other)][1], surface.triangles[static_cast<size_t>(other)][2]);
        piece.push_back(other);
      }
    }
    Surface alone{surface.vertices_mm, {}};
    for (int t : piece) alone.triangles.push_back(surface.triangles[static_cast<size_t>(t)]);
    if (enclosed_volume_mm3(alone) < 0)
      for (int t : piece)
        std::swap(surface.triangles[static_cast<size_t>(t)][1], surface.triangles[static_cast<size_t>(t)][2]);
  }
}

/// Corners nearer to each other than this part of the mesh's extent, or of its distance from the origin, are one: the
/// last of the seven digits that programs write, when they write a corner once for each of its triangles.
constexpr double kSameCorner = 3e-6;

/// Numbers of the vertices after those within reach of an earlier one became it.
class Corners {
 public:
  explicit Corners(const std::vector<Vec3>& vertices) {
    Vec3 low = Vec3::Constant(HUGE_VAL), high = -low;
    for (const Vec3& v : vertices) {
      low = low.cwiseMin(v);
      high = high.cwiseMax(v);
    }
    if (vertices.empty()) return;
    reach_ = kSameCorner * std::max((high - low).norm(), high.cwiseAbs().cwiseMax(low.cwiseAbs()).maxCoeff());
    origin_ = low;
  }

  int number_of(const Vec3& position) {
    const Cell cell = cell_of(position);
    for (int dx = -1; dx <= 1; ++dx)
      for (int dy = -1; dy <= 1; ++dy)
        for (int dz = -1; dz <= 1; ++dz) {
          const auto [begin, end] = in_cell_.equal_range({cell[0] + dx, cell[1] + dy, cell[2] + dz});
          for (auto it = begin; it != end; ++it)
            if ((positions[static_cast<size_t>(it->second)] - position).norm() <= reach_) return it->second;
        }
    positions.push_back(position);
    in_cell_.emplace(cell, static_cast<int>(positions.size()) - 1);
    return static_cast<int>(positions.size()) - 1;
  }

  std::vector<Vec3> positions;

 private:
  using Cell = std::array<long, 3>;
  Cell cell_of(const Vec3& p) const {
    const double size = reach_ > 0 ? 2 * reach_ : 1;
    return {std::lround((p.x() - origin_.x()) / size), std::lround((p.y() - origin_.y()) / size),
            std::lround((p.z() - origin_.z()) / size)};
  }

  double reach_ = 0;
  Vec3 origin_ = Vec3::Zero();
  std::multimap<Cell, int> in_cell_;
};

/// Files like .stl repeat every corner: those become one vertex, triangles without area go.
Surface merged(const Surface& surface) {
  Surface result;
  Corners corners(surface.vertices_mm);
  std::vector<int> new_number;
  for (const Vec3& v : surface.vertices_mm) {
    if (!v.allFinite()) throw BadInput("a coordinate is not finite");
    new_number.push_back(corners.number_of(v));
  }
  result.vertices_mm = corners.positions;
  for (const Triangle& t : surface.triangles) {
    const Triangle n = {new_number[static_cast<size_t>(t[0])], new_number[static_cast<size_t>(t[1])],
                        new_number[static_cast<size_t>(t[2])]};
    if (n[0] != n[1] && n[1] != n[2] && n[2] != n[0]) result.triangles.push_back(n);
  }
  return without_unused_vertices(result);
}

/// "3 holes (41 open edges), the longest border is 57.3 mm long and passes (12.0, -3.1, 98.4)".
std::string describe_holes(const Surface& surface) {
  std::map<DirectedEdge, int> users;
  for (const Triangle& t : surface.triangles)
    for (size_t k = 0; k < 3; ++k) ++users[std::minmax(t[k], t[(k + 1) % 3])];
  std::multimap<int, int> neighbours;
  int open_edges = 0;
  for (const auto& [edge, count] : users) {
    if (count % 2 == 0) continue;
    ++open_edges;
    neighbours.emplace(edge.first, edge.second);
    neighbours.emplace(edge.second, edge.first);
  }
  std::set<int> seen;
  int holes = 0, longest_at = 0;
  double longest_mm = 0;
  for (const auto& [start, unused] : neighbours) {
    if (!seen.insert(start).second) continue;
    ++holes;
    double twice_length_mm = 0;
    std::vector<int> border = {start};
    for (size_t head = 0; head < border.size(); ++head) {
      const auto [begin, end] = neighbours.equal_range(border[head]);
      for (auto it = begin; it != end; ++it) {
        const auto at = [&](int vertex) { return surface.vertices_mm[static_cast<size_t>(vertex)]; };
        twice_length_mm += (at(it->second) - at(border[head])).norm();
        if (seen.insert(it->second).second) border.push_back(it->second);
      }
    }
    if (twice_length_mm / 2 <= longest_mm) continue;
    longest_mm = twice_length_mm / 2;
    longest_at = start;
  }
  if (open_edges == 0) return "its triangles overlap or meet three at an edge";
  const Vec3& p = surface.vertices_mm[static_cast<size_t>(longest_at)];
  return fmt::format(
      "{} holes ({} open edges), the longest border is {:.1f} mm long and passes ({:.1f}, {:.1f}, {:.1f})", holes,
      open_edges, longest_mm, p.x(), p.y(), p.z());
}

}  // namespace

Surface close_body(const Surface& visible, double thickness_mm) {
  if (visible.triangles.empty() || !(thickness_mm > 0))
    throw BadInput(fmt::format("a surface of {} triangles and a thickness of {} mm make no body",
                               visible.triangles.size(), thickness_mm));
  const auto back = static_cast<int>(visible.vertices_mm.size());
  Surface body = visible;
  for (const Vec3& v : visible.vertices_mm) body.vertices_mm.push_back(v + thickness_mm * Vec3::UnitZ());
  for (const Triangle& t : visible.triangles) body.triangles.push_back({t[0] + back, t[2] + back, t[1] + back});
  const auto edges = directed_edges(visible.triangles);
  for (const auto& [edge, users] : edges) {
    const auto [a, b] = edge;
    if (edges.count({b, a})) continue;
    body.triangles.push_back({b, a, a + back});
    body.triangles.push_back({b, a + back, b + back});
  }
  if (!(enclosed_volume_mm3(body) > 0))
    throw BadInput("the visible surface does not face the camera, no body can be closed behind it");
  return body;
}

Surface read_body(const std::filesystem::path& file, LengthUnit unit) {
  const Surface soup = read_polygon_soup(file);
  Surface body;
  try {
    body = merged(soup);
  } catch (const BadInput& error) {
    throw BadInput(fmt::format("{} cannot be read: {}", file.string(), error.what()));
  }
  if (body.triangles.empty())
    throw BadInput(fmt::format("{} holds no triangles and no volume elements", file.string()));
  if (unit == LengthUnit::m)
    for (Vec3& v : body.vertices_mm) v *= 1000;
  if (!is_closed_and_oriented(body.triangles)) {
    orient(body);
    if (!is_closed_and_oriented(body.triangles))
      throw BadInput(fmt::format("{} is not closed: {}; expected a closed surface or a volume", file.string(),
                                 describe_holes(body)));
  }
  const double volume = enclosed_volume_mm3(body);
  if (volume < 0)
    for (Triangle& t : body.triangles) std::swap(t[1], t[2]);
  if (!(std::abs(volume) > 0)) throw BadInput(fmt::format("{} encloses no volume", file.string()));
  return body;
}

}  // namespace palpate
