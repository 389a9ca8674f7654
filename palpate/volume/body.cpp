#include "palpate/volume/body.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <map>

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

/// Turns triangles over until neighbours agree, each piece then outwards. Returns the number of open edges.
int orient(Surface& surface) {
  std::map<DirectedEdge, std::vector<int>> edges;
  for (size_t t = 0; t < surface.triangles.size(); ++t)
    for (size_t k = 0; k < 3; ++k) {
      const int a = surface.triangles[t][k], b = surface.triangles[t][(k + 1) % 3];
      edges[std::minmax(a, b)].push_back(static_cast<int>(t));
    }
  int open = 0;
  for (const auto& [edge, users] : edges) open += users.size() % 2 != 0;
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
  return open;
}

/// Files like .stl repeat every corner: equal positions become one vertex, triangles without area go.
Surface merged(const Surface& surface) {
  Surface result;
  std::map<std::array<double, 3>, int> number;
  std::vector<int> new_number;
  for (const Vec3& v : surface.vertices_mm) {
    const auto [place, is_new] = number.try_emplace({v.x(), v.y(), v.z()}, static_cast<int>(result.vertices_mm.size()));
    if (is_new) result.vertices_mm.push_back(v);
    new_number.push_back(place->second);
  }
  for (const Triangle& t : surface.triangles) {
    const Triangle n = {new_number[static_cast<size_t>(t[0])], new_number[static_cast<size_t>(t[1])],
                        new_number[static_cast<size_t>(t[2])]};
    if (n[0] != n[1] && n[1] != n[2] && n[2] != n[0]) result.triangles.push_back(n);
  }
  return without_unused_vertices(result);
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
  Surface body = merged(read_polygon_soup(file));
  if (body.triangles.empty())
    throw BadInput(fmt::format("{} holds no triangles and no volume elements", file.string()));
  if (unit == LengthUnit::m)
    for (Vec3& v : body.vertices_mm) v *= 1000;
  if (!is_closed_and_oriented(body.triangles)) {
    const int open = orient(body);
    if (!is_closed_and_oriented(body.triangles))
      throw BadInput(
          fmt::format("{} is not closed ({} open edges), expected a closed surface or a volume", file.string(), open));
  }
  const double volume = enclosed_volume_mm3(body);
  if (volume < 0)
    for (Triangle& t : body.triangles) std::swap(t[1], t[2]);
  if (!(std::abs(volume) > 0)) throw BadInput(fmt::format("{} encloses no volume", file.string()));
  return body;
}

}  // namespace palpate
