#include "palpate/elastic/element_packs.h"

#include <algorithm>

namespace palpate {

ElementPacks pack_elements(ColoredBatches order, const std::vector<Tetrahedron>& tetrahedra,
                           const std::vector<Mat3>& inverse_rest_edges, const std::vector<double>& rest_volume_mm3,
                           const std::vector<int>& tissue, const std::vector<Lame>& lame) {
  const auto tissue_at = [&](int place) {
    return tissue[static_cast<size_t>(order.order[static_cast<size_t>(place)])];
  };
  ElementPacks result;
  for (const std::vector<ColoredBatches::Range>& ranges : order.batches) {
    result.batches.batches.emplace_back();
    for (const ColoredBatches::Range& range : ranges) {
      const auto begin = static_cast<int>(result.packs.size());
      std::stable_sort(order.order.begin() + range.begin, order.order.begin() + range.end,
                       [&](int a, int b) { return tissue[static_cast<size_t>(a)] < tissue[static_cast<size_t>(b)]; });
      for (int first = range.begin, last = first; first < range.end; first = last) {
        while (last < range.end && last < first + Simd::kCount && tissue_at(last) == tissue_at(first)) ++last;
        ElementPack& pack = result.packs.emplace_back();
        pack.lame = lame[static_cast<size_t>(tissue_at(first))];
        for (int lane = 0; lane < Simd::kCount; ++lane) {
          const bool exists = first + lane < last;
          const int e = order.order[static_cast<size_t>(exists ? first + lane : last - 1)];
          const auto l = static_cast<size_t>(lane), number = static_cast<size_t>(e);
          pack.element[l] = exists ? e : -1;
          pack.rest_volume_mm3.set(lane, exists ? rest_volume_mm3[number] : 0);
          for (int k = 0; k < 9; ++k) pack.inverse_rest_edges.data()[k].set(lane, inverse_rest_edges[number].data()[k]);
          for (size_t a = 0; a < 4; ++a) pack.first_value[a][l] = 3 * tetrahedra[number][a];
        }
      }
      result.batches.batches.back().push_back({begin, static_cast<int>(result.packs.size())});
    }
  }
  return result;
}

}  // namespace palpate
