#include "palpate/feedback/csv_table.h"

#include <fmt/format.h>

#include <charconv>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <sstream>

#include "palpate/core/errors.h"

namespace palpate {
namespace {

constexpr const char* kByteOrderMark = "\xEF\xBB\xBF";

std::string trimmed(const std::string& text) {
  const size_t first = text.find_first_not_of(" \t");
  if (first == std::string::npos) return "";
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

/// A field that begins with a quote ends with one, and a doubled quote inside it is one; elsewhere quotes are text.
std::vector<CsvTable::Row> split(const std::string& text) {
  std::vector<CsvTable::Row> rows;
  CsvTable::Row row;
  std::string field;
  bool quoted = false;
  int line = 1;
  const auto end_row = [&] {
    const bool empty = row.fields.empty() && trimmed(field).empty();
    row.fields.push_back(field);
    if (!empty) rows.push_back(row);
    row = {line + 1, {}};
    field.clear();
  };
  row.line = line;
  for (size_t i = 0; i < text.size(); ++i) {
    const char c = text[i], next = i + 1 < text.size() ? text[i + 1] : '\0';
    const bool ends_row = c == '\n' || (c == '\r' && next != '\n');
    if (quoted && c == '"' && next == '"') {
      field += text[++i];
    } else if (c == '"' && (quoted || field.empty())) {
      quoted = !quoted;
    } else if (!quoted && c == ',') {
      row.fields.push_back(field);
      field.clear();
    } else if (!quoted && ends_row) {
      end_row();
    } else if (quoted || c != '\r') {
      field += c;
    }
    if (c == '\n') ++line;
  }
  end_row();
  return rows;
}

}  // namespace

CsvTable::CsvTable(const std::filesystem::path& file) {
  if (const std::string obstacle = obstacle_to_reading(file); !obstacle.empty())
    throw BadInput(fmt::format("{} {}, expected a table with comma-separated columns", file.string(), obstacle));
  std::ostringstream content;
  content << std::ifstream(file, std::ios::binary).rdbuf();
  std::string text = content.str();
  if (text.starts_with(kByteOrderMark)) text.erase(0, 3);
  rows_ = split(text);
  if (rows_.empty()) return;
  for (size_t i = 0; i < rows_.front().fields.size(); ++i) column_[trimmed(rows_.front().fields[i])] = i;
  rows_.erase(rows_.begin());
}

std::string CsvTable::text(const Row& row, const std::string& column) const {
  const auto found = column_.find(column);
  return found == column_.end() || found->second >= row.fields.size() ? "" : trimmed(row.fields[found->second]);
}

double CsvTable::number(const Row& row, const std::string& column) const {
  std::string field = text(row, column);
  if (field.starts_with('+')) field.erase(0, 1);
  double value = 0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  if (error == std::errc::result_out_of_range) return std::strtod(field.c_str(), nullptr);
  const bool whole = error == std::errc() && end == field.data() + field.size();
  return whole ? value : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace palpate
