#pragma once

#include <string>
#include <vector>

namespace palpate {

/// Smallest of 1, 2, 5 times a power of ten that is not below `value`; 1 where `value` is not positive.
double round_up(double value);

/// Round numbers (steps of 1, 2, 5 times a power of ten) within [least, most], about `count` of them, ascending.
std::vector<double> round_ticks(double min, double max, int count);

/// A tick without needless digits: "0", "0.5", "-20".
std::string tick_text(double tick);

/// A measured value with three significant digits: "12.3", "0.456", "1230".
std::string three_digits(double value);

}  // namespace palpate
