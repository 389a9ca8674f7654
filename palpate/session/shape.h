#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "palpate/estimate/force_estimate.h"
#include "palpate/session/built_map.h"

namespace palpate {

/// A triangle mesh for a 3D view as bytes, all numbers little-endian and 4 bytes long: "PSH1", frame, count of nodes,
/// count of triangles; x y z of each node (float, mm, left camera frame); von Mises stress of each (float, kPa); flags
/// of each (uint32: 1 = fixed, 2 = was not seen); three nodes of each triangle (uint32).
std::string shape_bytes(const BuiltMap& built);
/// What of it the camera sees, as a frame found it; empty where nothing was computed.
std::string shape_bytes(const ForceEstimate& estimate);

/// shapes.bin of a run: of each frame its length (uint32) and its shape, the map's first.
class ShapeWriter {
 public:
  /// Throws Unfinished where the file cannot be written.
  ShapeWriter(const std::filesystem::path& file, const BuiltMap& built);
  void write(const ForceEstimate& estimate);

 private:
  void append(const std::string& bytes);
  std::filesystem::path file_;
  std::ofstream stream_;
};

/// Where the shapes stand in such a file, one for each; what was cut is left out.
struct ShapePlace {
  int frame = 0;  ///< of the map -1
  std::uint64_t offset = 0;
  std::uint32_t size = 0;
};
std::vector<ShapePlace> shape_places(const std::filesystem::path& file);
std::string read_shape(const std::filesystem::path& file, const ShapePlace& place);

}  // namespace palpate
