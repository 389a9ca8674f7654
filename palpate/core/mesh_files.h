#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "palpate/core/geometry.h"

namespace palpate {

/// Numbers that go along with a mesh, one per node or one per element; vectors as three columns.
struct MeshArrays {
  std::map<std::string, std::vector<double>> node_scalars;
  std::map<std::string, std::vector<Vec3>> node_vectors;
  std::map<std::string, std::vector<double>> element_scalars;
};

/// VTK XML unstructured grid that ParaView opens. Throws Unfinished when the file cannot be written.
void write_vtu(const std::filesystem::path& file, const TetMesh& mesh, const MeshArrays& arrays);

/// Binary PLY with normals. Throws Unfinished when the file cannot be written.
void write_ply(const std::filesystem::path& file, const Surface& surface);

/// Binary PLY: x y z red green blue depth_deviation_mm correlation.
void write_ply(const std::filesystem::path& file, const PointCloud& cloud);

}  // namespace palpate
