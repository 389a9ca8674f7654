#pragma once

#include <tbb/parallel_for.h>

#include <vector>

namespace palpate {

/// Items that add into shared nodes, ordered so that they can do so in parallel: the items of one phase stand in
/// ranges that have no node in common. Every entry is added up in the same order however many threads there are.
struct ColoredBatches {
  struct Range {
    int begin = 0, end = 0;  // of `order`
  };
  std::vector<int> order;  // item numbers
  std::vector<std::vector<Range>> batches;
};

/// `slab_of_node`: nodes sorted into slabs 0 .. slabs - 1 along one direction; `min_slab`, `max_slab`: of the nodes
/// of each item. Items within one slab come first, then those across one border, every other border at a time, then the
/// rest.
ColoredBatches color_batches(const std::vector<int>& min_slab, const std::vector<int>& max_slab, int slabs);

/// f(begin, end) for every range, those of one phase in parallel.
template <class Function>
void run_batches(const ColoredBatches& batches, Function f) {
  for (const std::vector<ColoredBatches::Range>& ranges : batches.batches) {
    if (ranges.size() == 1)
      f(ranges[0].begin, ranges[0].end);
    else
      tbb::parallel_for(size_t{0}, ranges.size(), [&](size_t r) { f(ranges[r].begin, ranges[r].end); });
  }
}

}  // namespace palpate
