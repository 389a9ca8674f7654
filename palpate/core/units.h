#pragma once

#include <optional>
#include <string>

namespace palpate {

/// A unit by any of its usual spellings ("N", "newton", "mm", "[ms]" without its brackets), in the house's own unit of
/// that kind: N, mm, s, kPa.
struct Unit {
  enum class Kind { force, length, time, pressure };
  Kind kind = Kind::force;
  double factor = 1;  ///< value in the house's unit = factor * value in this one
};

/// Nothing where the word is no unit that is known. Capital letters do not count: "MPA" is MPa, "mn" is mN.
std::optional<Unit> unit_of(const std::string& word);

/// "N", "mm", "s", "kPa".
std::string house_unit(Unit::Kind kind);

}  // namespace palpate
