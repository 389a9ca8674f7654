#include "palpate/session/shape.h"

#include <fmt/format.h>

#include <cstring>

#include "palpate/core/errors.h"
#include "palpate/core/whole_file.h"

namespace palpate {

namespace {

constexpr std::uint32_t kFixed = 1, kNotSeen = 2;
/// A node on the visible side lies nearer to S* than this, mm.
constexpr double kOnSurface_mm = 2;

template <class Number>
void put(std::string& bytes, Number number) {
  static_assert(sizeof(Number) == 4);
  char raw[4];
  std::memcpy(raw, &number, 4);
  bytes.append(raw, 4);
}

struct ShapeParts {
  int frame = 0;
  const std::vector<Vec3>& nodes_mm;
  const std::vector<Triangle>& triangles;
  const std::vector<double>& stress_kPa;
  const std::vector<std::uint32_t>& flags;
};

/// Nodes that no triangle uses are left out.
std::string bytes_of(const ShapeParts& shape) {
  std::vector<std::uint32_t> number(shape.nodes_mm.size(), UINT32_MAX);
  std::vector<size_t> used;
  for (const Triangle& triangle : shape.triangles)
    for (int node : triangle) {
      const auto i = static_cast<size_t>(node);
      if (number[i] != UINT32_MAX) continue;
      number[i] = static_cast<std::uint32_t>(used.size());
      used.push_back(i);
    }
  std::string bytes = "PSH1";
  put(bytes, static_cast<std::int32_t>(shape.frame));
  put(bytes, static_cast<std::uint32_t>(used.size()));
  put(bytes, static_cast<std::uint32_t>(shape.triangles.size()));
  for (size_t i : used)
    for (int axis = 0; axis < 3; ++axis) put(bytes, static_cast<float>(shape.nodes_mm[i][axis]));
  for (size_t i : used) put(bytes, i < shape.stress_kPa.size() ? static_cast<float>(shape.stress_kPa[i]) : 0.0f);
  for (size_t i : used) put(bytes, i < shape.flags.size() ? shape.flags[i] : std::uint32_t{0});
  for (const Triangle& triangle : shape.triangles)
    for (int node : triangle) put(bytes, number[static_cast<size_t>(node)]);
  return bytes;
}

}  // namespace

std::string shape_bytes(const BuiltMap& built) {
  const TissueMap& map = built.map;
  std::vector<std::uint32_t> flags(map.mesh.nodes_mm.size(), 0);
  for (int node : map.fixed_nodes) flags[static_cast<size_t>(node)] |= kFixed;
  for (size_t i = 0; i < flags.size(); ++i)
    if (sight_of(map.seen, map.mesh.nodes_mm[i], kOnSurface_mm) != SeenTissue::Sight::seen) flags[i] |= kNotSeen;
  return bytes_of({-1, map.mesh.nodes_mm, boundary_triangles(map.mesh), {}, flags});
}

std::string shape_bytes(const ForceEstimate& estimate) {
  if (estimate.deformed_nodes_mm.empty()) return {};
  return bytes_of({estimate.frame, estimate.deformed_nodes_mm, estimate.boundary, estimate.node_von_mises_kPa, {}});
}

ShapeWriter::ShapeWriter(const std::filesystem::path& file, const BuiltMap& built)
    : file_(file), stream_(file, std::ios::binary) {
  append(shape_bytes(built));
}

void ShapeWriter::write(const ForceEstimate& estimate) {
  append(shape_bytes(estimate));
}

void ShapeWriter::append(const std::string& bytes) {
  if (bytes.empty()) return;
  require_room(file_, bytes.size());
  std::string length;
  put(length, static_cast<std::uint32_t>(bytes.size()));
  stream_ << length << bytes << std::flush;
  if (!stream_) throw Unfinished(fmt::format("{} cannot be written", file_.string()));
}

std::vector<ShapePlace> shape_places(const std::filesystem::path& file) {
  std::vector<ShapePlace> places;
  std::error_code error;
  const std::uint64_t all = std::filesystem::file_size(file, error);
  std::ifstream stream(file, std::ios::binary);
  std::uint64_t at = 0;
  char head[12];
  while (!error && stream.seekg(static_cast<std::streamoff>(at)) && stream.read(head, sizeof head)) {
    ShapePlace place;
    std::memcpy(&place.size, head, 4);
    std::memcpy(&place.frame, head + 8, 4);
    place.offset = at + 4;
    at = place.offset + place.size;
    if (std::memcmp(head + 4, "PSH1", 4) != 0 || at > all) break;
    places.push_back(place);
  }
  return places;
}

std::string read_shape(const std::filesystem::path& file, const ShapePlace& place) {
  std::string bytes(place.size, '\0');
  std::ifstream stream(file, std::ios::binary);
  stream.seekg(static_cast<std::streamoff>(place.offset));
  stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  return bytes;
}

}  // namespace palpate
