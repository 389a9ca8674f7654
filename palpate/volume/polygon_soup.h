#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

#include "palpate/core/geometry.h"
#include "palpate/core/input_kind.h"

namespace palpate {

/// Triangles of a mesh file in the file's own unit; where it holds volume elements, the faces that bound them. Chosen
/// by the extension: .msh .vtk .vtu .vtp .obj .ply .stl. Throws BadInput: no such file, unknown extension, malformed.
Surface read_polygon_soup(const std::filesystem::path& file);

/// The kinds of files that it reads.
std::vector<InputKind> mesh_kinds();

/// Cells of a mesh by their VTK type number (5 triangle, 9 quadrilateral, 10 tetrahedron, ...).
struct CellSoup {
  std::vector<Vec3> points;
  std::vector<int> types;
  std::vector<std::vector<int>> cells;
};

/// Readers of a whole file in memory; throw BadInput without the name of the file. Of cells of higher order the corners
/// are kept.
CellSoup read_gmsh(std::string_view bytes);        ///< 1, 2.2, 4.0, 4.1, text or binary
CellSoup read_vtk_legacy(std::string_view bytes);  ///< 1 to 5.1, text or binary
CellSoup read_vtk_xml(std::string_view bytes);     ///< .vtu, .vtp: text, base64, appended; zlib, lz4, lzma
CellSoup read_obj(std::string_view bytes);
CellSoup read_ply(std::string_view bytes);  ///< text or binary of either byte order
CellSoup read_stl(std::string_view bytes);  ///< text or binary

/// The surface triangles, or the boundary of the volume cells where there are any.
Surface skin_of(const CellSoup& soup);

}  // namespace palpate
