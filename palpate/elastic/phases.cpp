#include "palpate/elastic/phases.h"

#include <map>
#include <tuple>

namespace palpate {

Phases order_in_phases(const std::vector<int>& least_slab, const std::vector<int>& most_slab, int slabs) {
  enum Phase { within, across_even, across_odd, wide };
  std::map<std::pair<Phase, int>, std::vector<int>> ranges;
  for (size_t i = 0; i < least_slab.size(); ++i) {
    const int least = least_slab[i], borders = most_slab[i] - least;
    const Phase phase = borders == 0 ? within : borders > 1 ? wide : least % 2 == 0 ? across_even : across_odd;
    ranges[{phase, phase == wide ? slabs : least}].push_back(static_cast<int>(i));
  }
  Phases result;
  result.order.reserve(least_slab.size());
  std::map<Phase, std::vector<Phases::Range>> by_phase;
  for (const auto& [key, items] : ranges) {
    const auto begin = static_cast<int>(result.order.size());
    result.order.insert(result.order.end(), items.begin(), items.end());
    by_phase[key.first].push_back({begin, static_cast<int>(result.order.size())});
  }
  for (auto& [phase, of_phase] : by_phase) result.phases.push_back(std::move(of_phase));
  return result;
}

}  // namespace palpate
