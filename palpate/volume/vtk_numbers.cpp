#include "palpate/volume/vtk_numbers.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <map>

#include "palpate/core/errors.h"
#include "palpate/volume/mesh_bytes.h"

namespace palpate {

namespace {

enum class Kind { i8, u8, i16, u16, i32, u32, i64, u64, f32, f64 };

const std::map<std::string, Kind>& kinds() {
  static const std::map<std::string, Kind> kKinds = {{"char", Kind::i8},          {"signed_char", Kind::i8},
                                                     {"int8", Kind::i8},          {"vtktypeint8", Kind::i8},
                                                     {"unsigned_char", Kind::u8}, {"uint8", Kind::u8},
                                                     {"vtktypeuint8", Kind::u8},  {"short", Kind::i16},
                                                     {"int16", Kind::i16},        {"unsigned_short", Kind::u16},
                                                     {"uint16", Kind::u16},       {"int", Kind::i32},
                                                     {"int32", Kind::i32},        {"vtkidtype", Kind::i32},
                                                     {"vtktypeint32", Kind::i32}, {"unsigned_int", Kind::u32},
                                                     {"uint32", Kind::u32},       {"vtktypeuint32", Kind::u32},
                                                     {"long", Kind::i64},         {"int64", Kind::i64},
                                                     {"vtktypeint64", Kind::i64}, {"unsigned_long", Kind::u64},
                                                     {"uint64", Kind::u64},       {"vtktypeuint64", Kind::u64},
                                                     {"float", Kind::f32},        {"float32", Kind::f32},
                                                     {"double", Kind::f64},       {"float64", Kind::f64}};
  return kKinds;
}

const Kind* kind_of(std::string type) {
  std::transform(type.begin(), type.end(), type.begin(), [](unsigned char c) { return std::tolower(c); });
  const auto found = kinds().find(type);
  return found == kinds().end() ? nullptr : &found->second;
}

size_t size_of_kind(Kind kind) {
  switch (kind) {
    case Kind::i8:
    case Kind::u8:
      return 1;
    case Kind::i16:
    case Kind::u16:
      return 2;
    case Kind::i32:
    case Kind::u32:
    case Kind::f32:
      return 4;
    default:
      return 8;
  }
}

template <class Number>
std::vector<double> converted(std::string_view bytes, bool swapped) {
  std::vector<double> values;
  values.reserve(bytes.size() / sizeof(Number));
  MeshBytes numbers(bytes);
  while (numbers.left() >= sizeof(Number)) values.push_back(static_cast<double>(numbers.binary<Number>(swapped)));
  return values;
}

}  // namespace

size_t size_of_vtk_type(const std::string& type) {
  const Kind* kind = kind_of(type);
  return kind ? size_of_kind(*kind) : 0;
}

std::vector<double> vtk_numbers(std::string_view bytes, const std::string& type, bool big_endian) {
  const Kind* kind = kind_of(type);
  if (!kind) throw BadInput(fmt::format("numbers of type {} are not supported", type));
  const bool swapped = big_endian != (std::endian::native == std::endian::big);
  switch (*kind) {
    case Kind::i8:
      return converted<int8_t>(bytes, swapped);
    case Kind::u8:
      return converted<uint8_t>(bytes, swapped);
    case Kind::i16:
      return converted<int16_t>(bytes, swapped);
    case Kind::u16:
      return converted<uint16_t>(bytes, swapped);
    case Kind::i32:
      return converted<int32_t>(bytes, swapped);
    case Kind::u32:
      return converted<uint32_t>(bytes, swapped);
    case Kind::i64:
      return converted<int64_t>(bytes, swapped);
    case Kind::u64:
      return converted<uint64_t>(bytes, swapped);
    case Kind::f32:
      return converted<float>(bytes, swapped);
    case Kind::f64:
      break;
  }
  return converted<double>(bytes, swapped);
}

}  // namespace palpate
