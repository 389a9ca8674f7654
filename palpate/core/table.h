#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace palpate {

/// What a reader looks for in a table.
struct TableColumn {
  std::string name;  ///< as our own files call it, with its unit: "fx_N"
  /// Of other programs, without unit, in order of preference. "force.x" is found in field.wrench.force.x as well;
  /// blanks, underscores and capital letters do not count.
  std::vector<std::string> spellings = {};
};

/// Rows of a text file with named columns, as whatever program wrote it: separated by commas, semicolons, tabs, bars or
/// blanks; numbers with a decimal point or comma; with or without quotes (RFC 4180), byte order mark, CRLF, UTF-16;
/// further columns; lines before the header; units in the header, `Fx (N)`, `t[ms]`, or in a line of their own below
/// it. Empty lines, and lines that begin with # or %, are no rows.
class Table {
 public:
  struct Row {
    int line = 0;  ///< of the file, from 1
    size_t first_cell = 0;
    size_t cells = 0;
  };

  /// The header is the line that names most of `columns`. Throws BadInput when the file cannot be read, or when a row
  /// has more values than the header has columns: which of them stands in which cannot be told.
  Table(const std::filesystem::path& file, const std::vector<TableColumn>& columns);

  const std::vector<Row>& rows() const { return rows_; }
  bool has(const std::string& name) const { return columns_.count(name) > 0; }

  /// Throws BadInput that shows the header which was found, where one of the columns is not there.
  void require(const std::vector<std::string>& names) const;

  /// Without blanks and quotes around it; "" where the row ends before the column, or the file has none of that name.
  std::string text(const Row& row, const std::string& name) const;

  /// In the unit that `name` ends with; NaN where the field is no number. Throws BadInput where the header states a
  /// unit that is none of that kind.
  double number(const Row& row, const std::string& name) const;

  /// The unit that the file states for a column, as it stands there; "" where it states none.
  std::string stated_unit(const std::string& name) const;

  /// Value of the first line before the header whose key holds all these words, in small letters: of "Counts per Unit
  /// Force: 1000000.0" it is "1000000.0".
  std::optional<std::string> before_header(const std::vector<std::string>& words) const;

  /// "the header in line 8 is 'Time, Fx, Fy, Fz'", for sentences.
  std::string header_found() const;

  const std::filesystem::path& file() const { return file_; }

 private:
  struct Place {
    size_t index = 0;  ///< of the field in a row
    std::string unit;
    double factor = 1;
    std::string wrong_unit;  ///< a sentence
  };

  void find_header(const std::vector<TableColumn>& columns);
  void place_columns(const std::vector<TableColumn>& columns, const std::vector<std::string_view>& units);
  void find_decimal_mark();

  std::filesystem::path file_;
  std::string text_;
  char separator_ = ',';
  bool decimal_comma_ = false;
  std::string header_;
  int header_line_ = 0;
  std::vector<std::pair<std::string, std::string>> before_;
  std::map<std::string, Place> columns_;
  std::vector<std::string_view> cells_;
  std::vector<Row> rows_;
};

}  // namespace palpate
