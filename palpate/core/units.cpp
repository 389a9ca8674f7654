#include "palpate/core/units.h"

#include <algorithm>
#include <map>

namespace palpate {

std::optional<Unit> unit_of(const std::string& word) {
  using Kind = Unit::Kind;
  static const std::map<std::string, Unit> kUnits = {
      {"n", {Kind::force, 1}},
      {"newton", {Kind::force, 1}},
      {"newtons", {Kind::force, 1}},
      {"mn", {Kind::force, 1e-3}},
      {"kn", {Kind::force, 1e3}},
      {"lbf", {Kind::force, 4.4482216152605}},
      {"lb", {Kind::force, 4.4482216152605}},
      {"kgf", {Kind::force, 9.80665}},
      {"gf", {Kind::force, 9.80665e-3}},
      {"mm", {Kind::length, 1}},
      {"millimeter", {Kind::length, 1}},
      {"cm", {Kind::length, 10}},
      {"m", {Kind::length, 1000}},
      {"meter", {Kind::length, 1000}},
      {"meters", {Kind::length, 1000}},
      {"um", {Kind::length, 1e-3}},
      {"\xC2\xB5m", {Kind::length, 1e-3}},
      {"\xCE\xBCm", {Kind::length, 1e-3}},
      {"s", {Kind::time, 1}},
      {"sec", {Kind::time, 1}},
      {"secs", {Kind::time, 1}},
      {"second", {Kind::time, 1}},
      {"seconds", {Kind::time, 1}},
      {"sek", {Kind::time, 1}},
      {"min", {Kind::time, 60}},
      {"ms", {Kind::time, 1e-3}},
      {"msec", {Kind::time, 1e-3}},
      {"millis", {Kind::time, 1e-3}},
      {"milliseconds", {Kind::time, 1e-3}},
      {"us", {Kind::time, 1e-6}},
      {"usec", {Kind::time, 1e-6}},
      {"micros", {Kind::time, 1e-6}},
      {"microseconds", {Kind::time, 1e-6}},
      {"\xC2\xB5s", {Kind::time, 1e-6}},
      {"\xCE\xBCs", {Kind::time, 1e-6}},
      {"ns", {Kind::time, 1e-9}},
      {"nsec", {Kind::time, 1e-9}},
      {"nsecs", {Kind::time, 1e-9}},
      {"nanosec", {Kind::time, 1e-9}},
      {"nanoseconds", {Kind::time, 1e-9}},
      {"kpa", {Kind::pressure, 1}},
      {"pa", {Kind::pressure, 1e-3}},
      {"mpa", {Kind::pressure, 1e3}},
  };
  std::string small = word;
  std::transform(small.begin(), small.end(), small.begin(), [](unsigned char c) { return std::tolower(c); });
  const auto found = kUnits.find(small);
  return found == kUnits.end() ? std::nullopt : std::optional(found->second);
}

std::string house_unit(Unit::Kind kind) {
  switch (kind) {
    case Unit::Kind::force:
      return "N";
    case Unit::Kind::length:
      return "mm";
    case Unit::Kind::time:
      return "s";
    case Unit::Kind::pressure:
      break;
  }
  return "kPa";
}

}  // namespace palpate
