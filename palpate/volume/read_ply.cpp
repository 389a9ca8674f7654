#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "palpate/core/errors.h"
#include "palpate/core/table_text.h"
#include "palpate/volume/mesh_bytes.h"
#include "palpate/volume/polygon_soup.h"
#include "palpate/volume/vtk_numbers.h"

namespace palpate {

namespace {

constexpr int kVtkPolygon = 7, kVtkTriangleStrip = 6;

struct Property {
  std::string name, type, count_type;  // a list has a type of its count
};
struct Element {
  std::string name;
  size_t count = 0;
  std::vector<Property> properties;
};

/// PLY calls types as C does or by their bits; VTK knows both but these.
std::string vtk_type(const std::string& type) {
  if (type == "uchar") return "uint8";
  if (type == "ushort") return "uint16";
  if (type == "uint") return "uint32";
  return type;
}

class PlyReader {
 public:
  explicit PlyReader(std::string_view bytes) : bytes_(bytes) {}

  CellSoup read() {
    read_header();
    for (const Element& element : elements_) {
      if (element.properties.empty()) continue;
      if (element.count > bytes_.left()) throw BadInput("the file is cut short");
      for (size_t i = 0; i < element.count; ++i) read_item(element);
    }
    return std::move(soup_);
  }

 private:
  void read_header() {
    if (trimmed(bytes_.line()) != "ply") throw BadInput("not a PLY file");
    while (true) {
      if (bytes_.at_end()) throw BadInput("the header does not end");
      MeshBytes words(bytes_.line());
      const std::string word(words.word());
      if (word == "end_header") return;
      if (word == "format") {
        const std::string format(words.word());
        is_text_ = format == "ascii";
        big_endian_ = format == "binary_big_endian";
      } else if (word == "element") {
        Element element{std::string(words.word()), 0, {}};
        const double count = number_of(words.word());
        if (!(count >= 0 && count < 1e9)) throw BadInput("a number of elements is wrong");
        element.count = static_cast<size_t>(count);
        elements_.push_back(element);
      } else if (word == "property" && !elements_.empty()) {
        Property property;
        property.type = words.word();
        if (property.type == "list") {
          property.count_type = vtk_type(std::string(words.word()));
          property.type = words.word();
        }
        property.type = vtk_type(property.type);
        property.name = words.word();
        elements_.back().properties.push_back(property);
      }
    }
  }

  double number(const std::string& type) {
    double value = 0;
    if (is_text_) {
      value = number_of(bytes_.word());
    } else {
      const size_t size = size_of_vtk_type(type);
      if (size == 0) throw BadInput(fmt::format("numbers of type {} are not supported", type));
      value = vtk_numbers(bytes_.take(size), type, big_endian_).front();
    }
    if (std::isnan(value) && is_text_) throw BadInput("a number is missing");
    return value;
  }

  void read_item(const Element& element) {
    Vec3 point = Vec3::Zero();
    for (const Property& property : element.properties) {
      if (property.count_type.empty()) {
        const double value = number(property.type);
        if (property.name == "x") point.x() = value;
        if (property.name == "y") point.y() = value;
        if (property.name == "z") point.z() = value;
        continue;
      }
      const double count = number(property.count_type);
      if (!(count >= 0 && count <= static_cast<double>(bytes_.left()))) throw BadInput("a list is cut short");
      std::vector<int> cell;
      for (size_t k = 0; k < static_cast<size_t>(count); ++k) {
        const double index = number(property.type);
        cell.push_back(std::abs(index) < 1e9 ? static_cast<int>(index) : -1);
      }
      add_cell(element, property, cell);
    }
    if (element.name == "vertex") soup_.points.push_back(point);
  }

  /// A strip of several triangles strips is parted by -1.
  void add_cell(const Element& element, const Property& property, const std::vector<int>& cell) {
    if (property.name != "vertex_indices" && property.name != "vertex_index") return;
    const bool is_strip = element.name == "tristrips";
    if (element.name != "face" && !is_strip) return;
    std::vector<int> part;
    const auto end_part = [&] {
      if (part.size() >= 3) {
        soup_.cells.push_back(part);
        soup_.types.push_back(is_strip ? kVtkTriangleStrip : kVtkPolygon);
      }
      part.clear();
    };
    for (const int corner : cell)
      if (corner < 0 && is_strip)
        end_part();
      else
        part.push_back(corner);
    end_part();
  }

  MeshBytes bytes_;
  bool is_text_ = true, big_endian_ = false;
  std::vector<Element> elements_;
  CellSoup soup_;
};

}  // namespace

CellSoup read_ply(std::string_view bytes) {
  return PlyReader(bytes).read();
}

}  // namespace palpate
