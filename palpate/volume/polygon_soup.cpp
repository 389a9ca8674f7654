#include "palpate/volume/polygon_soup.h"

#include <CGAL/IO/polygon_soup_io.h>
#include <CGAL/Simple_cartesian.h>
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <fstream>
#include <map>
#include <sstream>

#include "palpate/core/errors.h"

namespace palpate {

namespace {

/// Faces of the volume cells, outwards, as VTK numbers their corners.
const std::map<int, std::vector<std::vector<int>>>& faces_of_cells() {
  static const std::map<int, std::vector<std::vector<int>>> kFaces = {
      {10, {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}},                                          // tetra
      {12, {{0, 4, 7, 3}, {1, 2, 6, 5}, {0, 1, 5, 4}, {3, 7, 6, 2}, {0, 3, 2, 1}, {4, 5, 6, 7}}},  // hexahedron
      {13, {{0, 1, 2}, {3, 5, 4}, {0, 3, 4, 1}, {1, 4, 5, 2}, {2, 5, 3, 0}}},                      // wedge
      {14, {{0, 3, 2, 1}, {0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}}},                            // pyramid
  };
  return kFaces;
}

/// Quadratic cells begin with the corners of their linear ones.
int linear_type(int type) {
  switch (type) {
    case 22:
      return 5;
    case 23:
    case 28:
      return 9;
    case 24:
      return 10;
    case 25:
    case 29:
      return 12;
    case 26:
      return 13;
    case 27:
      return 14;
    default:
      return type;
  }
}

void add_polygon(const std::vector<int>& polygon, Surface& surface) {
  for (size_t k = 2; k < polygon.size(); ++k) surface.triangles.push_back({polygon[0], polygon[k - 1], polygon[k]});
}

Surface read_with_cgal(const std::filesystem::path& file) {
  std::vector<CGAL::Simple_cartesian<double>::Point_3> points;
  std::vector<std::vector<size_t>> polygons;
  if (!CGAL::IO::read_polygon_soup(file.string(), points, polygons)) throw BadInput("no readable polygons in it");
  Surface surface;
  for (const auto& p : points) surface.vertices_mm.emplace_back(p.x(), p.y(), p.z());
  for (const auto& polygon : polygons) {
    if (std::any_of(polygon.begin(), polygon.end(), [&](size_t corner) { return corner >= points.size(); }))
      throw BadInput("a polygon names a corner that is not there");
    add_polygon({polygon.begin(), polygon.end()}, surface);
  }
  return surface;
}

}  // namespace

Surface skin_of(const CellSoup& soup) {
  Surface surface;
  surface.vertices_mm = soup.points;
  std::map<std::vector<int>, std::pair<int, std::vector<int>>> faces;
  for (size_t i = 0; i < soup.cells.size(); ++i) {
    std::vector<int> cell = soup.cells[i];
    if (std::any_of(cell.begin(), cell.end(),
                    [&](int node) { return node < 0 || node >= static_cast<int>(soup.points.size()); }))
      throw BadInput(fmt::format("cell {} names a node that is not there", i));
    const int type = linear_type(soup.types[i]);
    const auto found = faces_of_cells().find(type);
    if (found == faces_of_cells().end()) continue;
    if (type == 10 && cell.size() >= 4) {
      const auto point = [&](size_t k) -> const Vec3& { return soup.points[static_cast<size_t>(cell[k])]; };
      if (signed_volume_mm3(point(0), point(1), point(2), point(3)) < 0) std::swap(cell[2], cell[3]);
    }
    for (const std::vector<int>& corners : found->second) {
      std::vector<int> face;
      for (int corner : corners) face.push_back(cell.at(static_cast<size_t>(corner)));
      std::vector<int> key = face;
      std::sort(key.begin(), key.end());
      auto& place = faces[key];
      ++place.first;
      place.second = face;
    }
  }
  for (const auto& [key, face] : faces)
    if (face.first == 1) add_polygon(face.second, surface);
  if (!faces.empty()) return surface;
  for (size_t i = 0; i < soup.cells.size(); ++i) {
    const int type = linear_type(soup.types[i]);
    const size_t corners = type == 5 ? 3 : type == 9 ? 4 : type == 7 ? soup.cells[i].size() : 0;
    if (corners >= 3 && corners <= soup.cells[i].size())
      add_polygon({soup.cells[i].begin(), soup.cells[i].begin() + static_cast<std::ptrdiff_t>(corners)}, surface);
    if (type == 6)  // a strip of triangles turns every second one over
      for (size_t k = 2; k < soup.cells[i].size(); ++k)
        surface.triangles.push_back({soup.cells[i][k - 2], soup.cells[i][k - 1 + k % 2], soup.cells[i][k - k % 2]});
  }
  return surface;
}

Surface read_polygon_soup(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  std::ifstream stream(file, std::ios::binary);
  if (!stream || std::filesystem::is_directory(file))
    throw BadInput(fmt::format("{}: no such file, expected a volume or a closed surface", file.string()));
  try {
    if (extension == ".ply" || extension == ".obj" || extension == ".stl") return read_with_cgal(file);
    if (extension == ".msh") return skin_of(read_gmsh(stream));
    if (extension == ".vtk") return skin_of(read_vtk_legacy(stream));
    if (extension == ".vtu") {
      std::ostringstream text;
      text << stream.rdbuf();
      return skin_of(read_vtu(text.str()));
    }
  } catch (const std::exception& error) {
    throw BadInput(fmt::format("{} cannot be read: {}", file.string(), error.what()));
  }
  throw BadInput(fmt::format("{}: unknown kind of file '{}', expected .msh .vtk .vtu .obj .ply or .stl", file.string(),
                             extension));
}

}  // namespace palpate
