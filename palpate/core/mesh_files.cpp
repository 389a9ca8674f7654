#include "palpate/core/mesh_files.h"

#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <stdexcept>

#include "palpate/core/whole_file.h"

namespace palpate {

namespace {

template <class Number>
void append(std::string& bytes, Number value) {
  char raw[sizeof value];
  std::memcpy(raw, &value, sizeof value);
  bytes.append(raw, sizeof value);
}

std::string base64(const std::string& bytes) {
  static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t group = 0;
    for (size_t k = 0; k < 3; ++k)
      group = group << 8 | (i + k < bytes.size() ? static_cast<uint8_t>(bytes[i + k]) : 0u);
    for (size_t k = 0; k < 4; ++k) text += i + k <= bytes.size() ? kDigits[group >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

/// One array of a VTK XML file; the values are appended by `fill`.
template <class Number, class Fill>
std::string data_array(const std::string& type, const std::string& name, int components, Fill fill) {
  std::string values;
  fill([&values](auto value) { append(values, static_cast<Number>(value)); });
  std::string bytes;
  append(bytes, static_cast<uint64_t>(values.size()));
  return fmt::format("<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"binary\">{}</DataArray>\n",
                     type, name, components, base64(bytes + values));
}

std::string vectors(const std::string& name, const std::vector<Vec3>& values) {
  return data_array<double>("Float64", name, 3, [&](auto put) {
    for (const Vec3& v : values)
      for (int i = 0; i < 3; ++i) put(v[i]);
  });
}

std::string scalars(const std::string& name, const std::vector<double>& values) {
  return data_array<double>("Float64", name, 1, [&](auto put) {
    for (double value : values) put(value);
  });
}

void expect_length(const std::string& name, size_t length, size_t expected) {
  if (length != expected)
    throw std::invalid_argument(fmt::format("array {} has {} values, the mesh {}", name, length, expected));
}

}  // namespace

void write_vtu(const std::filesystem::path& file, const TetMesh& mesh, const MeshArrays& arrays) {
  const size_t nodes = mesh.nodes_mm.size(), elements = mesh.tetrahedra.size();
  std::string text =
      "<?xml version=\"1.0\"?>\n"
      "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n";
  text += fmt::format("<UnstructuredGrid>\n<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n", nodes, elements);
  text += "<Points>\n" + vectors("Points", mesh.nodes_mm) + "</Points>\n<Cells>\n";
  text += data_array<int64_t>("Int64", "connectivity", 1, [&](auto put) {
    for (const Tetrahedron& t : mesh.tetrahedra)
      for (int node : t) put(node);
  });
  text += data_array<int64_t>("Int64", "offsets", 1, [&](auto put) {
    for (size_t i = 0; i < elements; ++i) put(4 * (i + 1));
  });
  constexpr int kVtkTetra = 10;
  text += data_array<uint8_t>("UInt8", "types", 1, [&](auto put) {
    for (size_t i = 0; i < elements; ++i) put(kVtkTetra);
  });
  text += "</Cells>\n<PointData>\n";
  for (const auto& [name, values] : arrays.node_scalars) {
    expect_length(name, values.size(), nodes);
    text += scalars(name, values);
  }
  for (const auto& [name, values] : arrays.node_vectors) {
    expect_length(name, values.size(), nodes);
    text += vectors(name, values);
  }
  text += "</PointData>\n<CellData>\n";
  if (!mesh.label.empty()) {
    expect_length("label", mesh.label.size(), elements);
    text += data_array<int32_t>("Int32", "label", 1, [&](auto put) {
      for (int label : mesh.label) put(label);
    });
  }
  for (const auto& [name, values] : arrays.element_scalars) {
    expect_length(name, values.size(), elements);
    text += scalars(name, values);
  }
  text += "</CellData>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n";
  write_whole_file(file, text);
}

void write_ply(const std::filesystem::path& file, const Surface& surface) {
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment mm, left camera frame\nelement vertex {}\n"
      "property float x\nproperty float y\nproperty float z\nproperty float nx\nproperty float ny\nproperty float nz\n"
      "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
      surface.vertices_mm.size(), surface.triangles.size());
  const std::vector<Vec3> normals = vertex_normals(surface.vertices_mm, surface.triangles);
  for (size_t i = 0; i < normals.size(); ++i) {
    for (int k = 0; k < 3; ++k) append(bytes, static_cast<float>(surface.vertices_mm[i][k]));
    for (int k = 0; k < 3; ++k) append(bytes, static_cast<float>(normals[i][k]));
  }
  for (const Triangle& triangle : surface.triangles) {
    append(bytes, uint8_t{3});
    for (int corner : triangle) append(bytes, static_cast<int32_t>(corner));
  }
  write_whole_file(file, bytes);
}

void write_ply(const std::filesystem::path& file, const PointCloud& cloud) {
  expect_length("depth_deviation_mm", cloud.depth_deviation_mm.size(), cloud.size());
  expect_length("correlation", cloud.correlation.size(), cloud.size());
  expect_length("colour", cloud.colour.size(), cloud.size());
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment mm, left camera frame\nelement vertex {}\n"
      "property float x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\n"
      "property float depth_deviation_mm\nproperty float correlation\nend_header\n",
      cloud.size());
  for (size_t i = 0; i < cloud.size(); ++i) {
    for (int k = 0; k < 3; ++k) append(bytes, static_cast<float>(cloud.position_mm[i][k]));
    for (int k = 2; k >= 0; --k) append(bytes, cloud.colour[i][k]);
    append(bytes, cloud.depth_deviation_mm[i]);
    append(bytes, cloud.correlation[i]);
  }
  write_whole_file(file, bytes);
}

}  // namespace palpate
