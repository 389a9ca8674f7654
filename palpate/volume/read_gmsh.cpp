#include <fmt/format.h>

#include <cmath>
#include <map>
#include <string>
#include <unordered_map>

#include "palpate/core/errors.h"
#include "palpate/core/table_text.h"
#include "palpate/volume/mesh_bytes.h"
#include "palpate/volume/polygon_soup.h"

namespace palpate {

namespace {

struct GmshType {
  int nodes;
  int vtk_type;
};

/// Gmsh element type -> number of nodes and VTK type of its corners, which come first (0 = points and lines, which
/// bound nothing).
GmshType gmsh_type(int64_t type) {
  static const std::map<int64_t, GmshType> kTypes = {
      {1, {2, 0}},    {2, {3, 5}},    {3, {4, 9}},    {4, {4, 10}},   {5, {8, 12}},   {6, {6, 13}},   {7, {5, 14}},
      {8, {3, 0}},    {9, {6, 5}},    {10, {9, 9}},   {11, {10, 10}}, {12, {27, 12}}, {13, {18, 13}}, {14, {14, 14}},
      {15, {1, 0}},   {16, {8, 9}},   {17, {20, 12}}, {18, {15, 13}}, {19, {13, 14}}, {20, {9, 5}},   {21, {10, 5}},
      {22, {12, 5}},  {23, {15, 5}},  {24, {15, 5}},  {25, {21, 5}},  {26, {4, 0}},   {27, {5, 0}},   {28, {6, 0}},
      {29, {20, 10}}, {30, {35, 10}}, {31, {56, 10}}, {36, {16, 9}},  {37, {25, 9}},  {38, {36, 9}},  {90, {40, 13}},
      {91, {75, 13}}, {92, {64, 12}}, {93, {125, 12}}};
  const auto found = kTypes.find(type);
  if (found == kTypes.end()) throw BadInput(fmt::format("element type {} is not supported", type));
  return found->second;
}

/// Gmsh 1, 2, 4.0 and 4.1, as text or in binary of either byte order.
class GmshReader {
 public:
  explicit GmshReader(std::string_view bytes) : bytes_(bytes) {}

  CellSoup read() {
    while (!bytes_.at_end()) {
      const std::string_view section = bytes_.word();
      if (section == "$MeshFormat") {
        read_format();
      } else if (section == "$NOD") {
        version_ = 1;
        read_nodes();
      } else if (section == "$Nodes") {
        bytes_.line();
        version_ >= 4 ? read_node_blocks() : read_nodes();
      } else if (section == "$ELM") {
        read_elements();
      } else if (section == "$Elements") {
        bytes_.line();
        if (version_ >= 4)
          read_element_blocks();
        else
          is_binary_ ? read_binary_elements() : read_elements();
      }
    }
    if (soup_.points.empty()) throw BadInput("no nodes in it");
    return std::move(soup_);
  }

 private:
  void read_format() {
    version_ = real("version");
    const bool is_binary = text_integer("file type") != 0;
    size_bytes_ = static_cast<size_t>(text_integer("data size"));
    bytes_.line();
    is_binary_ = is_binary;
    if (!is_binary_) return;
    const auto one = bytes_.binary<int32_t>(false);
    swapped_ = one != 1;
    if (swapped_ && one != 0x01000000) throw BadInput("binary Gmsh file without its byte order");
  }

  /// What is text in a text file; in a binary one, the version and the counts of version 2 are text all the same.
  double real(const char* what) {
    if (is_binary_) return bytes_.binary<double>(swapped_);
    const double value = number_of(bytes_.word());
    if (std::isnan(value)) throw BadInput(fmt::format("the {} is missing or is no number", what));
    return value;
  }
  template <class Binary>
  int64_t integer(const char* what) {
    if (is_binary_) return static_cast<int64_t>(bytes_.binary<Binary>(swapped_));
    return text_integer(what);
  }
  int64_t text_integer(const char* what) {
    const double value = number_of(bytes_.word());
    if (!(std::abs(value) < 9e15)) throw BadInput(fmt::format("the {} is missing or is no number", what));
    return static_cast<int64_t>(value);
  }
  int64_t size(const char* what) { return size_bytes_ == 4 ? integer<uint32_t>(what) : integer<uint64_t>(what); }

  /// A number of things that the file can hold.
  int64_t credible(int64_t count) const {
    if (count < 0 || static_cast<uint64_t>(count) > bytes_.left())
      throw BadInput("a number of nodes or elements is wrong");
    return count;
  }

  void add_node(int64_t id) {
    const double x = real("coordinate"), y = real("coordinate"), z = real("coordinate");
    index_[id] = static_cast<int>(soup_.points.size());
    soup_.points.emplace_back(x, y, z);
  }

  template <class NextNode>
  void add_cell(GmshType type, NextNode next_node) {
    std::vector<int> cell;
    for (int k = 0; k < type.nodes; ++k) {
      const int64_t id = next_node();
      const auto found = index_.find(id);
      if (found == index_.end()) throw BadInput(fmt::format("an element names node {}, which is not there", id));
      cell.push_back(found->second);
    }
    if (type.vtk_type == 0) return;
    soup_.types.push_back(type.vtk_type);
    soup_.cells.push_back(std::move(cell));
  }

  void read_nodes() {
    const int64_t count = credible(text_integer("number of nodes"));
    if (is_binary_) bytes_.line();
    for (int64_t i = 0; i < count; ++i) add_node(integer<int32_t>("node number"));
  }

  /// In 4.0 the number of a node stands before its coordinates, since 4.1 all numbers of a block before all
  /// coordinates.
  void read_node_blocks() {
    const bool is_4_0 = version_ < 4.05;
    const int64_t blocks =
        credible(is_4_0 ? integer<uint64_t>("number of node blocks") : size("number of node blocks"));
    for (int skipped = 0; skipped < (is_4_0 ? 1 : 3); ++skipped) is_4_0 ? integer<uint64_t>("count") : size("count");
    for (int64_t block = 0; block < blocks; ++block) {
      int64_t dimension = integer<int32_t>("entity");
      const int64_t second = integer<int32_t>("entity");
      if (is_4_0) dimension = second;
      const bool is_parametric = integer<int32_t>("parametric flag") != 0;
      const int64_t count = credible(is_4_0 ? integer<uint64_t>("number of nodes") : size("number of nodes"));
      const auto skip_parameters = [&] {
        for (int64_t k = 0; is_parametric && k < dimension; ++k) real("parametric coordinate");
      };
      if (is_4_0) {
        for (int64_t i = 0; i < count; ++i) {
          add_node(integer<int32_t>("node number"));
          skip_parameters();
        }
        continue;
      }
      std::vector<int64_t> ids(static_cast<size_t>(count));
      for (int64_t& id : ids) id = size("node number");
      for (const int64_t id : ids) {
        add_node(id);
        skip_parameters();
      }
    }
  }

  void read_elements() {
    const int64_t count = credible(text_integer("number of elements"));
    for (int64_t i = 0; i < count; ++i) {
      text_integer("element number");
      GmshType type = gmsh_type(text_integer("element type"));
      if (version_ < 2) {
        text_integer("physical region");
        text_integer("elementary region");
        type.nodes = static_cast<int>(credible(text_integer("number of nodes of an element")));
      } else {
        const int64_t tags = text_integer("number of tags");
        for (int64_t k = 0; k < tags; ++k) text_integer("tag");
      }
      add_cell(type, [this] { return text_integer("node of an element"); });
    }
  }

  void read_binary_elements() {
    const int64_t count = credible(text_integer("number of elements"));
    bytes_.line();
    const auto next = [this] { return static_cast<int64_t>(bytes_.binary<int32_t>(swapped_)); };
    for (int64_t read = 0; read < count;) {
      const GmshType type = gmsh_type(next());
      const int64_t elements = credible(next()), tags = next();
      if (elements == 0) throw BadInput("a block of elements is empty");
      for (int64_t i = 0; i < elements; ++i, ++read) {
        for (int64_t k = 0; k < 1 + tags; ++k) next();
        add_cell(type, next);
      }
    }
  }

  void read_element_blocks() {
    const bool is_4_0 = version_ < 4.05;
    const int64_t blocks = credible(is_4_0 ? integer<uint64_t>("element blocks") : size("element blocks"));
    for (int skipped = 0; skipped < (is_4_0 ? 1 : 3); ++skipped) is_4_0 ? integer<uint64_t>("count") : size("count");
    for (int64_t block = 0; block < blocks; ++block) {
      integer<int32_t>("entity");
      integer<int32_t>("entity");
      const GmshType type = gmsh_type(integer<int32_t>("element type"));
      const int64_t count = credible(is_4_0 ? integer<uint64_t>("number of elements") : size("number of elements"));
      const auto next = [&] { return is_4_0 ? integer<int32_t>("node of an element") : size("node of an element"); };
      for (int64_t i = 0; i < count; ++i) {
        next();  // its number
        add_cell(type, next);
      }
    }
  }

  MeshBytes bytes_;
  double version_ = 0;
  bool is_binary_ = false, swapped_ = false;
  size_t size_bytes_ = 8;
  CellSoup soup_;
  std::unordered_map<int64_t, int> index_;
};

}  // namespace

CellSoup read_gmsh(std::string_view bytes) {
  return GmshReader(bytes).read();
}

}  // namespace palpate
