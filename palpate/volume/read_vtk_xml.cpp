#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <string>
#include <string_view>

#include "palpate/core/errors.h"
#include "palpate/core/table_text.h"
#include "palpate/volume/mesh_bytes.h"
#include "palpate/volume/polygon_soup.h"
#include "palpate/volume/vtk_compression.h"
#include "palpate/volume/vtk_numbers.h"

namespace palpate {

namespace {

constexpr int kVtkPolygon = 7, kVtkTriangleStrip = 6;

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
      if (end == std::string_view::npos) break;
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

/// Unstructured grid (.vtu) or polygons (.vtp), inline or appended, compressed or not.
class XmlReader {
 public:
  explicit XmlReader(std::string_view bytes) : text_(bytes) {
    if (const auto appended = next_tag(text_, "AppendedData", 0, text_.size())) {
      appended_encoding_ = appended->attribute("encoding", "raw");
      const size_t begin = text_.find('_', appended->content);
      if (begin != std::string_view::npos) appended_ = text_.substr(begin + 1);
      text_ = text_.substr(0, appended->content);  // no tags are looked for among raw bytes
    }
    const auto file = next_tag(text_, "VTKFile", 0, text_.size());
    const std::string kind = file ? file->attribute("type") : "";
    if (kind != "UnstructuredGrid" && kind != "PolyData")
      throw BadInput(fmt::format("a VTKFile of type '{}', expected UnstructuredGrid or PolyData", kind));
    is_grid_ = kind == "UnstructuredGrid";
    big_endian_ = file->attribute("byte_order", "LittleEndian") == "BigEndian";
    compressor_ = file->attribute("compressor");
    header_bytes_ = file->attribute("header_type", "UInt32") == "UInt64" ? 8 : 4;
  }

  CellSoup read() {
    for (size_t from = 0;;) {
      const auto piece = next_tag(text_, "Piece", from, text_.size());
      if (!piece) break;
      const auto next = next_tag(text_, "Piece", piece->content, text_.size());
      from = piece->content;
      add_piece(piece->content, next ? next->content : text_.size());
    }
    if (soup_.points.empty()) throw BadInput("no points in it");
    return std::move(soup_);
  }

 private:
  void add_piece(size_t begin, size_t end) {
    const auto before = static_cast<int>(soup_.points.size());
    const std::vector<double> xyz = array("Points", "", begin, end);
    for (size_t i = 0; i + 2 < xyz.size(); i += 3) soup_.points.emplace_back(xyz[i], xyz[i + 1], xyz[i + 2]);
    if (is_grid_) return add_cells("Cells", 0, before, begin, end);
    add_cells("Polys", kVtkPolygon, before, begin, end);
    add_cells("Strips", kVtkTriangleStrip, before, begin, end);
  }

  /// `type_of_all` 0: each cell has its own.
  void add_cells(std::string_view group, int type_of_all, int before, size_t begin, size_t end) {
    if (type_of_all != 0 && !next_tag(text_, group, begin, end)) return;
    const std::vector<double> nodes = array(group, "connectivity", begin, end),
                              offsets = array(group, "offsets", begin, end);
    std::vector<double> types;
    if (type_of_all == 0) types = array(group, "types", begin, end);
    if (type_of_all == 0 && offsets.size() != types.size())
      throw BadInput("as many cell types as offsets are expected");
    double first = 0;
    for (size_t i = 0; i < offsets.size(); ++i) {
      if (!(offsets[i] >= first && offsets[i] <= static_cast<double>(nodes.size())))
        throw BadInput("broken cell offsets");
      std::vector<int> cell;
      for (auto k = static_cast<size_t>(first); k < static_cast<size_t>(offsets[i]); ++k) {
        if (!(std::abs(nodes[k]) < 1e9)) throw BadInput("a cell names a node that is not there");
        cell.push_back(static_cast<int>(nodes[k]) + before);
      }
      soup_.cells.push_back(std::move(cell));
      const bool is_known = type_of_all == 0 && std::abs(types[i]) < 1000;
      soup_.types.push_back(is_known ? static_cast<int>(types[i]) : type_of_all);
      first = offsets[i];
    }
  }

  /// The DataArray `name` (the first one where `name` is empty) inside a group.
  std::vector<double> array(std::string_view group, std::string_view name, size_t begin, size_t end) const {
    const auto parent = next_tag(text_, group, begin, end);
    if (!parent) throw BadInput(fmt::format("no <{}>", group));
    const size_t until = end_of(text_, group, parent->content);
    size_t from = parent->content;
    while (const auto tag = next_tag(text_, "DataArray", from, until)) {
      from = tag->content;
      if (name.empty() || tag->attribute("Name") == name) return values(*tag);
    }
    throw BadInput(fmt::format("no DataArray {} in <{}>", name, group));
  }

  std::vector<double> values(const Tag& tag) const {
    const std::string format = tag.attribute("format", "ascii"), type = tag.attribute("type");
    const std::string_view content = text_.substr(tag.content, text_.find('<', tag.content) - tag.content);
    if (format == "ascii") {
      std::vector<double> result;
      MeshBytes words(content);
      for (std::string_view word = words.word(); !word.empty(); word = words.word()) result.push_back(number_of(word));
      return result;
    }
    if (size_of_vtk_type(type) == 0) throw BadInput(fmt::format("numbers of type {} are not supported", type));
    if (format == "binary")
      return vtk_numbers(unpacked(from_base64(content), compressor_, header_bytes_, big_endian_), type, big_endian_);
    const double offset = number_of(tag.attribute("offset", "0"));
    if (!(offset >= 0 && offset < static_cast<double>(appended_.size()))) throw BadInput("appended data are missing");
    const std::string_view bytes = appended_.substr(static_cast<size_t>(offset));
    const std::string array = appended_encoding_ == "base64"
                                  ? unpacked(from_base64(bytes), compressor_, header_bytes_, big_endian_)
                                  : unpacked(bytes, compressor_, header_bytes_, big_endian_);
    return vtk_numbers(array, type, big_endian_);
  }

  std::string_view text_, appended_;
  std::string appended_encoding_, compressor_;
  bool is_grid_ = true, big_endian_ = false;
  size_t header_bytes_ = 4;
  CellSoup soup_;
};

}  // namespace

CellSoup read_vtk_xml(std::string_view bytes) {
  return XmlReader(bytes).read();
}

}  // namespace palpate
