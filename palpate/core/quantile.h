#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace palpate {

/// The value below which `fraction` (0 to 1) of the others lie: the nearest one of them; 0 where there are none.
template <class Value>
Value quantile_of(std::vector<Value> values, double fraction) {
  if (values.empty()) return {};
  const auto place = values.begin() + std::lround(fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

/// median_of() that moves the values about, for inner loops.
template <class Value>
Value median_in_place(std::vector<Value>& values) {
  if (values.empty()) return {};
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The value in the middle, of an even number the upper one of both; 0 where there are none.
template <class Value>
Value median_of(std::vector<Value> values) {
  return median_in_place(values);
}

}  // namespace palpate
