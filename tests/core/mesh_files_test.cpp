#include "palpate/core/mesh_files.h"

#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "palpate/core/errors.h"

namespace palpate {
namespace {

class MeshFiles : public testing::Test {
 protected:
  void SetUp() override {
    folder = std::filesystem::temp_directory_path() /
             ("palpate_mesh_files_" + std::to_string(::testing::UnitTest::GetInstance()->random_seed()) +
              testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::create_directories(folder);
  }
  void TearDown() override { std::filesystem::remove_all(folder); }

  static std::string bytes_of(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    std::ostringstream text;
    text << stream.rdbuf();
    return text.str();
  }

  std::filesystem::path folder;
};

TetMesh one_tetrahedron() {
  return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 1, 2, 3}}, {0}};
}

TEST_F(MeshFiles, VtuEncodesConnectivityAsLittleEndianBase64) {
  write_vtu(folder / "one.vtu", one_tetrahedron(), {});
  const std::string text = bytes_of(folder / "one.vtu");
  // Length 1 as UInt64, then the type 10 of a tetrahedron; encoded by an independent program.
  EXPECT_NE(text.find("Name=\"types\" NumberOfComponents=\"1\" format=\"binary\">AQAAAAAAAAAK</DataArray>"),
            std::string::npos);
  // Length 8, then the offset 4 as Int64.
  EXPECT_NE(text.find(">CAAAAAAAAAAEAAAAAAAAAA==</DataArray>"), std::string::npos);
  EXPECT_NE(text.find("NumberOfPoints=\"4\" NumberOfCells=\"1\""), std::string::npos);
}

TEST_F(MeshFiles, VtuNamesEveryArray) {
  MeshArrays arrays;
  arrays.node_scalars["fixed"] = {1, 0, 0, 0};
  arrays.node_vectors["displacement_mm"] = std::vector<Vec3>(4, Vec3(1, 2, 3));
  arrays.element_scalars["von_mises_kPa"] = {2.5};
  write_vtu(folder / "arrays.vtu", one_tetrahedron(), arrays);
  const std::string text = bytes_of(folder / "arrays.vtu");
  for (const char* name : {"fixed", "displacement_mm", "von_mises_kPa", "label"})
    EXPECT_NE(text.find("Name=\"" + std::string(name) + "\""), std::string::npos) << name;
}

TEST_F(MeshFiles, ArraysOfAnotherLengthAreRefusedAndLeaveNoFile) {
  MeshArrays arrays;
  arrays.node_scalars["fixed"] = {1, 0};
  EXPECT_THROW(write_vtu(folder / "wrong.vtu", one_tetrahedron(), arrays), std::invalid_argument);
  EXPECT_TRUE(std::filesystem::is_empty(folder));
}

TEST_F(MeshFiles, SurfacePlyHasPositionsNormalsAndTriangles) {
  const Surface surface{{{0, 0, 5}, {0, 2, 5}, {2, 0, 5}}, {{0, 1, 2}}};
  write_ply(folder / "surface.ply", surface);
  const std::string bytes = bytes_of(folder / "surface.ply");
  const std::string end = "end_header\n";
  const size_t data = bytes.find(end) + end.size();
  ASSERT_EQ(bytes.size(), data + 3 * 6 * sizeof(float) + 1 + 3 * sizeof(int32_t));
  float second[6];
  std::memcpy(second, bytes.data() + data + sizeof second, sizeof second);
  EXPECT_FLOAT_EQ(second[1], 2);
  EXPECT_FLOAT_EQ(second[2], 5);
  EXPECT_FLOAT_EQ(second[5], -1);
}

TEST_F(MeshFiles, CloudPlyHasColoursAsRedGreenBlue) {
  const PointCloud cloud{{{1, 2, 3}}, {0.25f}, {0.5f}, {cv::Vec3b(10, 20, 30)}};
  write_ply(folder / "cloud.ply", cloud);
  const std::string bytes = bytes_of(folder / "cloud.ply");
  const std::string end = "end_header\n";
  const size_t data = bytes.find(end) + end.size();
  ASSERT_EQ(bytes.size(), data + 12 + 3 + 8);
  EXPECT_EQ(bytes.substr(data + 12, 3), "\x1e\x14\x0a");
  float rest[2];
  std::memcpy(rest, bytes.data() + data + 15, sizeof rest);
  EXPECT_EQ(rest[0], 0.25f);
  EXPECT_EQ(rest[1], 0.5f);
}

TEST_F(MeshFiles, WritingIntoNoFolderIsUnfinished) {
  EXPECT_THROW(write_vtu(folder / "missing" / "one.vtu", one_tetrahedron(), {}), Unfinished);
  EXPECT_THROW(write_ply(folder / "missing" / "one.ply", Surface{}), Unfinished);
}

TEST_F(MeshFiles, AnExistingFileIsReplacedWhole) {
  std::ofstream(folder / "one.vtu") << std::string(100000, 'x');
  write_vtu(folder / "one.vtu", one_tetrahedron(), {});
  const std::string text = bytes_of(folder / "one.vtu");
  EXPECT_EQ(text.rfind("<?xml", 0), 0u);
  EXPECT_EQ(text.find("xxxx"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(folder / "one.vtu.part"));
}

}  // namespace
}  // namespace palpate
