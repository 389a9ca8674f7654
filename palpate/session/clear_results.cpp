#include "palpate/session/clear_results.h"

#include <fmt/format.h>

#include <string>

#include "palpate/core/errors.h"

namespace palpate {

namespace {

constexpr const char* kResults[] = {"forces.csv",     "forces_2.csv", "overlay.mp4", "report.html", "run.yaml",
                                    "map.vtu",        "surface.ply",  "cloud.ply",   "preview.png", "map.json",
                                    "confidence.png", "marks.csv",    "shapes.bin"};
constexpr const char* kSequence[] = {"left.mp4",    "right.mp4",        "truth.csv",
                                     "truth_2.csv", "calibration.yaml", "scene.yaml"};

template <class Names>
void begin(const std::filesystem::path& folder, const Names& names, const std::filesystem::path& input) {
  std::error_code error, ignored;
  std::filesystem::create_directories(folder, error);
  for (const char* name : names)
    for (const char* ending : {"", ".part"}) {
      const std::filesystem::path file = folder / (std::string(name) + ending);
      if (!error && !std::filesystem::equivalent(file, input, ignored)) std::filesystem::remove(file, error);
    }
  if (error) throw Unfinished(fmt::format("{} cannot be made ready for results: {}", folder.string(), error.message()));
}

}  // namespace

void begin_results(const std::filesystem::path& folder, const std::vector<std::string>& sources) {
  std::error_code ignored;
  for (const char* name : kResults)
    for (const std::string& source : sources)
      if (std::filesystem::equivalent(folder / name, source, ignored))
        throw BadInput(fmt::format("results in {} would replace {}, which the scene reads; expected another folder",
                                   folder.string(), source));
  begin(folder, kResults, {});
}

void begin_sequence(const std::filesystem::path& folder, const std::filesystem::path& input) {
  begin(folder, kSequence, input);
}

}  // namespace palpate
