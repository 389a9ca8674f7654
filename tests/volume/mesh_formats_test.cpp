#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <lz4.h>
#include <lzma.h>
#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>

#include "palpate/core/errors.h"
#include "palpate/volume/body.h"
#include "palpate/volume/inside.h"
#include "palpate/volume/polygon_soup.h"

namespace palpate {
namespace {

/// The one body that every file below holds: a tetrahedron of 36 mm^3.
const std::vector<double> kPoints = {0, 0, 50, 6, 0, 50, 0, 6, 50, 0, 0, 56};
const std::vector<Triangle> kFaces = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};

template <class Number>
std::string binary(const std::vector<double>& values, bool swapped) {
  std::string bytes;
  for (const double value : values) {
    const auto number = static_cast<Number>(value);
    char raw[sizeof number];
    std::memcpy(raw, &number, sizeof number);
    if (swapped) std::reverse(raw, raw + sizeof raw);
    bytes.append(raw, sizeof raw);
  }
  return bytes;
}

class MeshFormats : public ::testing::Test {
 protected:
  void expect_the_body(const std::string& name, const std::string& bytes) const {
    SCOPED_TRACE(name + ": " + bytes.substr(0, 200));
    Surface body;
    ASSERT_NO_THROW(body = read(name, bytes));
    EXPECT_EQ(body.vertices_mm.size(), 4U);
    EXPECT_EQ(body.triangles.size(), 4U);
    EXPECT_NEAR(enclosed_volume_mm3(body), 36, 1e-4);
  }
  Surface read(const std::string& name, const std::string& bytes) const {
    std::filesystem::create_directories(folder_);
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return read_body(folder_ / name, LengthUnit::mm);
  }
  std::string refusal(const std::string& name, const std::string& bytes) const {
    try {
      read(name, bytes);
    } catch (const BadInput& error) {
      return error.what();
    }
    return "";
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() /
      (std::string("palpate_mesh_formats_") + ::testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(MeshFormats, GmshInBinaryOfEveryVersionAndByteOrder) {
  for (const bool swapped : {false, true}) {
    const auto ints = [&](const std::vector<double>& v) { return binary<int32_t>(v, swapped); };
    const auto sizes = [&](const std::vector<double>& v) { return binary<uint64_t>(v, swapped); };
    const auto reals = [&](const std::vector<double>& v) { return binary<double>(v, swapped); };
    const auto node = [&](int i) { return reals({kPoints[3 * i], kPoints[3 * i + 1], kPoints[3 * i + 2]}); };
    const auto head = [&](const std::string& version) {
      return "$MeshFormat\n" + version + " 1 8\n" + ints({1}) + "\n$EndMeshFormat\n";
    };
    std::string nodes2, nodes40;
    for (int i = 0; i < 4; ++i) nodes2 += ints({10.0 + i}) + node(i), nodes40 += ints({10.0 + i}) + node(i);
    expect_the_body("v2.msh", head("2.2") + "$Nodes\n4\n" + nodes2 + "\n$EndNodes\n$Elements\n2\n" +
                                  ints({2, 1, 2, 1, 7, 7, 10, 11, 12}) + ints({4, 1, 2, 2, 7, 7, 10, 11, 12, 13}) +
                                  "\n$EndElements\n");
    expect_the_body("v40.msh", head("4") + "$Nodes\n" + sizes({1, 4}) + ints({1, 3, 0}) + sizes({4}) + nodes40 +
                                   "\n$EndNodes\n$Elements\n" + sizes({1, 1}) + ints({1, 3, 4}) + sizes({1}) +
                                   ints({1, 10, 11, 12, 13}) + "\n$EndElements\n");
    expect_the_body("v41.msh", head("4.1") + "$Entities\n" + sizes({0, 0, 0, 0}) + "\n$EndEntities\n$Nodes\n" +
                                   sizes({1, 4, 10, 13}) + ints({3, 1, 0}) + sizes({4}) + sizes({10, 11, 12, 13}) +
                                   reals(kPoints) + "\n$EndNodes\n$Elements\n" + sizes({1, 1, 1, 1}) + ints({3, 1, 4}) +
                                   sizes({1}) + sizes({1, 10, 11, 12, 13}) + "\n$EndElements\n");
  }
}

TEST_F(MeshFormats, GmshFourZeroAndThirdOrderAsText) {
  expect_the_body("a.msh",
                  "$MeshFormat\n4 0 8\n$EndMeshFormat\n$Nodes\n1 4\n1 3 0 4\n1 0 0 50\n2 6 0 50\n3 0 6 50\n4 0 0 56\n"
                  "$EndNodes\n$Elements\n1 1\n1 3 4 1\n9 1 2 3 4\n$EndElements\n");
  // Of twenty nodes the first four are the corners.
  std::string nodes = "1 0 0 50\n2 6 0 50\n3 0 6 50\n4 0 0 56\n", cell = "1 29 2 1 1 1 2 3 4";
  for (int i = 5; i <= 20; ++i) {
    nodes += std::to_string(i) + " 1 1 51\n";
    cell += " " + std::to_string(i);
  }
  expect_the_body("b.msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n20\n" + nodes + "$EndNodes\n$Elements\n1\n" +
                               cell + "\n$EndElements\n");
}

TEST_F(MeshFormats, LegacyVtkInBinary) {
  const auto ints = [](const std::vector<double>& v) { return binary<int32_t>(v, true); };
  const auto longs = [](const std::vector<double>& v) { return binary<int64_t>(v, true); };
  const std::string points = "POINTS 4 float\n" + binary<float>(kPoints, true) + "\n";
  const std::string metadata = "METADATA\nINFORMATION 1\nNAME L2_NORM_RANGE LOCATION vtkDataArray\nDATA 2 0 1\n\n";
  std::vector<double> polygons, flat;
  for (const Triangle& t : kFaces) {
    polygons.insert(polygons.end(), {3.0, double(t[0]), double(t[1]), double(t[2])});
    flat.insert(flat.end(), {double(t[0]), double(t[1]), double(t[2])});
  }
  expect_the_body("slicer.vtk", "# vtk DataFile Version 4.2\nvtk output SPACE=LPS\nBINARY\nDATASET POLYDATA\n" +
                                    points + metadata + "VERTICES 1 2\n" + ints({1, 0}) + "\nPOLYGONS 4 16\n" +
                                    ints(polygons) + "\nPOINT_DATA 4\nSCALARS a float\n");
  expect_the_body("pyvista.vtk", "# vtk DataFile Version 5.1\nvtk output\nBINARY\nDATASET POLYDATA\n" + points +
                                     metadata + "POLYGONS 5 12\nOFFSETS vtktypeint64\n" + longs({0, 3, 6, 9, 12}) +
                                     "\nCONNECTIVITY vtktypeint64\n" + longs(flat) + "\n");
  expect_the_body("grid.vtk",
                  "# vtk DataFile Version 3.0\nt\nBINARY\nDATASET UNSTRUCTURED_GRID\nFIELD FieldData 1\nTIME 1 1 "
                  "double\n" +
                      binary<double>({0.5}, true) + "\n" + points + "CELLS 1 5\n" + ints({4, 0, 1, 2, 3}) +
                      "\nCELL_TYPES 1\n" + ints({10}) + "\n");
  EXPECT_THAT(refusal("image.vtk", "# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_POINTS\n"),
              testing::HasSubstr("STRUCTURED_POINTS"));
}

std::string base64(const std::string& bytes) {
  static const char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t group = 0;
    for (size_t k = 0; k < 3; ++k)
      group = group << 8 | (i + k < bytes.size() ? static_cast<uint8_t>(bytes[i + k]) : 0u);
    for (size_t k = 0; k < 4; ++k) text += i + k <= bytes.size() ? kDigits[group >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

std::string zlib_packed(const std::string& bytes) {
  uLongf size = compressBound(bytes.size());
  std::string packed(size, '\0');
  compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
  packed.resize(size);
  return packed;
}
std::string lz4_packed(const std::string& bytes) {
  std::string packed(static_cast<size_t>(LZ4_compressBound(static_cast<int>(bytes.size()))), '\0');
  packed.resize(static_cast<size_t>(LZ4_compress_default(bytes.data(), packed.data(), static_cast<int>(bytes.size()),
                                                         static_cast<int>(packed.size()))));
  return packed;
}
std::string lzma_packed(const std::string& bytes) {
  std::string packed(lzma_stream_buffer_bound(bytes.size()), '\0');
  size_t size = 0;
  lzma_easy_buffer_encode(0, LZMA_CHECK_CRC32, nullptr, reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size(),
                          reinterpret_cast<uint8_t*>(packed.data()), &size, packed.size());
  packed.resize(size);
  return packed;
}

/// One VTK XML file: `pack` makes blocks of 16 bytes; none where there is no compressor.
struct XmlForm {
  std::string compressor;
  std::function<std::string(const std::string&)> pack;
  bool big_endian = false;
  bool wide_header = false;
  std::string place = "inline";  // inline, raw, base64
};

/// Header and data of an array: together raw, apart in base64, as VTK writes them.
std::string array_bytes(const std::string& bytes, const XmlForm& form, bool encode) {
  const auto header = [&](const std::vector<double>& v) {
    return form.wide_header ? binary<uint64_t>(v, form.big_endian) : binary<uint32_t>(v, form.big_endian);
  };
  const auto size = static_cast<double>(bytes.size());
  if (!form.pack) return encode ? base64(header({size}) + bytes) : header({size}) + bytes;
  constexpr size_t kBlock = 16;
  std::vector<double> numbers = {std::ceil(size / kBlock), kBlock, static_cast<double>(bytes.size() % kBlock)};
  std::string packed;
  for (size_t i = 0; i < bytes.size(); i += kBlock) {
    const std::string block = form.pack(bytes.substr(i, kBlock));
    numbers.push_back(static_cast<double>(block.size()));
    packed += block;
  }
  return encode ? base64(header(numbers)) + base64(packed) : header(numbers) + packed;
}

std::string xml_file(const XmlForm& form, bool polygons) {
  std::string appended;
  const auto array = [&](const std::string& type, const std::string& name, const std::string& bytes) {
    const std::string start = "<DataArray type=\"" + type + "\" Name=\"" + name + "\" ";
    if (form.place == "inline")
      return start + "format=\"binary\">\n" + array_bytes(bytes, form, true) + "\n</DataArray>\n";
    const std::string offset = std::to_string(appended.size());
    appended += array_bytes(bytes, form, form.place == "base64");
    return start + "format=\"appended\" offset=\"" + offset + "\"/>\n";
  };
  const std::string kind = polygons ? "PolyData" : "UnstructuredGrid", group = polygons ? "Polys" : "Cells";
  std::vector<double> nodes = {0, 1, 2, 3}, offsets = {4};
  if (polygons) {
    nodes.clear();
    for (const Triangle& t : kFaces) nodes.insert(nodes.end(), {double(t[0]), double(t[1]), double(t[2])});
    offsets = {3, 6, 9, 12};
  }
  std::string text = "<?xml version=\"1.0\"?>\n<VTKFile type=\"" + kind + "\" byte_order=\"" +
                     (form.big_endian ? "BigEndian" : "LittleEndian") + "\" header_type=\"" +
                     (form.wide_header ? "UInt64" : "UInt32") + "\"";
  if (!form.compressor.empty()) text += " compressor=\"" + form.compressor + "\"";
  text += ">\n<" + kind + "><Piece NumberOfPoints=\"4\">\n<PointData></PointData><Points>" +
          array("Float32", "Points", binary<float>(kPoints, form.big_endian)) + "</Points>\n";
  if (polygons) text += "<Verts></Verts>";
  text += "<" + group + ">" + array("Int64", "connectivity", binary<int64_t>(nodes, form.big_endian)) +
          array("Int32", "offsets", binary<int32_t>(offsets, form.big_endian));
  if (!polygons) text += array("UInt8", "types", binary<uint8_t>({10}, form.big_endian));
  text += "</" + group + "></Piece></" + kind + ">\n";
  if (form.place != "inline")
    text += "<AppendedData encoding=\"" + form.place + "\">\n_" + appended + "\n</AppendedData>\n";
  return text + "</VTKFile>\n";
}

TEST_F(MeshFormats, VtkXmlPackedInEveryWay) {
  const std::vector<std::pair<std::string, std::function<std::string(const std::string&)>>> compressors = {
      {"", nullptr},
      {"vtkZLibDataCompressor", zlib_packed},
      {"vtkLZ4DataCompressor", lz4_packed},
      {"vtkLZMADataCompressor", lzma_packed}};
  for (const auto& [compressor, pack] : compressors)
    for (const bool big_endian : {false, true})
      for (const bool wide_header : {false, true})
        for (const char* place : {"inline", "raw", "base64"}) {
          const XmlForm form{compressor, pack, big_endian, wide_header, place};
          expect_the_body("a.vtu", xml_file(form, false));
          expect_the_body("a.vtp", xml_file(form, true));
        }
  EXPECT_THAT(refusal("a.vtu", xml_file({"vtkNewDataCompressor", zlib_packed}, false)),
              testing::HasSubstr("vtkNewData"));
}

TEST_F(MeshFormats, ObjOfBlenderAndWithRelativeNumbers) {
  const std::string vertices = "mtllib a.mtl\no Organ\nv 0 0 50\nv 6 0 50 1.0\nv 0 6 50\nv 0 0 56\nvt 0 0\nvn 0 0 1\n";
  expect_the_body("blender.obj",
                  vertices +
                      "s off\nusemtl m\nl 1 2\nf 1/1/1 3/1/1 2/1/1\nf 1//1 2//1 4//1\nf 2/1 3/1 4/1 # a\n"
                      "f 1 4 3\n");
  std::string relative;
  for (const Triangle& t : kFaces) {
    for (const int corner : t) {
      const auto at = static_cast<size_t>(3 * corner);
      relative += "v " + std::to_string(kPoints[at]) + " " + std::to_string(kPoints[at + 1]) + " " +
                  std::to_string(kPoints[at + 2]) + "\nvn 0 0 1\n";
    }
    relative += "f -3//-3 -2//-2 -1//-1\n";
  }
  expect_the_body("relative.obj", relative);
  EXPECT_THAT(refusal("a.obj", vertices + "f 1 2 5\n"), testing::HasSubstr("a.obj"));
  EXPECT_THAT(refusal("a.obj", vertices + "f 1 2 -9\n"), testing::HasSubstr("'-9'"));
}

TEST_F(MeshFormats, PlyAndStlInEveryDialect) {
  for (const bool big_endian : {false, true}) {
    std::string ply =
        std::string("ply\r\nformat binary_") + (big_endian ? "big" : "little") +
        "_endian 1.0\r\ncomment made here\r\nelement vertex 4\r\nproperty double x\r\nproperty double y\r\n"
        "property double z\r\nproperty uchar red\r\nelement face 4\r\nproperty uchar flags\r\n"
        "property list uint8 int32 vertex_index\r\nelement edge 1\r\nproperty int a\r\nend_header\r\n";
    for (size_t i = 0; i < 4; ++i)
      ply += binary<double>({kPoints[3 * i], kPoints[3 * i + 1], kPoints[3 * i + 2]}, big_endian) + "r";
    for (const Triangle& t : kFaces)
      ply += "f" + binary<uint8_t>({3}, big_endian) +
             binary<int32_t>({double(t[0]), double(t[1]), double(t[2])}, big_endian);
    expect_the_body("a.ply", ply + binary<int32_t>({1}, big_endian));
  }
  expect_the_body("b.ply",
                  "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
                  "element face 4\nproperty list uchar int vertex_indices\nend_header\n0 0 50\n6 0 50\n0 6 50\n0 0 56\n"
                  "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n");
  std::string stl = "solid made by a program" + std::string(57, ' ') + binary<uint32_t>({4}, false), text = "SOLID A\n";
  // Each corner of each triangle is rounded on its own, the copies differ by some millionths of a millimetre.
  double rounded = 0;
  for (const Triangle& t : kFaces) {
    stl += binary<float>({0, 0, 0}, false);
    text += "FACET NORMAL 0 0 0\nOUTER LOOP\n";
    for (const int corner : t) {
      const auto at = static_cast<size_t>(3 * corner);
      const std::vector<double> point = {kPoints[at], kPoints[at + 1], kPoints[at + 2] + rounded};
      rounded = rounded > 3e-6 ? -4e-6 : rounded + 1e-6;
      stl += binary<float>(point, false);
      char line[100];
      std::snprintf(line, sizeof line, "VERTEX %.6e %.6e %.6e\n", point[0], point[1], point[2]);
      text += line;
    }
    stl += std::string(2, '\0');
    text += "ENDLOOP\nENDFACET\n";
  }
  ASSERT_EQ(stl.size(), 84U + 200U);
  expect_the_body("binary.stl", stl);
  expect_the_body("text.stl", text + "ENDSOLID A\n");
}

TEST_F(MeshFormats, VoxelsAndMixedCellsHaveTheSkinOfTheirUnion) {
  const std::string head =
      "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 9 double\n"
      "0 0 50 2 0 50 0 2 50 2 2 50 0 0 52 2 0 52 0 2 52 2 2 52 1 1 55\n";
  EXPECT_NEAR(enclosed_volume_mm3(read("voxel.vtk", head + "CELLS 1 9\n8 0 1 2 3 4 5 6 7\nCELL_TYPES 1\n11\n")), 8,
              1e-9);
  const Surface mixed = read("mixed.vtk", head + "CELLS 2 15\n8 0 1 3 2 4 5 7 6\n5 4 5 7 6 8\nCELL_TYPES 2\n12\n14\n");
  EXPECT_NEAR(enclosed_volume_mm3(mixed), 12, 1e-9);
}

TEST_F(MeshFormats, AnOpenSurfaceIsRefusedWithItsHolesAndTheLongestBorder) {
  // A cube without its top and without half of its bottom.
  const std::string cube =
      "v 0 0 50\nv 4 0 50\nv 4 4 50\nv 0 4 50\nv 0 0 54\nv 4 0 54\nv 4 4 54\nv 0 4 54\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 "
      "7\n"
      "f 4 1 5 8\nf 1 4 3\n";
  EXPECT_THAT(refusal("cube.obj", cube), testing::AllOf(testing::HasSubstr("2 holes (7 open edges)"),
                                                        testing::HasSubstr("the longest border is 16.0 mm long")));
}

}  // namespace
}  // namespace palpate
