#include "tests/support/published_liver.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <limits>

#include "palpate/volume/polygon_soup.h"
#include "tests/support/reference_data.h"

namespace palpate::test {

namespace {

constexpr double kMillimetresPerMetre = 1e3;
constexpr int kVtkTetrahedron = 10;

std::vector<int> read_numbers(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::vector<int> numbers;
  for (int number; stream >> number;) numbers.push_back(number);
  return numbers;
}

TetMesh read_mesh(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  const std::string bytes(std::istreambuf_iterator<char>(stream), {});
  const CellSoup soup = read_gmsh(bytes);
  TetMesh mesh;
  for (const Vec3& x : soup.points) mesh.nodes_mm.push_back(kMillimetresPerMetre * x);
  for (size_t c = 0; c < soup.cells.size(); ++c)
    if (soup.types[c] == kVtkTetrahedron)
      mesh.tetrahedra.push_back({soup.cells[c][0], soup.cells[c][1], soup.cells[c][2], soup.cells[c][3]});
  return mesh;
}

Eigen::VectorXd read_displacement(const std::filesystem::path& file, const TetMesh& mesh) {
  std::ifstream stream(file);
  Eigen::VectorXd u = Eigen::VectorXd::Zero(3 * static_cast<Eigen::Index>(mesh.nodes_mm.size()));
  for (size_t n = 0; n < mesh.nodes_mm.size(); ++n) {
    Vec3 position_m;
    stream >> position_m[0] >> position_m[1] >> position_m[2];
    u.segment<3>(3 * static_cast<Eigen::Index>(n)) = kMillimetresPerMetre * position_m - mesh.nodes_mm[n];
  }
  return u;
}

}  // namespace

PublishedLiver read_published_liver(const std::string& load) {
  const std::filesystem::path folder = reference_data() / "mestdagh_liver";
  PublishedLiver liver;
  liver.mesh = read_mesh(folder / "liver.msh");
  liver.clamped = read_numbers(folder / "fixed_vertices.txt");
  liver.loaded = read_numbers(folder / load / "force_vertices.txt");
  std::ifstream forces(folder / load / "true_forces_N.csv");
  forces.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
  PublishedLiver::Frame frame;
  for (char comma;
       forces >> frame.number >> comma >> frame.force_N[0] >> comma >> frame.force_N[1] >> comma >> frame.force_N[2];) {
    const auto positions = folder / load / fmt::format("positions_{:02}.txt", frame.number);
    if (!std::filesystem::exists(positions)) continue;
    frame.u = read_displacement(positions, liver.mesh);
    liver.frames.push_back(frame);
    std::erase_if(liver.clamped, [&frame](int node) { return frame.u.segment<3>(3 * node).norm() > 1e-6; });
  }
  return liver;
}

std::map<int, Vec3> held_nodes(const PublishedLiver& liver, const PublishedLiver::Frame& frame) {
  std::map<int, Vec3> held;
  for (int node : liver.clamped) held[node] = Vec3::Zero();
  for (int node : liver.loaded) held[node] = frame.u.segment<3>(3 * node);
  return held;
}

Vec3 net_force(const PublishedLiver& liver, const Eigen::VectorXd& force_N) {
  Vec3 sum = Vec3::Zero();
  for (int node : liver.loaded) sum += force_N.segment<3>(3 * node);
  return sum;
}

}  // namespace palpate::test
