#include "app/document_inputs.h"

#include <fmt/format.h>

#include "palpate/core/input_kind.h"
#include "palpate/stereo/input_kinds.h"
#include "palpate/volume/polygon_soup.h"

namespace palpate::app {

namespace {

std::string section(const std::string& title, const std::string& keys, const std::vector<InputKind>& kinds) {
  std::string text =
      fmt::format("\n## {}\n\n{}\n\n| what | written by | how it is read |\n|---|---|---|\n", title, keys);
  for (const InputKind& kind : kinds) text += fmt::format("| {} | {} | {} |\n", kind.kind, kind.written_by, kind.how);
  return text;
}

}  // namespace

std::string document_inputs() {
  return "# What is read, and from which tool\n\n"
         "Written by `./dev docs` from the readers' own lists; a test compares the two. What is not read is refused "
         "with one\n"
         "sentence that names what was found.\n" +
         section("Recordings", "`recording.left`, `recording.right`, `recording.stereo`.", recording_kinds()) +
         section("Calibrations",
                 "`recording.calibration`: recognised by structure and keys, whatever the name of the file.",
                 calibration_kinds()) +
         section("Meshes", "`map.volume`, `simulate.body.shape`: chosen by the ending of the name.", mesh_kinds()) +
         section("Tables", "`instrument.track`, `compare`, `compare --sensor`, truth.", table_kinds());
}

}  // namespace palpate::app
