#pragma once

#include <vector>

namespace palpate {

/// The value below which `share` (0-1) of the values lie: the nearest one of them; 0 where there are none.
double quantile(std::vector<double> values, double share);

}  // namespace palpate
