#include "palpate/volume/polygon_soup.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <map>

#include "palpate/core/errors.h"
#include "palpate/core/table_text.h"
#include "palpate/core/whole_file.h"
#include "palpate/volume/body_remarks.h"
#include "palpate/volume/mesh_bytes.h"

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

/// Cells of higher order begin with the corners of their linear ones (VTK's quadratic and Lagrange types).
int linear_type(int type) {
  switch (type) {
    case 22:
    case 34:
    case 69:
      return 5;
    case 23:
    case 28:
    case 30:
    case 70:
      return 9;
    case 24:
    case 71:
      return 10;
    case 25:
    case 29:
    case 33:
    case 72:
      return 12;
    case 26:
    case 31:
    case 32:
    case 73:
      return 13;
    case 27:
    case 37:
    case 74:
      return 14;
    default:
      return type;
  }
}

int corners_of(const std::vector<std::vector<int>>& faces) {
  int max = 0;
  for (const std::vector<int>& face : faces) max = std::max(max, *std::max_element(face.begin(), face.end()));
  return max + 1;
}

void add_polygon(const std::vector<int>& polygon, Surface& surface) {
  for (size_t k = 2; k < polygon.size(); ++k) surface.triangles.push_back({polygon[0], polygon[k - 1], polygon[k]});
}

struct MeshKind {
  std::vector<std::string> extensions;
  CellSoup (*read)(std::string_view);
  InputKind input;
};

const std::vector<MeshKind>& registry() {
  static const std::vector<MeshKind> kKinds = {
      {{".msh"},
       read_gmsh,
       {"Gmsh 1, 2.2, 4.0, 4.1", "Gmsh, SOFA, meshio, CGAL", "text or binary of either byte order, any order"}},
      {{".vtk"},
       read_vtk_legacy,
       {"legacy VTK 1 to 5.1", "3D Slicer, PyVista, ParaView, ITK-SNAP, FEBio",
        "text or binary, UNSTRUCTURED_GRID or POLYDATA"}},
      {{".vtu", ".vtp"},
       read_vtk_xml,
       {"VTK XML", "ParaView, VTK, PyVista, meshio, Palpate",
        "text, base64 or appended; zlib, lz4, lzma; either byte order; several pieces"}},
      {{".obj"},
       read_obj,
       {"Wavefront OBJ", "Blender, MeshLab, Meshroom, photogrammetry",
        "v and f with or without texture and normals, numbers that count back, free edges"}},
      {{".ply"},
       read_ply,
       {"PLY", "MeshLab, CloudCompare, Open3D, Palpate",
        "text or binary of either byte order, further properties, triangle strips"}},
      {{".stl"}, read_stl, {"STL", "3D Slicer, Mimics, CAD", "text or binary, told by length"}},
  };
  return kKinds;
}

bool is_inverted(const CellSoup& soup, const std::vector<int>& tetrahedron) {
  std::array<Vec3, 4> corners;
  for (size_t k = 0; k < 4; ++k) {
    const int node = k < tetrahedron.size() ? tetrahedron[k] : -1;
    if (node < 0 || node >= static_cast<int>(soup.points.size())) return false;
    corners[k] = soup.points[static_cast<size_t>(node)];
  }
  return signed_volume_mm3(corners[0], corners[1], corners[2], corners[3]) < 0;
}

/// Gmsh's names of parts of the volume, in quotes.
std::vector<std::string> physical_volumes(std::string_view bytes) {
  std::vector<std::string> names;
  const size_t section = bytes.find("$PhysicalNames");
  if (section == std::string_view::npos) return names;
  MeshBytes lines(bytes.substr(section));
  lines.line();
  lines.line();
  for (std::string_view line = lines.line(); !line.empty() && !line.starts_with('$'); line = lines.line()) {
    MeshBytes words(line);
    const bool is_volume = words.word() == "3";
    words.word();
    if (is_volume) names.emplace_back(trimmed(words.line()));
  }
  return names;
}

/// `use(kind, bytes)` of a file, by its ending; what goes wrong is told with its name.
template <class Use>
auto of_file(const std::filesystem::path& file, const Use& use) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  if (const std::string obstacle = obstacle_to_reading(file); !obstacle.empty())
    throw BadInput(fmt::format("{} {}, expected a volume or a closed surface", file.string(), obstacle));
  const std::string bytes = read_whole_file(file);
  for (const MeshKind& kind : registry()) {
    if (std::find(kind.extensions.begin(), kind.extensions.end(), extension) == kind.extensions.end()) continue;
    try {
      return use(kind, bytes);
    } catch (const std::exception& error) {
      throw BadInput(fmt::format("{} cannot be read: {}", file.string(), error.what()));
    }
  }
  throw BadInput(fmt::format("{}: unknown kind of file '{}', expected .msh .vtk .vtu .vtp .obj .ply or .stl",
                             file.string(), extension));
}

}  // namespace

std::vector<InputKind> mesh_kinds() {
  std::vector<InputKind> kinds;
  for (const MeshKind& kind : registry()) {
    kinds.push_back(kind.input);
    kinds.back().kind += fmt::format(" ({})", fmt::join(kind.extensions, ", "));
  }
  kinds.push_back(
      {"cells", "",
       "tetrahedra, hexahedra, voxels, wedges, pyramids (their boundary is taken), else triangles, quadrilaterals, "
       "polygons, strips; of a higher order the corners; inverted tetrahedra are turned; both are said, and physical "
       "groups "
       "that are not used; polyhedra are refused"});
  kinds.push_back(
      {"corners", "",
       "those nearer than three millionths of the mesh's extent, or of its distance from the origin, are one"});
  return kinds;
}

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
    if (type == 42) throw BadInput("polyhedra are not supported, expected tetrahedra, hexahedra, wedges or pyramids");
    const auto found = faces_of_cells().find(type == 11 ? 12 : type);
    if (found == faces_of_cells().end()) continue;
    if (type == 11 && cell.size() >= 8) std::swap(cell[2], cell[3]), std::swap(cell[6], cell[7]);  // a voxel
    if (static_cast<int>(cell.size()) < corners_of(found->second))
      throw BadInput(fmt::format("cell {} has {} nodes, too few for its type", i, cell.size()));
    if (type == 10 && is_inverted(soup, cell)) std::swap(cell[2], cell[3]);
    for (const std::vector<int>& corners : found->second) {
      std::vector<int> face;
      for (int corner : corners) face.push_back(cell[static_cast<size_t>(corner)]);
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
    const size_t corners = type == 5 ? 3 : type == 9 || type == 8 ? 4 : type == 7 ? soup.cells[i].size() : 0;
    if (corners >= 3 && corners <= soup.cells[i].size()) {
      std::vector<int> polygon(soup.cells[i].begin(), soup.cells[i].begin() + static_cast<std::ptrdiff_t>(corners));
      if (type == 8) std::swap(polygon[2], polygon[3]);  // a pixel
      add_polygon(polygon, surface);
    }
    if (type == 6)  // a strip of triangles turns every second one over
      for (size_t k = 2; k < soup.cells[i].size(); ++k)
        surface.triangles.push_back({soup.cells[i][k - 2], soup.cells[i][k - 1 + k % 2], soup.cells[i][k - k % 2]});
  }
  return surface;
}

Surface read_polygon_soup(const std::filesystem::path& file) {
  return of_file(file, [](const MeshKind& kind, const std::string& bytes) { return skin_of(kind.read(bytes)); });
}

std::vector<std::string> body_remarks(const std::filesystem::path& file) {
  return of_file(file, [&](const MeshKind& kind, const std::string& bytes) {
    const CellSoup soup = kind.read(bytes);
    size_t turned = 0, curved = 0;
    for (size_t i = 0; i < soup.cells.size(); ++i) {
      const auto faces = faces_of_cells().find(soup.types[i] == 11 ? 12 : linear_type(soup.types[i]));
      if (faces == faces_of_cells().end()) continue;
      turned += faces->first == 10 && is_inverted(soup, soup.cells[i]);
      curved += static_cast<int>(soup.cells[i].size()) > corners_of(faces->second);
    }
    std::vector<std::string> remarks;
    if (turned > 0) remarks.push_back(fmt::format("{}: {} inverted tetrahedra were turned", file.string(), turned));
    if (curved > 0)
      remarks.push_back(fmt::format("{}: of {} elements of higher order the corners are used", file.string(), curved));
    if (const auto groups = physical_volumes(bytes); !groups.empty())
      remarks.push_back(
          fmt::format("{}: the physical groups {} are not used, the whole is one tissue (map.labels says where "
                      "it differs)",
                      file.string(), fmt::join(groups, ", ")));
    return remarks;
  });
}

}  // namespace palpate
