#include "palpate/feedback/warnings.h"

#include <sstream>

namespace palpate {

const std::vector<std::pair<std::string, std::string>>& known_warnings() {
  static const std::vector<std::pair<std::string, std::string>> kWarnings = {
      {"law_out_of_range", "tissue deformed beyond the law's range"},
      {"inverted_elements", "elements of the map turned inside out"},
      {"near_attachment", "contact close to where the tissue is held"},
      {"near_map_edge", "contact at the edge of the tissue that was seen"},
      {"contact_outside_map", "the tip touches tissue that is not in the map"},
      {"modulus_unknown", "Young's modulus unknown: force in N per kPa"},
      {"tip_inferred", "tip hidden, the tissue tells the force"},
      {"camera_missing", "one camera has no picture"},
      {"source_lost", "the live source gives no pictures"},
      {"sliding", "the tip slides over the tissue"},
      {"frame_passed_over", "the next frame was there before this one could be looked at"},
      {"eyes_out_of_step", "the two videos do not show the same moment"},
  };
  return kWarnings;
}

std::string warning_words(const std::string& name) {
  for (const auto& [known, words] : known_warnings())
    if (known == name) return words;
  return name;
}

std::map<std::string, int> count_warnings(const std::vector<ForceRow>& rows) {
  std::map<std::string, int> frames;
  for (const ForceRow& row : rows) {
    std::istringstream names(row.warnings);
    for (std::string name; std::getline(names, name, ';');) ++frames[name];
  }
  return frames;
}

}  // namespace palpate
