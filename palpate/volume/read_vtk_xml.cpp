#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <istream>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>

#include "palpate/core/errors.h"
#include "palpate/volume/polygon_soup.h"

namespace palpate {

namespace {

constexpr int kVtkPolygon = 7, kVtkTriangleStrip = 6;

class LegacyReader {
 public:
  explicit LegacyReader(std::istream& stream) : stream_(stream) {}

  CellSoup read() {
    std::string line, encoding, word;
    std::getline(stream_, line);
    if (line.rfind("# vtk DataFile", 0) != 0) throw BadInput("not a VTK file");
    std::getline(stream_, line);
    stream_ >> encoding;
    if (encoding != "ASCII") throw BadInput(fmt::format("legacy VTK file in {}, expected ASCII", encoding));
    while (stream_ >> word && word != "POINT_DATA" && word != "CELL_DATA") {
      if (word == "POINTS") read_points();
      if (word == "CELLS") read_cells(0);
      if (word == "POLYGONS") read_cells(kVtkPolygon);
      if (word == "TRIANGLE_STRIPS") read_cells(kVtkTriangleStrip);
      if (word == "CELL_TYPES") read_types();
    }
    if (soup_.points.empty()) throw BadInput("no points in it");
    return std::move(soup_);
  }

 private:
  template <class Number>
  Number number() {
    Number value{};
    if (!(stream_ >> value)) throw BadInput("a number is missing");
    return value;
  }

  void read_points() {
    const long count = number<long>();
    std::string type;
    stream_ >> type;
    for (long i = 0; i < count; ++i) {
      const double x = number<double>(), y = number<double>(), z = number<double>();
      soup_.points.emplace_back(x, y, z);
    }
  }

  /// Up to version 4 each cell begins with its number of nodes, since 5 there are offsets and connectivity.
  void read_cells(int type) {
    const long first = number<long>(), second = number<long>();
    std::string word;
    const auto place = stream_.tellg();
    stream_ >> word;
    if (word == "OFFSETS") {
      std::vector<long> offsets, nodes;
      stream_ >> word;
      for (long i = 0; i < first; ++i) offsets.push_back(number<long>());
      stream_ >> word >> word;
      for (long i = 0; i < second; ++i) nodes.push_back(number<long>());
      for (size_t i = 1; i < offsets.size(); ++i) {
        if (offsets[i - 1] < 0 || offsets[i] < offsets[i - 1] || offsets[i] > second)
          throw BadInput("broken cell offsets");
        add_cell(type, {nodes.begin() + offsets[i - 1], nodes.begin() + offsets[i]});
      }
      return;
    }
    stream_.clear();
    stream_.seekg(place);
    for (long i = 0; i < first; ++i) {
      std::vector<long> nodes(number<unsigned>());
      for (long& node : nodes) node = number<long>();
      add_cell(type, nodes);
    }
  }

  void add_cell(int type, const std::vector<long>& nodes) {
    soup_.cells.emplace_back(nodes.begin(), nodes.end());
    soup_.types.push_back(type);
  }

  void read_types() {
    const long count = number<long>();
    if (count != static_cast<long>(soup_.types.size())) throw BadInput("as many cell types as cells are expected");
    for (int& type : soup_.types) type = number<int>();
  }

  std::istream& stream_;
  CellSoup soup_;
};

/// One start tag of an XML file: its attributes, and where its content begins.
struct Tag {
  std::string_view attributes;
  size_t content = 0;

  std::string attribute(std::string_view name, const std::string& fallback = "") const {
    for (size_t at = attributes.find(name); at != std::string_view::npos; at = attributes.find(name, at + 1)) {
      const size_t equals = at + name.size();
      if (at > 0 && !std::isspace(static_cast<unsigned char>(attributes[at - 1]))) continue;
      if (equals + 1 >= attributes.size() || attributes[equals] != '=') continue;
      const char quote = attributes[equals + 1];
      const size_t end = attributes.find(quote, equals + 2);
      return std::string(attributes.substr(equals + 2, end - equals - 2));
    }
    return fallback;
  }
};

std::optional<Tag> next_tag(std::string_view text, std::string_view name, size_t from, size_t until) {
  const std::string start = "<" + std::string(name);
  for (size_t at = text.find(start, from); at < until; at = text.find(start, at + 1)) {
    const size_t after = at + start.size();
    if (after >= text.size() || std::isalnum(static_cast<unsigned char>(text[after]))) continue;
    const size_t end = text.find('>', after);
    if (end == std::string_view::npos) break;
    return Tag{text.substr(after, end - after), end + 1};
  }
  return std::nullopt;
}

size_t end_of(std::string_view text, std::string_view name, size_t from) {
  const size_t at = text.find("</" + std::string(name) + ">", from);
  if (at == std::string_view::npos) throw BadInput(fmt::format("<{}> does not end", name));
  return at;
}

/// Base64 up to the first character that is none; header and data may be padded apart, as some writers do.
std::string from_base64(std::string_view text) {
  std::string bytes;
  uint32_t group = 0;
  int digits = 0, padding = 0;
  for (char c : text) {
    if (std::isspace(static_cast<unsigned char>(c))) continue;
    int value = 0;
    if (c >= 'A' && c <= 'Z')
      value = c - 'A';
    else if (c >= 'a' && c <= 'z')
      value = c - 'a' + 26;
    else if (c >= '0' && c <= '9')
      value = c - '0' + 52;
    else if (c == '+' || c == '/')
      value = c == '+' ? 62 : 63;
    else if (c == '=')
      ++padding;
    else
      break;
    group = group << 6 | static_cast<uint32_t>(value);
    if (++digits < 4) continue;
    for (int k = 0; k < 3 - padding; ++k) bytes += static_cast<char>(group >> (16 - 8 * k) & 255);
    group = 0;
    digits = padding = 0;
  }
  return bytes;
}

template <class Number>
void convert(std::string_view bytes, std::vector<double>& values) {
  for (size_t at = 0; at + sizeof(Number) <= bytes.size(); at += sizeof(Number)) {
    Number value;
    std::memcpy(&value, bytes.data() + at, sizeof value);
    values.push_back(static_cast<double>(value));
  }
}

class VtuReader {
 public:
  explicit VtuReader(std::string_view text) : text_(text) {
    const auto file = next_tag(text_, "VTKFile", 0, text_.size());
    if (!file || file->attribute("type") != "UnstructuredGrid") throw BadInput("no VTKFile of type UnstructuredGrid");
    if (file->attribute("byte_order", "LittleEndian") != "LittleEndian")
      throw BadInput("big-endian numbers, expected little-endian");
    is_compressed_ = !file->attribute("compressor").empty();
    header_size_ = file->attribute("header_type", "UInt32") == "UInt64" ? 8 : 4;
    if (const auto appended = next_tag(text_, "AppendedData", 0, text_.size())) {
      appended_encoding_ = appended->attribute("encoding", "raw");
      appended_ = text_.find('_', appended->content) + 1;
    }
  }

  CellSoup read() {
    CellSoup soup;
    size_t from = 0;
    while (const auto piece = next_tag(text_, "Piece", from, text_.size())) {
      from = piece->content;
      add_piece(soup);
    }
    if (soup.points.empty()) throw BadInput("no points in it");
    return soup;
  }

 private:
  void add_piece(CellSoup& soup) {
    const auto before = static_cast<int>(soup.points.size());
    size_t from = piece_begin_;
    const auto points_tag = next_tag(text_, "Points", from, text_.size());
    const auto cells_tag = next_tag(text_, "Cells", from, text_.size());
    if (!points_tag || !cells_tag) throw BadInput("no <Points> or no <Cells>");
    const std::vector<double> xyz = array(*points_tag, end_of(text_, "Points", points_tag->content), "");
    const size_t cells_end = end_of(text_, "Cells", cells_tag->content);
    const std::vector<double> nodes = array(*cells_tag, cells_end, "connectivity"),
                              offsets = array(*cells_tag, cells_end, "offsets"),
                              types = array(*cells_tag, cells_end, "types");
    if (offsets.size() != types.size()) throw BadInput("as many cell types as offsets are expected");
    for (size_t i = 0; i + 2 < xyz.size(); i += 3) soup.points.emplace_back(xyz[i], xyz[i + 1], xyz[i + 2]);
    double begin = 0;
    for (size_t i = 0; i < offsets.size(); ++i) {
      if (offsets[i] < begin || offsets[i] > static_cast<double>(nodes.size())) throw BadInput("broken cell offsets");
      std::vector<int> cell;
      for (auto k = static_cast<size_t>(begin); k < static_cast<size_t>(offsets[i]); ++k)
        cell.push_back(static_cast<int>(nodes[k]) + before);
      soup.cells.push_back(std::move(cell));
      soup.types.push_back(static_cast<int>(types[i]));
      begin = offsets[i];
    }
    piece_begin_ = std::max(cells_end, points_tag->content);
  }

  /// The DataArray `name` (the first one where `name` is empty) inside a tag.
  std::vector<double> array(const Tag& parent, size_t until, std::string_view name) const {
    size_t from = parent.content;
    while (const auto tag = next_tag(text_, "DataArray", from, until)) {
      from = tag->content;
      if (name.empty() || tag->attribute("Name") == name) return values(*tag);
    }
    throw BadInput(fmt::format("no DataArray {}", name));
  }

  std::vector<double> values(const Tag& tag) const {
    const std::string format = tag.attribute("format", "ascii"), type = tag.attribute("type");
    std::vector<double> result;
    if (format == "ascii") {
      std::istringstream stream{std::string(text_.substr(tag.content, text_.find('<', tag.content) - tag.content))};
      for (double value = 0; stream >> value;) result.push_back(value);
      return result;
    }
    if (is_compressed_) throw BadInput("compressed data, expected a file written without compressor");
    std::string decoded;
    std::string_view bytes;
    if (format == "binary") {
      decoded = from_base64(text_.substr(tag.content, text_.find('<', tag.content) - tag.content));
      bytes = decoded;
    } else {
      const size_t offset = appended_ + static_cast<size_t>(std::stoull(tag.attribute("offset", "0")));
      if (appended_ == 0 || offset >= text_.size()) throw BadInput("appended data are missing");
      bytes = text_.substr(offset);
      if (appended_encoding_ == "base64") bytes = decoded = from_base64(bytes);
    }
    uint64_t size = 0;
    if (bytes.size() < header_size_) throw BadInput("binary data are cut short");
    std::memcpy(&size, bytes.data(), header_size_);
    bytes.remove_prefix(header_size_);
    if (size > bytes.size()) throw BadInput("binary data are cut short");
    bytes = bytes.substr(0, size);
    if (type == "Float64")
      convert<double>(bytes, result);
    else if (type == "Float32")
      convert<float>(bytes, result);
    else if (type == "Int64" || type == "UInt64")
      convert<int64_t>(bytes, result);
    else if (type == "Int32" || type == "UInt32")
      convert<int32_t>(bytes, result);
    else if (type == "Int8" || type == "UInt8")
      convert<uint8_t>(bytes, result);
    else
      throw BadInput(fmt::format("numbers of type {} are not supported", type));
    return result;
  }

  std::string_view text_;
  bool is_compressed_ = false;
  size_t header_size_ = 4;
  std::string appended_encoding_;
  size_t appended_ = 0;
  size_t piece_begin_ = 0;
};

}  // namespace

CellSoup read_vtk_legacy(std::istream& stream) {
  return LegacyReader(stream).read();
}

CellSoup read_vtu(const std::string& text) {
  return VtuReader(text).read();
}

}  // namespace palpate
