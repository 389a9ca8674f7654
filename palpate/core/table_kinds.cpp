#include "palpate/core/input_kind.h"

namespace palpate {

std::vector<InputKind> table_kinds() {
  return {
      {"comma-separated, RFC 4180", "Palpate, pandas, R, LibreOffice, dVRK",
       "any order of columns, further columns, quotes, byte order mark, CRLF, UTF-16"},
      {"semicolons, tabs, bars or blanks", "Excel and LabVIEW in German or French, MATLAB",
       "decimal comma, thousands' points; a row with more values than the header has columns is refused with its line"},
      {"lines before the table", "ATI, LabVIEW, Instron",
       "the header is the line that names the columns; a line of units may stand below it, `mN`, `[mN]` or `(mN)`"},
      {"names with units", "everybody",
       "`Fx (N)`, `t[ms]`, `x_mm`, `F/mN`, `Time in s`; N, mN, kN, lbf, kgf, mm, m, s, ms, us, ns"},
      {"names as paths", "rostopic, PlotJuggler, bagpy, dVRK `measured_cf`",
       "`field.wrench.force.x`, `/ft/wrench/force/x`, `header.stamp.secs` with `nsecs`"},
      {"time", "",
       "s, ms, us or ns: by the header, else by the unit that makes steps and length credible beside the video; a time "
       "of "
       "day, with or without its date; rows of one time are averaged, those of whole seconds spread evenly, time that "
       "runs backwards is refused with its "
       "line"},
      {"counts", "ATI Net F/T (Java demo)",
       "whole numbers are divided by `Counts per Unit Force` before the table, and refused without it; time by `RDT "
       "Sequence` and the rate, "
       "where the "
       "stamps agree with it"},
  };
}

}  // namespace palpate
