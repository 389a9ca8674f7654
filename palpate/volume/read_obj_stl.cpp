#include <fmt/format.h>

#include <cmath>
#include <cstdint>

#include "palpate/core/errors.h"
#include "palpate/core/table_text.h"
#include "palpate/volume/mesh_bytes.h"
#include "palpate/volume/polygon_soup.h"

namespace palpate {

namespace {

constexpr int kVtkTriangle = 5, kVtkPolygon = 7;

Vec3 next_point(MeshBytes& words) {
  Vec3 point;
  for (int axis = 0; axis < 3; ++axis) {
    point[axis] = number_of(words.word());
    if (std::isnan(point[axis])) throw BadInput("a coordinate is missing or is no number");
  }
  return point;
}

std::string small(std::string_view word) {
  std::string text(word);
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

CellSoup read_binary_stl(std::string_view bytes, size_t triangles) {
  CellSoup soup;
  MeshBytes in(bytes);
  in.take(84);
  constexpr bool kSwapped = false;
  for (size_t i = 0; i < triangles; ++i) {
    in.take(12);  // its normal
    std::vector<int> cell;
    for (int corner = 0; corner < 3; ++corner) {
      const float x = in.binary<float>(kSwapped), y = in.binary<float>(kSwapped), z = in.binary<float>(kSwapped);
      cell.push_back(static_cast<int>(soup.points.size()));
      soup.points.emplace_back(x, y, z);
    }
    in.take(2);
    soup.cells.push_back(std::move(cell));
    soup.types.push_back(kVtkTriangle);
  }
  return soup;
}

}  // namespace

/// v and f; texture, normals, groups, materials and free edges do not matter. Numbers below zero count back from the
/// last vertex so far.
CellSoup read_obj(std::string_view bytes) {
  CellSoup soup;
  MeshBytes lines(bytes);
  while (!lines.at_end()) {
    std::string line(lines.line());
    while (line.ends_with('\\') && !lines.at_end())
      line = line.substr(0, line.size() - 1) + " " + std::string(lines.line());
    MeshBytes words(line);
    const std::string kind = small(words.word());
    if (kind == "v") soup.points.push_back(next_point(words));
    if (kind != "f" && kind != "fo") continue;
    std::vector<int> cell;
    for (std::string_view corner = words.word(); !corner.empty(); corner = words.word()) {
      if (corner.starts_with('#')) break;
      const double number = number_of(corner.substr(0, corner.find('/')));
      const auto count = static_cast<double>(soup.points.size());
      const double index = number > 0 ? number - 1 : count + number;
      if (!(number != 0 && index >= 0 && index < 1e9)) throw BadInput(fmt::format("a face names vertex '{}'", corner));
      cell.push_back(static_cast<int>(index));
    }
    if (cell.size() < 3) continue;
    soup.cells.push_back(std::move(cell));
    soup.types.push_back(kVtkPolygon);
  }
  return soup;
}

/// Binary or text: the length tells, because some programs begin the binary ones with "solid" as well.
CellSoup read_stl(std::string_view bytes) {
  if (bytes.size() >= 84) {
    const size_t triangles = MeshBytes(bytes.substr(80)).binary<uint32_t>(false);
    const bool is_text = small(bytes.substr(0, 1024)).find("facet") != std::string::npos;
    if (bytes.size() == 84 + 50 * triangles || (!is_text && bytes.size() > 84 + 50 * triangles))
      return read_binary_stl(bytes, triangles);
    if (!is_text) throw BadInput(fmt::format("it states {} triangles and is too short for them", triangles));
  }
  CellSoup soup;
  MeshBytes words(bytes);
  for (std::string_view word = words.word(); !word.empty(); word = words.word()) {
    if (small(word) != "vertex") continue;
    soup.points.push_back(next_point(words));
    if (soup.points.size() % 3 != 0) continue;
    const int last = static_cast<int>(soup.points.size()) - 1;
    soup.cells.push_back({last - 2, last - 1, last});
    soup.types.push_back(kVtkTriangle);
  }
  return soup;
}

}  // namespace palpate
