#include "palpate/elastic/colored_batches.h"

#include <map>
#include <tuple>

namespace palpate {

ColoredBatches color_batches(const std::vector<int>& min_slab, const std::vector<int>& max_slab, int slabs) {
  enum Color { within, across_even, across_odd, wide };
  std::map<std::pair<Color, int>, std::vector<int>> ranges;
  for (size_t i = 0; i < min_slab.size(); ++i) {
    const int min = min_slab[i], borders = max_slab[i] - min;
    const Color batch = borders == 0 ? within : borders > 1 ? wide : min % 2 == 0 ? across_even : across_odd;
    ranges[{batch, batch == wide ? slabs : min}].push_back(static_cast<int>(i));
  }
  ColoredBatches result;
  result.order.reserve(min_slab.size());
  std::map<Color, std::vector<ColoredBatches::Range>> by_phase;
  for (const auto& [key, items] : ranges) {
    const auto begin = static_cast<int>(result.order.size());
    result.order.insert(result.order.end(), items.begin(), items.end());
    by_phase[key.first].push_back({begin, static_cast<int>(result.order.size())});
  }
  for (auto& [batch, of_phase] : by_phase) result.batches.push_back(std::move(of_phase));
  return result;
}

}  // namespace palpate
