#include <gtest/gtest.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "tests/app/program.h"

namespace palpate::test {
namespace {

/// What meshio (python3-meshio), a reader that shares nothing with Palpate, finds in the files of a map.
const char* const kReader = R"(
import json, sys
import meshio
folder = sys.argv[1]
mesh = meshio.read(folder + '/map.vtu')
tetra = mesh.cells_dict['tetra']
a, b, c, d = (mesh.points[tetra[:, k]] for k in range(4))
surface = meshio.read(folder + '/surface.ply')
cloud = meshio.read(folder + '/cloud.ply')
print(json.dumps({
    'nodes': len(mesh.points), 'elements': len(tetra), 'fixed_nodes': int(mesh.point_data['fixed'].sum()),
    'labels': int(mesh.cell_data_dict['label']['tetra'].max()),
    'least_volume': float((((b - a)[:, [1, 2, 0]] * (c - a)[:, [2, 0, 1]] - (b - a)[:, [2, 0, 1]] * (c - a)[:, [1, 2, 0]])
                          * (d - a)).sum(axis=1).min() / 6),
    'surface_vertices': len(surface.points), 'surface_triangles': len(surface.cells_dict['triangle']),
    'normal_z': float(surface.point_data['nz'].mean()),
    'cloud_points': len(cloud.points), 'cloud_z': float(cloud.points[:, 2].mean()),
    'deviation': float(cloud.point_data['depth_deviation_mm'].min()),
    'correlation': float(cloud.point_data['correlation'].max()), 'red': int(cloud.point_data['red'].max())}))
)";

std::string output_of(const std::string& command) {
  std::string text;
  FILE* pipe = popen(command.c_str(), "r");
  char part[4096];
  while (const size_t got = fread(part, 1, sizeof part, pipe)) text.append(part, got);
  return pclose(pipe) == 0 ? text : "";
}

TEST(MapFiles, AreReadBackByAnotherReader) {
  if (output_of("/usr/bin/python3 -c 'import meshio; print(1)' 2>/dev/null").empty())
    GTEST_SKIP() << "python3-meshio is not installed";
  Workspace workspace;
  write_plane_recording(workspace / "in", 2);
  const std::filesystem::path folder = workspace / "map";
  ASSERT_EQ(run_palpate("map " + (workspace / "in/scene.yaml").string() + " -o " + folder.string()).exit_code, 0);
  write_file(workspace / "read.py", kReader);
  const std::string text =
      output_of("/usr/bin/python3 " + (workspace / "read.py").string() + " " + folder.string() + " 2>&1");
  ASSERT_FALSE(text.empty());
  const auto found = nlohmann::json::parse(text),
             counts = nlohmann::json::parse(read_file(folder / "map.json"))["counts"];
  for (const char* name : {"nodes", "elements", "fixed_nodes", "surface_vertices", "surface_triangles", "cloud_points"})
    EXPECT_EQ(found[name], counts[name]) << name;
  EXPECT_EQ(found["labels"], 0);
  EXPECT_GT(found["least_volume"].get<double>(), 0) << "mm^3";
  EXPECT_LT(found["normal_z"].get<double>(), -0.5) << "towards the camera";
  EXPECT_GT(found["cloud_z"].get<double>(), 20) << "mm";
  EXPECT_LT(found["cloud_z"].get<double>(), 200) << "mm";
  EXPECT_GT(found["deviation"].get<double>(), 0) << "mm";
  EXPECT_LE(found["correlation"].get<double>(), 1);
  EXPECT_GT(found["red"].get<int>(), 0);
}

}  // namespace
}  // namespace palpate::test
