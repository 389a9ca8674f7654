#include <fmt/format.h>

#include <istream>
#include <map>
#include <string>
#include <unordered_map>

#include "palpate/core/errors.h"
#include "palpate/volume/polygon_soup.h"

namespace palpate {

namespace {

struct GmshType {
  int nodes;
  int vtk_type;
};

/// Gmsh element type -> number of nodes and VTK type (0 = points and lines, which bound nothing).
GmshType gmsh_type(int type) {
  static const std::map<int, GmshType> kTypes = {
      {1, {2, 0}},  {2, {3, 5}},   {3, {4, 9}},    {4, {4, 10}},   {5, {8, 12}},   {6, {6, 13}},
      {7, {5, 14}}, {8, {3, 0}},   {9, {6, 22}},   {10, {9, 28}},  {11, {10, 24}}, {12, {27, 29}},
      {15, {1, 0}}, {16, {8, 23}}, {17, {20, 25}}, {18, {15, 26}}, {19, {13, 27}}};
  const auto found = kTypes.find(type);
  if (found == kTypes.end()) throw BadInput(fmt::format("element type {} is not supported", type));
  return found->second;
}

class GmshReader {
 public:
  explicit GmshReader(std::istream& stream) : stream_(stream) {}

  CellSoup read() {
    std::string section;
    while (stream_ >> section) {
      if (section == "$MeshFormat") {
        version_ = number<double>("version");
        if (number<int>("file type") != 0) throw BadInput("binary Gmsh file, expected ASCII");
      } else if (section == "$NOD") {
        version_ = 1;
        read_nodes();
      } else if (section == "$Nodes") {
        version_ >= 4 ? read_node_blocks() : read_nodes();
      } else if (section == "$ELM" || section == "$Elements") {
        version_ >= 4 ? read_element_blocks() : read_elements();
      }
    }
    if (soup_.points.empty()) throw BadInput("no nodes in it");
    return std::move(soup_);
  }

 private:
  template <class Number>
  Number number(const char* what) {
    Number value{};
    if (!(stream_ >> value)) throw BadInput(fmt::format("the {} is missing or is no number", what));
    return value;
  }

  void add_node(long id) {
    const double x = number<double>("coordinate"), y = number<double>("coordinate"), z = number<double>("coordinate");
    index_[id] = static_cast<int>(soup_.points.size());
    soup_.points.emplace_back(x, y, z);
  }

  void add_cell(int type, int nodes) {
    std::vector<int> cell;
    for (int k = 0; k < nodes; ++k) {
      const long id = number<long>("node of an element");
      const auto found = index_.find(id);
      if (found == index_.end()) throw BadInput(fmt::format("an element names node {}, which is not there", id));
      cell.push_back(found->second);
    }
    if (type == 0) return;
    soup_.types.push_back(type);
    soup_.cells.push_back(std::move(cell));
  }

  void read_nodes() {
    const long count = number<long>("number of nodes");
    for (long i = 0; i < count; ++i) add_node(number<long>("node number"));
  }

  void read_node_blocks() {
    const long blocks = number<long>("number of node blocks");
    for (int skipped = 0; skipped < 3; ++skipped) number<long>("node count");
    for (long block = 0; block < blocks; ++block) {
      const int dimension = number<int>("entity dimension");
      number<int>("entity tag");
      const bool is_parametric = number<int>("parametric flag") != 0;
      std::vector<long> ids(static_cast<size_t>(number<unsigned>("number of nodes")));
      for (long& id : ids) id = number<long>("node tag");
      for (long id : ids) {
        add_node(id);
        for (int k = 0; is_parametric && k < dimension; ++k) number<double>("parametric coordinate");
      }
    }
  }

  void read_elements() {
    const long count = number<long>("number of elements");
    for (long i = 0; i < count; ++i) {
      number<long>("element number");
      const GmshType type = gmsh_type(number<int>("element type"));
      int nodes = type.nodes;
      if (version_ < 2) {
        number<long>("physical region");
        number<long>("elementary region");
        nodes = number<int>("number of nodes of an element");
      } else {
        const int tags = number<int>("number of tags");
        for (int k = 0; k < tags; ++k) number<long>("tag");
      }
      add_cell(type.vtk_type, nodes);
    }
  }

  void read_element_blocks() {
    const long blocks = number<long>("number of element blocks");
    for (int skipped = 0; skipped < 3; ++skipped) number<long>("element count");
    for (long block = 0; block < blocks; ++block) {
      number<int>("entity dimension");
      number<int>("entity tag");
      const GmshType type = gmsh_type(number<int>("element type"));
      const long count = number<long>("number of elements");
      for (long i = 0; i < count; ++i) {
        number<long>("element tag");
        add_cell(type.vtk_type, type.nodes);
      }
    }
  }

  std::istream& stream_;
  double version_ = 0;
  CellSoup soup_;
  std::unordered_map<long, int> index_;
};

}  // namespace

CellSoup read_gmsh(std::istream& stream) {
  return GmshReader(stream).read();
}

}  // namespace palpate
