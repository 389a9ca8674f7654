#pragma once

#include <filesystem>
#include <vector>

#include "palpate/core/geometry.h"

namespace palpate {

/// Triangles of a mesh file in the file's own unit; where it holds volume elements, the faces that bound them. Chosen
/// by the extension. Throws BadInput: no such file, unknown extension, malformed.
Surface read_polygon_soup(const std::filesystem::path& file);

/// Cells of a mesh by their VTK type number (5 triangle, 9 quadrilateral, 10 tetrahedron, ...).
struct CellSoup {
  std::vector<Vec3> points;
  std::vector<int> types;
  std::vector<std::vector<int>> cells;
};

/// Readers behind it; throw BadInput without the name of the file.
CellSoup read_gmsh(std::istream& stream);
CellSoup read_vtk_legacy(std::istream& stream);
CellSoup read_vtu(const std::string& text);

/// The surface triangles, or the boundary of the volume cells where there are any.
Surface skin_of(const CellSoup& soup);

}  // namespace palpate
