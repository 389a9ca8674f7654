#pragma once

#include <vector>

#include "palpate/core/table.h"

namespace palpate {

/// The columns that tell when a row was taken, for the list of those that a table is asked for.
std::vector<TableColumn> time_columns();

/// What is known about the clock of a table before its unit is.
struct TimeHints {
  /// What the rows belong to lasts so long, s; 0 = not known. They have to cover half of it.
  double span_s = 0;
  /// Longest and shortest step between rows that is credible, s.
  double longest_step_s = 0.2;
  double shortest_step_s = 2e-5;
};

/// Seconds of each row, NaN where it states none: a number in s, ms, us or ns (by the header, else by which of them the
/// hints allow), seconds and nanoseconds of ROS in two columns, or a time of day with or without its date (`1:05:07.010
/// PM`, `13:05:07:010`, `2025-11-03T13:05:07.010`), then counted from midnight of the first day. Rows of a logger that
/// writes whole seconds lie evenly within them. Throws BadInput where there is no such column, no unit fits, or whole
/// seconds hold different numbers of rows; the sentence shows the value.
std::vector<double> times_s(const Table& table, const TimeHints& hints);

}  // namespace palpate
