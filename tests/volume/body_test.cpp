#include "palpate/volume/body.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>

#include "palpate/core/errors.h"
#include "palpate/core/mesh_files.h"
#include "palpate/volume/body_remarks.h"
#include "palpate/volume/inside.h"
#include "tests/support/reference_data.h"
#include "tests/volume/shapes.h"

namespace palpate {
namespace {

using namespace palpate::test;

bool is_closed(const Surface& surface) {
  std::map<std::pair<int, int>, int> edges;
  for (const Triangle& t : surface.triangles)
    for (size_t k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
  return std::all_of(edges.begin(), edges.end(), [&](const auto& edge) {
    const auto twin = edges.find({edge.first.second, edge.first.first});
    return twin != edges.end() && twin->second == edge.second;
  });
}

TEST(CloseBody, OfAFlatSquareIsABlock) {
  const Surface body = close_body(height_field(20, 10, [](double, double) { return 100.0; }), 25);
  EXPECT_TRUE(is_closed(body));
  EXPECT_NEAR(enclosed_volume_mm3(body), 40 * 40 * 25, 1e-6);
}

TEST(CloseBody, OfAnyHeightFieldHasTheVolumeOfThePrism) {
  const Surface body = close_body(
      height_field(20, 40, [](double x, double y) { return 100 + 3 * std::sin(x / 5) * std::cos(y / 4); }), 12);
  EXPECT_TRUE(is_closed(body));
  EXPECT_NEAR(enclosed_volume_mm3(body), 40 * 40 * 12, 1e-6);
}

TEST(CloseBody, WithAHoleHasAWallAroundIt) {
  Surface ring = height_field(20, 10, [](double, double) { return 100.0; });
  std::erase_if(ring.triangles, [&](const Triangle& t) {
    return std::all_of(t.begin(), t.end(), [&](int v) {
      return ring.vertices_mm[static_cast<size_t>(v)].cwiseAbs().head<2>().maxCoeff() < 8.1;
    });
  });
  const Surface body = close_body(without_unused_vertices(ring), 10);
  EXPECT_TRUE(is_closed(body));
  EXPECT_NEAR(enclosed_volume_mm3(body), (40 * 40 - 16 * 16) * 10, 1e-6);
}

TEST(CloseBody, AnOverhangKeepsTheShapeSeen) {
  // A sheet that leans over: seen from the origin, left of the axis, it faces the camera everywhere, but from x = -40
  // to -37 it turns away from -z. The space before it is free: the camera looks through it.
  Surface sheet;
  const std::vector<std::pair<double, double>> profile = {{-70, 100}, {-45, 92}, {-37, 90}, {-39, 100}, {-40, 106}};
  for (double y : {-10.0, 10.0})
    for (const auto& [x, z] : profile) sheet.vertices_mm.emplace_back(x, y, z);
  const int n = static_cast<int>(profile.size());
  for (int i = 0; i + 1 < n; ++i) {
    sheet.triangles.push_back({i, i + n, i + 1});
    sheet.triangles.push_back({i + 1, i + n, i + n + 1});
  }
  const InsideTest inside(close_body(sheet, 20));
  EXPECT_TRUE(inside({-44, 0, 95}));
  EXPECT_TRUE(inside({-39.5, 0, 97}));   // between the front and the overhanging side
  EXPECT_FALSE(inside({-37.5, 0, 99}));  // before the overhanging side: the camera sees through here
  EXPECT_FALSE(inside({-39, 0, 104}));
  EXPECT_FALSE(inside({-36, 0, 100}));
  EXPECT_FALSE(inside({-44, 0, 90}));
  EXPECT_FALSE(inside({-44, 0, 118}));
}

TEST(CloseBody, RefusesWhatMakesNoBody) {
  const Surface square = height_field(20, 4, [](double, double) { return 100.0; });
  EXPECT_THROW(close_body(square, 0), BadInput);
  EXPECT_THROW(close_body(Surface{}, 10), BadInput);
  Surface turned = square;
  for (Triangle& t : turned.triangles) std::swap(t[0], t[1]);
  EXPECT_THROW(close_body(turned, 10), BadInput);
}

TEST(InsideTest, AgreesWithAnEllipsoid) {
  const Vec3 center(3, -2, 100), axes(20, 15, 10);
  const InsideTest inside(ellipsoid(center, axes, 5));
  int wrong = 0;
  for (double x = -25; x <= 25; x += 1)
    for (double y = -25; y <= 25; y += 1)
      for (double z = -25; z <= 25; z += 1) {
        const double r = Vec3(x, y, z).cwiseQuotient(axes).norm();
        if (std::abs(r - 1) > 0.01) wrong += inside(center + Vec3(x, y, z)) != (r < 1);
      }
  EXPECT_EQ(wrong, 0);
}

class ReadBody : public testing::Test {
 protected:
  void SetUp() override {
    folder = std::filesystem::temp_directory_path() /
             (std::string("palpate_read_body_") + testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::create_directories(folder);
  }
  void TearDown() override { std::filesystem::remove_all(folder); }

  std::filesystem::path file(const std::string& name, const std::string& text) const {
    std::ofstream(folder / name, std::ios::binary) << text;
    return folder / name;
  }

  std::filesystem::path folder;
};

const char* const kCornerTetrahedron = "0 0 50\n6 0 50\n0 6 50\n0 0 56\n";  // 36 mm^3

void expect_corner_tetrahedron(const Surface& body) {
  EXPECT_EQ(body.vertices_mm.size(), 4u);
  EXPECT_EQ(body.triangles.size(), 4u);
  EXPECT_TRUE(is_closed(body));
  EXPECT_NEAR(enclosed_volume_mm3(body), 36, 1e-6);
}

TEST_F(ReadBody, ReadsOurOwnVtuAndPly) {
  const TetMesh mesh = block({-5, -5, 90}, 10, 3);
  write_vtu(folder / "block.vtu", mesh, {});
  const Surface from_vtu = read_body(folder / "block.vtu", LengthUnit::mm);
  EXPECT_TRUE(is_closed(from_vtu));
  EXPECT_NEAR(enclosed_volume_mm3(from_vtu), 1000, 1e-9);
  write_ply(folder / "block.ply", from_vtu);
  const Surface from_ply = read_body(folder / "block.ply", LengthUnit::mm);
  EXPECT_EQ(from_ply.triangles.size(), from_vtu.triangles.size());
  EXPECT_NEAR(enclosed_volume_mm3(from_ply), 1000, 1e-3);
}

TEST_F(ReadBody, ReadsGmsh2WithTagsAndAnInvertedElement) {
  expect_corner_tetrahedron(read_body(
      file("a.msh",
           std::string("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n10 0 0 50\n20 6 0 50\n30 0 6 50\n40 0 0 "
                       "56\n$EndNodes\n$Elements\n2\n1 2 2 1 1 10 20 30\n2 4 2 1 1 10 30 20 40\n$EndElements\n")),
      LengthUnit::mm));
}

TEST_F(ReadBody, SaysWhatItTurnsAndLeavesOut) {
  const std::string nodes = "$Nodes\n4\n1 0 0 50\n2 6 0 50\n3 0 6 50\n4 0 0 56\n$EndNodes\n";
  const auto gmsh = [&](const std::string& name, const std::string& groups, const std::string& element) {
    return file(name, "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n" + groups + nodes + "$Elements\n1\n" + element +
                          "\n$EndElements\n");
  };
  EXPECT_THAT(body_remarks(gmsh("plain.msh", "", "1 4 2 1 1 1 2 3 4")), testing::IsEmpty());
  EXPECT_THAT(body_remarks(gmsh("turned.msh", "", "1 4 2 1 1 1 3 2 4")),
              testing::ElementsAre(testing::HasSubstr("1 inverted tetrahedra were turned")));
  EXPECT_THAT(body_remarks(gmsh("curved.msh", "", "1 11 2 1 1 1 2 3 4 1 1 1 1 1 1")),
              testing::ElementsAre(testing::HasSubstr("of 1 elements of higher order the corners")));
  EXPECT_THAT(body_remarks(gmsh("groups.msh",
                                "$PhysicalNames\n3\n2 1 \"skin\"\n3 2 \"liver\"\n3 3 \"a tumour\"\n$EndPhysicalNames\n",
                                "1 4 2 1 1 1 2 3 4")),
              testing::ElementsAre(testing::HasSubstr("groups \"liver\", \"a tumour\" are not used")));
}

TEST_F(ReadBody, ReadsGmsh4) {
  expect_corner_tetrahedron(
      read_body(file("a.msh",
                     "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 0 0 1\n1 0 0 50 6 6 56 0 0\n$EndEntities\n"
                     "$Nodes\n2 4 1 4\n0 1 0 1\n1\n0 0 50\n3 1 0 3\n2\n3\n4\n6 0 50\n0 6 50\n0 0 56\n$EndNodes\n"
                     "$Elements\n1 1 1 1\n3 1 4 1\n1 1 2 3 4\n$EndElements\n"),
                LengthUnit::mm));
}

TEST_F(ReadBody, ReadsGmsh1InMetres) {
  expect_corner_tetrahedron(read_body(file("a.msh",
                                           "$NOD\n4\n1 0 0 0.05\n2 0.006 0 0.05\n3 0 0.006 0.05\n4 0 0 "
                                           "0.056\n$ENDNOD\n$ELM\n1\n1 4 1 1 4 1 2 3 4\n$ENDELM\n"),
                                      LengthUnit::m));
}

TEST_F(ReadBody, ReadsLegacyVtkOfBothGenerations) {
  const std::string head = "# vtk DataFile Version 3.0\ntitle\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n";
  expect_corner_tetrahedron(read_body(
      file("a.vtk",
           head + kCornerTetrahedron + "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\nPOINT_DATA 4\nSCALARS a double\n"),
      LengthUnit::mm));
  expect_corner_tetrahedron(
      read_body(file("b.vtk", head + kCornerTetrahedron +
                                  "CELLS 2 4\nOFFSETS vtktypeint64\n0 4\nCONNECTIVITY vtktypeint64\n"
                                  "0 1 2 3\nCELL_TYPES 1\n10\n"),
                LengthUnit::mm));
  expect_corner_tetrahedron(read_body(
      file("c.vtk", "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n" +
                        std::string(kCornerTetrahedron) + "POLYGONS 4 16\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n"),
      LengthUnit::mm));
}

TEST_F(ReadBody, ReadsAsciiAndAppendedVtu) {
  const std::string grid = "<UnstructuredGrid><Piece NumberOfPoints=\"4\" NumberOfCells=\"1\">";
  expect_corner_tetrahedron(read_body(
      file("a.vtu", "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" byte_order=\"LittleEndian\">" + grid +
                        "<Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">" +
                        kCornerTetrahedron +
                        "</DataArray></Points><Cells>"
                        "<DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0 1 2 3</DataArray>"
                        "<DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">4</DataArray>"
                        "<DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">10</DataArray>"
                        "</Cells></Piece></UnstructuredGrid></VTKFile>"),
      LengthUnit::mm));
  std::string data;
  const auto put = [&](const auto& values) {
    const auto size = static_cast<uint32_t>(values.size() * sizeof(values[0]));
    data.append(reinterpret_cast<const char*>(&size), 4);
    data.append(reinterpret_cast<const char*>(values.data()), size);
  };
  std::vector<size_t> at;
  at.push_back(data.size()), put(std::vector<float>{0, 0, 50, 6, 0, 50, 0, 6, 50, 0, 0, 56});
  at.push_back(data.size()), put(std::vector<int64_t>{0, 1, 2, 3});
  at.push_back(data.size()), put(std::vector<int64_t>{4});
  at.push_back(data.size()), put(std::vector<uint8_t>{10});
  const auto array = [&](const char* type, const char* name, size_t i) {
    return "<DataArray type=\"" + std::string(type) + "\" Name=\"" + name + "\" format=\"appended\" offset=\"" +
           std::to_string(at[i]) + "\"/>\n";
  };
  expect_corner_tetrahedron(read_body(
      file("b.vtu", "<VTKFile type=\"UnstructuredGrid\" byte_order=\"LittleEndian\" header_type=\"UInt32\">\n" + grid +
                        "<Points>" + array("Float32", "Points", 0) + "</Points><Cells>" +
                        array("Int64", "connectivity", 1) + array("Int64", "offsets", 2) + array("UInt8", "types", 3) +
                        "</Cells></Piece></UnstructuredGrid><AppendedData encoding=\"raw\">_" + data +
                        "</AppendedData></VTKFile>"),
      LengthUnit::mm));
}

TEST_F(ReadBody, OrientsAndMergesPolygonSoups) {
  // Every facet with corners of its own, two of them turned over, as some exporters write.
  expect_corner_tetrahedron(
      read_body(file("a.obj",
                     "v 0 0 50\nv 6 0 50\nv 0 6 50\nv 0 0 50\nv 6 0 50\nv 0 0 56\nv 6 0 50\nv 0 6 50\nv 0 0 56\n"
                     "v 0 0 50\nv 0 0 56\nv 0 6 50\nf 1 2 3\nf 4 5 6\nf 7 9 8\nf 10 11 12\n"),
                LengthUnit::mm));
  std::string stl = "solid a\n";
  const Vec3 corners[4] = {{0, 0, 50}, {6, 0, 50}, {0, 6, 50}, {0, 0, 56}};
  for (const Triangle& t : {Triangle{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {0, 2, 3}}) {
    stl += "facet normal 0 0 0\nouter loop\n";
    for (int k : t)
      stl += "vertex " + std::to_string(corners[k].x()) + " " + std::to_string(corners[k].y()) + " " +
             std::to_string(corners[k].z()) + "\n";
    stl += "endloop\nendfacet\n";
  }
  expect_corner_tetrahedron(read_body(file("a.stl", stl + "endsolid a\n"), LengthUnit::mm));
}

TEST_F(ReadBody, RefusesWithASentenceThatNamesTheFile) {
  const std::string open = "v 0 0 50\nv 6 0 50\nv 0 6 50\nv 0 0 56\nf 1 3 2\nf 1 2 4\nf 2 3 4\n";
  for (const auto& path :
       {file("open.obj", open), file("empty.ply", ""), file("empty.msh", ""), file("empty.vtu", ""),
        file("empty.vtk", ""), file("cut.msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 1\n2 1"),
        file("binary.msh", "$MeshFormat\n2.2 1 8\n"), file("noise.stl", "this is no mesh"), file("kind.xyz", "1 2 3"),
        folder / "missing.ply"}) {
    try {
      read_body(path, LengthUnit::mm);
      FAIL() << path;
    } catch (const BadInput& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr(path.filename().string()));
    }
  }
}

TEST_F(ReadBody, ReadsPublishedMeshes) {
  PALPATE_NEEDS_REFERENCE("sofa_meshes/liver.msh");
  for (const auto& [name, unit] : {std::pair{"sofa_meshes/liver.msh", LengthUnit::mm},
                                   {"sofa_meshes/liver2.msh", LengthUnit::mm},
                                   {"mestdagh_liver/liver.msh", LengthUnit::m},
                                   {"mestdagh_liver/liver_remeshed.msh", LengthUnit::m},
                                   {"rendered_uterus/surface_rest.ply", LengthUnit::mm},
                                   {"rendered_liver/surface_rest.ply", LengthUnit::mm}}) {
    const Surface body = read_body(reference_data() / name, unit);
    EXPECT_TRUE(is_closed(body)) << name;
    EXPECT_GT(enclosed_volume_mm3(body), 0) << name;
  }
  const double liver = enclosed_volume_mm3(read_body(reference_data() / "mestdagh_liver/liver.msh", LengthUnit::m));
  const double remeshed =
      enclosed_volume_mm3(read_body(reference_data() / "mestdagh_liver/liver_remeshed.msh", LengthUnit::m));
  EXPECT_NEAR(liver / remeshed, 1, 0.02);
  EXPECT_GT(liver, 1e6);  // a human liver: more than a litre
  EXPECT_LT(liver, 2e6);
}

}  // namespace
}  // namespace palpate
