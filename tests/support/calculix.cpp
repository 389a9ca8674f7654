#include "tests/support/calculix.h"

#include <fmt/format.h>
#include <stdlib.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace palpate::test {

namespace {

namespace fs = std::filesystem;

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
    case Law::corotated:
      break;
  }
  throw std::invalid_argument("CalculiX has no law " + law_name(tissue.law));
}

void write_deck(const fs::path& file, const TetMesh& mesh, const TissueOptions& tissue,
                const std::map<int, Vec3>& imposed_mm) {
  std::ofstream deck(file);
  deck << "*NODE,NSET=NALL\n";
  for (size_t n = 0; n < mesh.nodes_mm.size(); ++n) {
    const Vec3& x = mesh.nodes_mm[n];
    deck << fmt::format("{},{},{},{}\n", n + 1, number(x[0]), number(x[1]), number(x[2]));
  }
  deck << "*ELEMENT,TYPE=C3D4,ELSET=EALL\n";
  for (size_t e = 0; e < mesh.tetrahedra.size(); ++e) {
    const Tetrahedron& t = mesh.tetrahedra[e];
    deck << fmt::format("{},{},{},{},{}\n", e + 1, t[0] + 1, t[1] + 1, t[2] + 1, t[3] + 1);
  }
  deck << "*MATERIAL,NAME=TISSUE\n" << material_of(tissue) << "*SOLID SECTION,ELSET=EALL,MATERIAL=TISSUE\n";
  deck << (tissue.law == Law::linear ? "*STEP\n*STATIC\n" : "*STEP,NLGEOM,INC=1000\n*STATIC\n0.1,1.0,1e-6,0.1\n");
  if (tissue.law != Law::linear) deck << "*CONTROLS,PARAMETERS=FIELD\n1e-8,1e-8,,,,,1e-8\n";
  deck << "*BOUNDARY\n";
  for (const auto& [node, u] : imposed_mm)
    for (int i = 0; i < 3; ++i) deck << fmt::format("{0},{1},{1},{2}\n", node + 1, i + 1, number(u[i]));
  deck << "*NODE PRINT,NSET=NALL,FREQUENCY=1000\nU,RF\n*EL PRINT,ELSET=EALL,FREQUENCY=1000\nS\n*END STEP\n";
}

std::string end_of(const fs::path& file) {
  std::ifstream stream(file);
  std::string text((std::istreambuf_iterator<char>(stream)), {});
  return text.size() > 1000 ? text.substr(text.size() - 1000) : text;
}

/// Blocks of "number value value ..." under a heading; a later block of the same kind replaces the earlier one.
CalculixAnswer read_answer(const fs::path& file, const TetMesh& mesh) {
  CalculixAnswer answer;
  answer.u = answer.reaction = Eigen::VectorXd::Zero(3 * static_cast<Eigen::Index>(mesh.nodes_mm.size()));
  answer.stress_MPa.assign(mesh.tetrahedra.size(), Mat3::Zero());
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
  if (rows < 2 * mesh.nodes_mm.size() + mesh.tetrahedra.size())
    throw std::runtime_error("CalculiX has not finished:\n" + end_of(file.parent_path() / "log"));
  return answer;
}

}  // namespace

bool calculix_is_installed() {
  return std::system("command -v ccx >/dev/null 2>&1") == 0;
}

CalculixAnswer run_calculix(const TetMesh& mesh, const TissueOptions& tissue, const std::map<int, Vec3>& imposed_mm) {
  const TemporaryFolder folder;
  write_deck(folder.path() / "deck.inp", mesh, tissue, imposed_mm);
  const std::string command = fmt::format("cd '{}' && OMP_NUM_THREADS=1 ccx deck >log 2>&1", folder.path().string());
  if (std::system(command.c_str()) != 0)
    throw std::runtime_error("CalculiX has failed:\n" + end_of(folder.path() / "log"));
  return read_answer(folder.path() / "deck.dat", mesh);
}

}  // namespace palpate::test
