#include "palpate/core/table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "palpate/core/errors.h"
#include "palpate/core/table_text.h"
#include "palpate/core/units.h"
#include "palpate/core/whole_file.h"

namespace palpate {

namespace {

/// The header stands within these.
constexpr int kLinesBeforeTable = 200;
/// From so many rows it is told how numbers are written.
constexpr size_t kRowsToJudge = 500;
constexpr size_t kLongestHeaderShown = 160;

std::string small(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

/// Index of the field that a header calls like this column; nothing where there is none.
std::optional<size_t> field_of(const TableColumn& column, const std::vector<std::string_view>& header) {
  std::vector<HeaderCell> cells;
  for (const std::string_view cell : header) {
    if (small(unquoted(cell)) == small(column.name)) return cells.size();
    cells.push_back(header_cell(cell));
  }
  std::vector<std::string> keys = {header_cell(column.name).key};
  for (const std::string& spelling : column.spellings) keys.push_back(header_cell(spelling).key);
  // Our own name means the same to others only where they do not offer a better one.
  if (keys.size() > 1) std::rotate(keys.begin(), keys.begin() + 1, keys.end());
  for (const std::string& key : keys) {
    for (size_t i = 0; i < cells.size(); ++i)
      if (cells[i].key == key) return i;
    for (size_t i = 0; i < cells.size(); ++i)
      if (cells[i].key.ends_with("." + key)) return i;
  }
  return std::nullopt;
}

size_t count_found(const std::vector<TableColumn>& columns, const std::vector<std::string_view>& header) {
  return static_cast<size_t>(
      std::count_if(columns.begin(), columns.end(), [&](const auto& c) { return field_of(c, header).has_value(); }));
}

bool is_comment(std::string_view line) {
  line = trimmed(line);
  return line.starts_with('#') || line.starts_with('%');
}

bool is_number(std::string_view cell) {
  std::string text = unquoted(cell);
  std::replace(text.begin(), text.end(), ',', '.');
  return std::isfinite(number_of(text));
}

bool is_in_brackets(std::string_view cell) {
  const std::string text = unquoted(cell);
  return text.size() > 1 &&
         ((text.front() == '(' && text.back() == ')') || (text.front() == '[' && text.back() == ']') ||
          (text.front() == '{' && text.back() == '}'));
}

/// "N", "(N)" and "[N]" are the same.
std::string without_brackets(std::string_view cell) {
  const std::string text = unquoted(cell);
  return is_in_brackets(cell) ? std::string(trimmed(std::string_view(text).substr(1, text.size() - 2))) : text;
}

/// Words only, with a unit among them, or all of them in brackets, which then are units that are not known.
bool names_units(const std::vector<std::string_view>& fields) {
  const auto is_empty = [](auto cell) { return unquoted(cell).empty(); };
  return std::none_of(fields.begin(), fields.end(), is_number) &&
         !std::all_of(fields.begin(), fields.end(), is_empty) &&
         (std::any_of(fields.begin(), fields.end(), [](auto cell) { return unit_of(without_brackets(cell)); }) ||
          std::all_of(fields.begin(), fields.end(), [&](auto cell) { return is_empty(cell) || is_in_brackets(cell); }));
}

/// Without the empty ones at the end, which a spreadsheet leaves there.
size_t count_filled(const std::vector<std::string_view>& fields) {
  size_t count = fields.size();
  while (count > 0 && unquoted(fields[count - 1]).empty()) --count;
  return count;
}

/// "Counts per Unit Force: 1000000.0" in two.
std::pair<std::string, std::string> key_and_value(std::string_view line) {
  const std::string text = unquoted(line);
  const size_t cut = text.find_first_of(":=;,\t");
  if (cut == std::string::npos) return {small(text), ""};
  return {small(unquoted(std::string_view(text).substr(0, cut))),
          unquoted(trimmed(std::string_view(text).substr(cut + 1)))};
}

}  // namespace

Table::Table(const std::filesystem::path& file, const std::vector<TableColumn>& columns) : file_(file) {
  if (const std::string obstacle = obstacle_to_reading(file); !obstacle.empty())
    throw BadInput(
        fmt::format("{} {}, expected a table with a header that names its columns", file.string(), obstacle));
  text_ = with_plain_minus(as_utf8(read_whole_file(file)));
  find_header(columns);

  LineSplitter lines(text_, separator_);
  std::vector<std::string_view> fields, header, units;
  struct {
    int line = 0;
    size_t values = 0;
  } too_long;
  while (lines.next(fields)) {
    const bool is_blank = trimmed(lines.whole()).empty();
    if (lines.line() < header_line_) {
      if (!is_blank) before_.push_back(key_and_value(lines.whole()));
    } else if (lines.line() == header_line_) {
      header = fields;
      // "# t x y" of numpy.savetxt: the mark is no column.
      if (fields.size() > 1 && (trimmed(fields[0]) == "#" || trimmed(fields[0]) == "%")) header.erase(header.begin());
    } else if (!is_blank && !is_comment(lines.whole())) {
      if (rows_.empty() && units.empty() && names_units(fields)) {
        units = fields;
        continue;
      }
      rows_.push_back({lines.line(), cells_.size(), fields.size()});
      cells_.insert(cells_.end(), fields.begin(), fields.end());
      if (const size_t values = count_filled(fields); too_long.line == 0 && values > header.size())
        too_long = {lines.line(), values};
    }
  }
  columns_.clear();
  for (const TableColumn& column : columns)
    if (const auto field = field_of(column, header)) columns_[column.name].index = *field;
  // Where the header names no column, that is what has to be said.
  if (too_long.line > 0 && !columns_.empty())
    throw BadInput(fmt::format("{}: line {} has {} values, the header {} columns{}; {}", file_.string(), too_long.line,
                               too_long.values, header.size(),
                               separator_ == ','
                                   ? ": where a comma both separates columns and marks decimals or thousands, expected "
                                     "semicolons between the columns, or quotes around the numbers"
                                   : ", expected one value in each column",
                               header_found()));
  place_columns(columns, header);
  if (!units.empty()) place_columns(columns, units);
  find_decimal_mark();
}

/// Separator and header together: the line that names most columns. Where none names any, the last line of words before
/// the first row of numbers is shown to the user as the header.
void Table::find_header(const std::vector<TableColumn>& columns) {
  size_t max = 0, fields_of_shown = 0;
  for (const char separator : {',', ';', '\t', '|', ' '}) {
    LineSplitter lines(text_, separator);
    std::vector<std::string_view> fields;
    std::string last_words;
    int last_line = 0;
    for (int i = 0; i < kLinesBeforeTable && lines.next(fields); ++i) {
      const size_t found = count_found(columns, fields);
      if (found > max) {
        max = found;
        separator_ = separator;
        header_line_ = lines.line();
        header_ = std::string(trimmed(lines.whole()));
      }
      const bool has_numbers = std::count_if(fields.begin(), fields.end(), is_number) > 1;
      if (!has_numbers && !trimmed(lines.whole()).empty() && fields_of_shown == 0) {
        last_words = std::string(trimmed(lines.whole()));
        last_line = lines.line();
      }
      if (max == 0 && has_numbers && fields.size() > fields_of_shown && last_line > 0) {
        fields_of_shown = fields.size();
        separator_ = separator;
        header_ = last_words;
        header_line_ = last_line;
      }
    }
  }
  if (header_line_ > 0) return;
  LineSplitter lines(text_, separator_);
  std::vector<std::string_view> fields;
  while (lines.next(fields) && trimmed(lines.whole()).empty()) {
  }
  header_ = std::string(trimmed(lines.whole()));
  header_line_ = lines.line();
}

void Table::place_columns(const std::vector<TableColumn>& columns, const std::vector<std::string_view>& units) {
  for (const TableColumn& column : columns) {
    const auto found = columns_.find(column.name);
    if (found == columns_.end()) continue;
    Place& place = found->second;
    const std::optional<Unit> wanted = unit_of(header_cell(column.name).unit);
    if (place.index >= units.size()) continue;
    const std::string_view cell = units[place.index];
    const bool is_unit = unit_of(without_brackets(cell)).has_value() || is_in_brackets(cell);
    const std::string stated = is_unit ? without_brackets(cell) : header_cell(cell).unit;
    if (stated.empty()) continue;
    place.unit = stated;
    const std::optional<Unit> unit = unit_of(place.unit);
    if (!wanted) continue;
    place.wrong_unit.clear();
    if (unit && unit->kind == wanted->kind)
      place.factor = unit->factor / wanted->factor;
    else if (unit || wanted->kind != Unit::Kind::time)  // "Time (hh:mm:ss)" is read as text
      place.wrong_unit =
          fmt::format("{}: column {} is in {}, expected {} or a unit that is turned into it; {}", file_.string(),
                      unquoted(column.name), place.unit, house_unit(wanted->kind), header_found());
  }
}

/// A comma marks decimals where numbers have commas and none has a point, or where it stands behind the points.
void Table::find_decimal_mark() {
  size_t commas = 0, points = 0, behind = 0;
  for (size_t i = 0; i < std::min(rows_.size(), kRowsToJudge); ++i)
    for (const auto& [name, place] : columns_) {
      const std::string cell = text(rows_[i], name);
      if (cell.find_first_not_of("+-0123456789.,eE ") != std::string::npos) continue;
      const size_t comma = cell.rfind(','), point = cell.rfind('.');
      commas += comma != std::string::npos;
      points += point != std::string::npos;
      behind += comma != std::string::npos && point != std::string::npos && comma > point;
    }
  decimal_comma_ = commas > 0 && (points == 0 || behind > 0);
}

void Table::require(const std::vector<std::string>& names) const {
  for (const std::string& name : names)
    if (!has(name)) throw BadInput(fmt::format("{}: no column {}; {}", file_.string(), name, header_found()));
}

std::string Table::text(const Row& row, const std::string& name) const {
  const auto found = columns_.find(name);
  if (found == columns_.end() || found->second.index >= row.cells) return "";
  return unquoted(cells_[row.first_cell + found->second.index]);
}

double Table::number(const Row& row, const std::string& name) const {
  const auto found = columns_.find(name);
  if (found == columns_.end() || found->second.index >= row.cells) return std::numeric_limits<double>::quiet_NaN();
  const Place& place = found->second;
  if (!place.wrong_unit.empty()) throw BadInput(place.wrong_unit);
  const std::string_view cell = trimmed(cells_[row.first_cell + place.index]);
  if (!decimal_comma_ && cell.find_first_of("\",") == std::string_view::npos) return number_of(cell) * place.factor;
  std::string number = unquoted(cell);
  const auto remove = [&number](char c) { number.erase(std::remove(number.begin(), number.end(), c), number.end()); };
  if (decimal_comma_) {
    remove('.');
    std::replace(number.begin(), number.end(), ',', '.');
  } else if (number.find('.') != std::string::npos) {
    remove(',');
  }
  return number_of(number) * place.factor;
}

std::string Table::stated_unit(const std::string& name) const {
  const auto found = columns_.find(name);
  return found == columns_.end() ? "" : found->second.unit;
}

std::optional<std::string> Table::before_header(const std::vector<std::string>& words) const {
  for (const auto& [key, value] : before_)
    if (std::all_of(words.begin(), words.end(),
                    [&key = key](const std::string& word) { return key.find(word) != std::string::npos; }))
      return value;
  return std::nullopt;
}

std::string Table::header_found() const {
  const bool is_long = header_.size() > kLongestHeaderShown;
  return fmt::format("the header in line {} is '{}{}'", header_line_, header_.substr(0, kLongestHeaderShown),
                     is_long ? "..." : "");
}

}  // namespace palpate
