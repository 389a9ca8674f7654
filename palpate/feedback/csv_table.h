#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace palpate {

/// Rows of a comma-separated file whose first row names the columns: in any order, with or without quotes (RFC 4180), a
/// byte order mark or CRLF. Empty lines are no rows.
class CsvTable {
 public:
  struct Row {
    int line = 0;  ///< of the file, from 1
    std::vector<std::string> fields;
  };

  /// Throws BadInput when the file cannot be read.
  explicit CsvTable(const std::filesystem::path& file);

  const std::vector<Row>& rows() const { return rows_; }
  bool has(const std::string& column) const { return column_.count(column) > 0; }

  /// Without blanks around it; "" where the row ends before the column, or the file has none of that name.
  std::string text(const Row& row, const std::string& column) const;

  /// NaN where the field is no number.
  double number(const Row& row, const std::string& column) const;

 private:
  std::map<std::string, size_t> column_;
  std::vector<Row> rows_;
};

}  // namespace palpate
