#include "tests/support/calculix.h"

#include <fmt/format.h>
#include <stdlib.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace palpate::test {

namespace {

namespace fs = std::filesystem;

/// Of a quadratic tetrahedron: its two ends and its middle.
constexpr std::array<std::array<size_t, 3>, 6> kEdges = {
    {{0, 1, 4}, {1, 2, 5}, {2, 0, 6}, {0, 3, 7}, {1, 3, 8}, {2, 3, 9}}};

/// A folder of its own that goes when the test is done.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (fs::temp_directory_path() / "palpate-calculix-XXXXXX").string();
    if (!mkdtemp(name.data())) throw std::runtime_error("no temporary folder for CalculiX");
    path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

/// CalculiX reads no more than 20 characters of a number.
std::string number(double value) {
  return fmt::format("{:.12e}", value);
}

std::string material_of(const TissueOptions& tissue) {
  const Lame lame = lame_of(tissue);
  switch (tissue.law) {
    case Law::saint_venant_kirchhoff:
    case Law::linear:
      return fmt::format("*ELASTIC\n{},{}\n", number(tissue.young_modulus_MPa()), number(tissue.poisson_ratio));
    case Law::neo_hookean:
      return fmt::format("*HYPERELASTIC,NEO HOOKE\n{},{}\n", number(lame.mu / 2), number(2 / bulk_modulus(lame)));
    case Law::saint_venant_kirchhoff_barrier:
    case Law::corotated:
      break;
  }
  throw std::invalid_argument("CalculiX has no law " + law_name(tissue.law));
}

/// Body and law, elements of any kind.
template <size_t N>
void write_body(std::ofstream& deck, const std::vector<Vec3>& nodes_mm, const std::vector<std::array<int, N>>& elements,
                const TissueOptions& tissue) {
  deck << "*NODE,NSET=NALL\n";
  for (size_t n = 0; n < nodes_mm.size(); ++n) {
    const Vec3& x = nodes_mm[n];
    deck << fmt::format("{},{},{},{}\n", n + 1, number(x[0]), number(x[1]), number(x[2]));
  }
  deck << "*ELEMENT,TYPE=C3D" << N << ",ELSET=EALL\n";
  for (size_t e = 0; e < elements.size(); ++e) {
    deck << e + 1;
    for (int node : elements[e]) deck << ',' << node + 1;
    deck << '\n';
  }
  deck << "*MATERIAL,NAME=TISSUE\n" << material_of(tissue) << "*SOLID SECTION,ELSET=EALL,MATERIAL=TISSUE\n";
}

void write_step(std::ofstream& deck, const TissueOptions& tissue, const Imposed& imposed_mm, double first_step,
                double tolerance) {
  if (tissue.law == Law::linear) {
    deck << "*STEP\n*STATIC\n";
  } else {
    deck << fmt::format("*STEP,NLGEOM,INC=1000\n*STATIC\n{0},1.0,1e-6,{0}\n", first_step);
    deck << fmt::format("*CONTROLS,PARAMETERS=FIELD\n{0},{0},,,,,{0}\n", tolerance);
  }
  deck << "*BOUNDARY\n";
  for (const auto& [node, u] : imposed_mm)
    for (int i = 0; i < 3; ++i)
      if (!std::isnan(u[i])) deck << fmt::format("{0},{1},{1},{2}\n", node + 1, i + 1, number(u[i]));
  deck << "*NODE PRINT,NSET=NALL,FREQUENCY=1000\nU,RF\n";
}

std::string end_of(const fs::path& file) {
  std::ifstream stream(file);
  std::string text((std::istreambuf_iterator<char>(stream)), {});
  return text.size() > 1000 ? text.substr(text.size() - 1000) : text;
}

/// Blocks of "number value value ..." under a heading; a later block of the same kind replaces the earlier one.
CalculixAnswer read_answer(const fs::path& file, size_t nodes, size_t stresses) {
  CalculixAnswer answer;
  answer.u = answer.reaction = Eigen::VectorXd::Zero(3 * static_cast<Eigen::Index>(nodes));
  answer.stress_MPa.assign(stresses, Mat3::Zero());
  std::ifstream stream(file);
  std::string line, heading;
  size_t rows = 0;
  while (std::getline(stream, line)) {
    std::istringstream words(line);
    size_t index = 0;
    if (!(words >> index)) {
      if (std::string first; std::istringstream(line) >> first) heading = first;
      continue;
    }
    ++rows;
    Vec3 value;
    if (heading == "displacements" && words >> value[0] >> value[1] >> value[2]) {
      answer.u.segment<3>(3 * static_cast<Eigen::Index>(index - 1)) = value;
    } else if (heading == "forces" && words >> value[0] >> value[1] >> value[2]) {
      answer.reaction.segment<3>(3 * static_cast<Eigen::Index>(index - 1)) = value;
    } else if (heading == "stresses") {
      Mat3& s = answer.stress_MPa[index - 1];
      int point = 0;
      words >> point >> s(0, 0) >> s(1, 1) >> s(2, 2) >> s(0, 1) >> s(0, 2) >> s(1, 2);
      s.triangularView<Eigen::StrictlyLower>() = s.transpose();
    }
  }
  if (rows < 2 * nodes + stresses)
    throw std::runtime_error("CalculiX has not finished:\n" + end_of(file.parent_path() / "log"));
  return answer;
}

void run_in(const fs::path& folder) {
  const std::string command = fmt::format("cd '{}' && OMP_NUM_THREADS=1 ccx deck >log 2>&1", folder.string());
  if (std::system(command.c_str()) != 0) throw std::runtime_error("CalculiX has failed:\n" + end_of(folder / "log"));
}

}  // namespace

bool calculix_is_installed() {
  return std::system("command -v ccx >/dev/null 2>&1") == 0;
}

CalculixAnswer run_calculix(const TetMesh& mesh, const TissueOptions& tissue, const Imposed& imposed_mm) {
  const TemporaryFolder folder;
  std::ofstream deck(folder.path() / "deck.inp");
  write_body(deck, mesh.nodes_mm, mesh.tetrahedra, tissue);
  write_step(deck, tissue, imposed_mm, 0.1, 1e-8);
  deck << "*EL PRINT,ELSET=EALL,FREQUENCY=1000\nS\n*END STEP\n";
  deck.close();
  run_in(folder.path());
  return read_answer(folder.path() / "deck.dat", mesh.nodes_mm.size(), mesh.tetrahedra.size());
}

QuadraticMesh with_midside_nodes(const TetMesh& mesh) {
  QuadraticMesh quadratic{mesh.nodes_mm, {}};
  std::map<std::pair<int, int>, int> middle_of;
  for (const Tetrahedron& t : mesh.tetrahedra) {
    std::array<int, 10> nodes = {t[0], t[1], t[2], t[3]};
    for (const auto& [first, second, middle] : kEdges) {
      const int a = t[first], b = t[second];
      const auto [entry, is_new] =
          middle_of.try_emplace(std::minmax(a, b), static_cast<int>(quadratic.nodes_mm.size()));
      if (is_new)
        quadratic.nodes_mm.push_back((mesh.nodes_mm[static_cast<size_t>(a)] + mesh.nodes_mm[static_cast<size_t>(b)]) /
                                     2);
      nodes[middle] = entry->second;
    }
    quadratic.tetrahedra.push_back(nodes);
  }
  return quadratic;
}

Imposed with_midside_nodes(const QuadraticMesh& mesh, const Imposed& imposed_mm) {
  Imposed all = imposed_mm;
  for (const std::array<int, 10>& t : mesh.tetrahedra)
    for (const auto& [a, b, middle] : kEdges) {
      const auto at_a = imposed_mm.find(t[a]), at_b = imposed_mm.find(t[b]);
      if (at_a == imposed_mm.end() || at_b == imposed_mm.end()) continue;
      const Vec3 mean = (at_a->second + at_b->second) / 2;
      if (!mean.array().isNaN().all()) all[t[middle]] = mean;
    }
  return all;
}

CalculixAnswer run_calculix(const QuadraticMesh& mesh, const TissueOptions& tissue, const Imposed& imposed_mm,
                            double first_step) {
  const TemporaryFolder folder;
  std::ofstream deck(folder.path() / "deck.inp");
  write_body(deck, mesh.nodes_mm, mesh.tetrahedra, tissue);
  write_step(deck, tissue, imposed_mm, first_step, 1e-5);
  deck << "*END STEP\n";
  deck.close();
  run_in(folder.path());
  return read_answer(folder.path() / "deck.dat", mesh.nodes_mm.size(), 0);
}

}  // namespace palpate::test
