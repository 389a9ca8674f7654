#include "palpate/session/run_folder.h"

#include <fmt/format.h>

#include "palpate/core/whole_file.h"

namespace palpate {

std::filesystem::path free_file(const std::filesystem::path& folder, const std::string& stem,
                                const std::string& ending) {
  std::filesystem::path file = folder / (stem + ending);
  for (int number = 2; std::filesystem::exists(file); ++number)
    file = folder / fmt::format("{}-{}{}", stem, number, ending);
  return file;
}

void write_marks(const RunView& run) {
  std::string text = "frame,time_s,text\n";
  for (const RunMark& mark : run.marks) {
    std::string quoted;
    for (char c : mark.text)
      quoted += c == '"' ? "\"\"" : static_cast<unsigned char>(c) < ' ' ? " " : std::string(1, c);
    text += fmt::format("{},{:.6g},\"{}\"\n", mark.frame, mark.time_s, quoted);
  }
  write_whole_file(run.folder / "marks.csv", text);
}

}  // namespace palpate
