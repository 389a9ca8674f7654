#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "palpate/core/errors.h"
#include "palpate/core/table_text.h"
#include "palpate/volume/mesh_bytes.h"
#include "palpate/volume/polygon_soup.h"
#include "palpate/volume/vtk_numbers.h"

namespace palpate {

namespace {

constexpr int kVtkPolygon = 7, kVtkTriangleStrip = 6;

/// Versions 1 to 5.1 of the legacy format, as text or in binary (big-endian).
class LegacyReader {
 public:
  explicit LegacyReader(std::string_view bytes) : bytes_(bytes) {}

  CellSoup read() {
    if (!bytes_.line().starts_with("# vtk DataFile")) throw BadInput("not a VTK file");
    bytes_.line();
    const std::string encoding = upper(bytes_.word());
    if (encoding != "ASCII" && encoding != "BINARY")
      throw BadInput(fmt::format("legacy VTK file in {}, expected ASCII or BINARY", encoding));
    is_binary_ = encoding == "BINARY";
    for (std::string word = upper(bytes_.word()); !word.empty(); word = upper(bytes_.word())) {
      if (word == "POINT_DATA" || word == "CELL_DATA") break;
      if (word == "DATASET") require_mesh(upper(bytes_.word()));
      if (word == "FIELD") skip_fields();
      if (word == "METADATA") skip_metadata();
      if (word == "POINTS") read_points();
      if (word == "CELLS") read_cells(0);
      if (word == "POLYGONS") read_cells(kVtkPolygon);
      if (word == "TRIANGLE_STRIPS") read_cells(kVtkTriangleStrip);
      if (word == "VERTICES" || word == "LINES") read_cells(-1);
      if (word == "CELL_TYPES") read_types();
    }
    if (soup_.points.empty()) throw BadInput("no points in it");
    return std::move(soup_);
  }

 private:
  static std::string upper(std::string_view word) {
    std::string text(word);
    std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::toupper(c); });
    return text;
  }

  static void require_mesh(const std::string& kind) {
    if (kind != "UNSTRUCTURED_GRID" && kind != "POLYDATA")
      throw BadInput(fmt::format("it holds {}, expected UNSTRUCTURED_GRID or POLYDATA", kind));
  }

  size_t count(const char* what) {
    const double value = number_of(bytes_.word());
    if (!(value >= 0 && value <= static_cast<double>(bytes_.left())))
      throw BadInput(fmt::format("the number of {} is missing or wrong", what));
    return static_cast<size_t>(value);
  }

  std::vector<double> numbers(size_t count, const std::string& type) {
    if (count > bytes_.left()) throw BadInput("the file is cut short");
    if (is_binary_) {
      if (size_of_vtk_type(type) == 0) throw BadInput(fmt::format("numbers of type {} are not supported", type));
      return vtk_numbers(bytes_.take(count * size_of_vtk_type(type)), type, true);
    }
    std::vector<double> values(count);
    for (double& value : values) {
      value = number_of(bytes_.word());
      if (std::isnan(value)) throw BadInput("a number is missing");
    }
    return values;
  }

  /// The type ends its line; behind it the numbers begin.
  std::string type() {
    std::string name(bytes_.word());
    if (is_binary_) bytes_.line();
    return name;
  }

  void skip_fields() {
    bytes_.word();
    const size_t arrays = count("arrays of a field");
    for (size_t i = 0; i < arrays; ++i) {
      std::string name = upper(bytes_.word());
      if (name == "METADATA") {
        skip_metadata();
        name = upper(bytes_.word());
      }
      const size_t components = count("components"), tuples = count("tuples");
      const std::string of_type = type();
      if (of_type == "string" || of_type == "bit")
        throw BadInput(fmt::format("a field of type {} before the mesh", of_type));
      numbers(components * tuples, of_type);
    }
  }

  /// Up to an empty line.
  void skip_metadata() {
    bytes_.line();
    while (!bytes_.at_end() && !trimmed(bytes_.line()).empty()) {
    }
  }

  void read_points() {
    const size_t points = count("points");
    const std::vector<double> xyz = numbers(3 * points, type());
    for (size_t i = 0; i < points; ++i) soup_.points.emplace_back(xyz[3 * i], xyz[3 * i + 1], xyz[3 * i + 2]);
  }

  /// Up to version 4 each cell begins with its number of nodes, since 5 there are offsets and connectivity.
  void read_cells(int type_of_all) {
    const size_t first = count("cells"), second = count("numbers of the cells");
    if (is_binary_) bytes_.line();
    const size_t place = bytes_.place();
    if (upper(bytes_.word()) == "OFFSETS") {
      const std::vector<double> offsets = numbers(first, type());
      if (upper(bytes_.word()) != "CONNECTIVITY") throw BadInput("the nodes of the cells are missing");
      const std::vector<double> nodes = numbers(second, type());
      for (size_t i = 1; i < offsets.size(); ++i) {
        if (!(offsets[i - 1] >= 0 && offsets[i] >= offsets[i - 1] && offsets[i] <= static_cast<double>(second)))
          throw BadInput("broken cell offsets");
        add_cell(type_of_all, nodes, static_cast<size_t>(offsets[i - 1]), static_cast<size_t>(offsets[i]));
      }
      return;
    }
    bytes_.go_to(place);
    const std::vector<double> all = numbers(second, "int");
    size_t at = 0;
    for (size_t i = 0; i < first; ++i) {
      const double nodes = at < all.size() ? all[at] : -1;
      if (!(nodes >= 0 && nodes <= static_cast<double>(all.size() - at - 1))) throw BadInput("a cell is cut short");
      add_cell(type_of_all, all, at + 1, at + 1 + static_cast<size_t>(nodes));
      at += 1 + static_cast<size_t>(nodes);
    }
  }

  void add_cell(int type_of_all, const std::vector<double>& nodes, size_t begin, size_t end) {
    if (type_of_all < 0) return;
    std::vector<int> cell;
    for (size_t i = begin; i < end; ++i) {
      if (!(std::abs(nodes[i]) < std::numeric_limits<int>::max()))
        throw BadInput("a cell names a node that is not there");
      cell.push_back(static_cast<int>(nodes[i]));
    }
    soup_.cells.push_back(std::move(cell));
    soup_.types.push_back(type_of_all);
  }

  void read_types() {
    const size_t types = count("cell types");
    if (is_binary_) bytes_.line();
    if (types != soup_.types.size()) throw BadInput("as many cell types as cells are expected");
    const std::vector<double> values = numbers(types, "int");
    for (size_t i = 0; i < types; ++i) soup_.types[i] = std::abs(values[i]) < 1000 ? static_cast<int>(values[i]) : 0;
  }

  MeshBytes bytes_;
  bool is_binary_ = false;
  CellSoup soup_;
};

}  // namespace

CellSoup read_vtk_legacy(std::string_view bytes) {
  return LegacyReader(bytes).read();
}

}  // namespace palpate
