#include "palpate/stereo/calibration_keys.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <numeric>
#include <set>

#include "palpate/core/settings.h"
#include "palpate/stereo/calibration_names.h"

namespace palpate {

namespace {

using Role = CalibrationRole;
constexpr size_t kMaxKeysShown = 16, kMaxTextShown = 60;

bool is_upper(char c) {
  return std::isupper(static_cast<unsigned char>(c)) != 0;
}
bool is_lower(char c) {
  return std::islower(static_cast<unsigned char>(c)) != 0;
}
bool is_digit(char c) {
  return std::isdigit(static_cast<unsigned char>(c)) != 0;
}

/// "cameraMatrix_left1" is camera, matrix, left, 1.
std::vector<std::string> words_of(const std::string& key) {
  std::vector<std::string> words;
  std::string word;
  const auto end_word = [&] {
    if (!word.empty()) words.push_back(word);
    word.clear();
  };
  for (size_t i = 0; i < key.size(); ++i) {
    const char c = key[i];
    if (!std::isalnum(static_cast<unsigned char>(c))) {
      end_word();
      continue;
    }
    const bool after_digit = i > 0 && is_digit(key[i - 1]);
    if (i > 0 && ((is_upper(c) && is_lower(key[i - 1])) || is_digit(c) != after_digit)) end_word();
    word += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  end_word();
  return words;
}

std::string joined(const std::vector<std::string>& words) {
  return std::accumulate(words.begin(), words.end(), std::string());
}

/// Side as words say it; numbers are settled when the whole file is known.
struct Side {
  CameraSide camera = CameraSide::unknown;
  int number = -1;
};

/// "stereoleft" and "leftcamera" in small letters; "lefttoright" names a pair.
Side side_within(std::string& word) {
  const bool has_left = word.find("left") != std::string::npos, has_right = word.find("right") != std::string::npos;
  const std::string name = has_left ? "left" : "right";
  if (has_left == has_right || word.size() == name.size()) return {};
  if (word.starts_with(name))
    word.erase(0, name.size());
  else if (word.ends_with(name))
    word.erase(word.size() - name.size());
  else
    return {};
  return {has_left ? CameraSide::left : CameraSide::right, -1};
}

/// Takes the words that name a camera out of `words`, unless nothing else would be left.
Side take_side(std::vector<std::string>& words, bool may_be_empty) {
  Side side;
  std::vector<std::string> rest;
  for (std::string word : words) {
    if (const Side within = side_within(word); within.camera != CameraSide::unknown) {
      side.camera = within.camera;
      rest.push_back(word);
    } else if (word == "left" || word == "l" || word == "lft")
      side.camera = CameraSide::left;
    else if (word == "right" || word == "r" || word == "rgt")
      side.camera = CameraSide::right;
    else if (word == "0" || word == "1" || word == "2" || word == "00" || word == "01" || word == "02")
      side.number = word.back() - '0';
    else
      rest.push_back(word);
  }
  if (rest.empty() && !may_be_empty) return {};
  words = rest;
  return side;
}

/// KL, DR, mtxL: a name that ends with the letter of its camera.
Side take_last_letter(std::string& name) {
  static const std::set<std::string> kStems = {"k", "m", "d", "p", "kk", "kc", "mtx", "dist", "cm", "fc", "cc", "rect"};
  if (name.size() < 2) return {};
  const char last = name.back();
  const std::string stem = name.substr(0, name.size() - 1);
  if ((last != 'l' && last != 'r') || !kStems.count(stem)) return {};
  name = stem;
  return {last == 'l' ? CameraSide::left : CameraSide::right, -1};
}

std::vector<std::string> segments_of(const std::string& path) {
  std::vector<std::string> segments = {""};
  for (const char c : path) {
    if (c == '.' || c == '[') segments.emplace_back();
    if (c != '.' && c != '[' && c != ']') segments.back() += c;
  }
  std::erase(segments, "");
  return segments;
}

Role by_size(Role role, const std::string& name, size_t count) {
  const bool says_camera = role == Role::camera_matrix || name.find("intrinsic") != std::string::npos ||
                           name.find("cameramatrix") != std::string::npos;
  const bool is_told = role == Role::rotation || role == Role::translation;
  const bool says_pose = role == Role::transform || (!is_told && name.find("extrinsic") != std::string::npos) ||
                         name.find("l2r") != std::string::npos || name.find("lefttoright") != std::string::npos;
  if (says_pose)
    return count == 9                   ? Role::rotation
           : count == 3                 ? Role::translation
           : count == 12 || count == 16 ? Role::transform
                                        : Role::none;
  if (says_camera) {
    if (count == 9) return Role::camera_matrix;
    if (count == 4) return Role::intrinsics;
    if (count == 12) return Role::projection;
    return (count == 5 || count == 8 || count == 14) ? Role::distortion : Role::none;
  }
  if (role == Role::none && name.find("distort") != std::string::npos) role = Role::distortion;
  if (role == Role::none && name.find("rotation") != std::string::npos) role = Role::rotation;
  if (role == Role::none && name.find("translation") != std::string::npos) role = Role::translation;
  if (role == Role::none && name.find("rectif") != std::string::npos) role = Role::rectification;
  if (role == Role::none && name.find("projection") != std::string::npos) role = Role::projection;
  if (role == Role::rotation && count == 16) return Role::transform;
  if (role == Role::translation && count == 16) return Role::transform;
  const std::map<Role, std::set<size_t>> counts = {
      {Role::rotation, {3, 9}},    {Role::translation, {3}}, {Role::rectification, {9}}, {Role::projection, {12}},
      {Role::body_pose, {12, 16}}, {Role::image_size, {2}},  {Role::focal, {2}},         {Role::principal, {2}},
      {Role::radial, {2, 3}},      {Role::tangential, {2}}};
  if (const auto found = counts.find(role); found != counts.end() && !found->second.count(count)) return Role::none;
  return role;
}

/// extrinsics[0].T of a list: the pose of the pair, not of its first camera.
bool is_first_extrinsic(const std::vector<std::string>& segments) {
  for (size_t i = 1; i < segments.size(); ++i)
    if (segments[i] == "0" && joined(words_of(segments[i - 1])).starts_with("extrinsic")) return true;
  return false;
}

struct Recognised {
  CalibrationValue value;
  Side side;
};

Recognised recognise(const CalibrationEntry& entry) {
  const std::vector<std::string> segments = segments_of(entry.path);
  Recognised result;
  result.value.entry = &entry;
  Side side, own;
  for (size_t i = 0; i + 1 < segments.size(); ++i) {
    std::vector<std::string> words = words_of(segments[i]);
    if (const Side found = take_side(words, true); found.camera != CameraSide::unknown || found.number >= 0)
      side = found;
  }
  const std::string last = segments.empty() ? "" : segments.back();
  std::vector<std::string> words = words_of(last);
  std::string whole = joined(words);
  const bool is_number = entry.numbers.size() == 1;
  if (is_number && coefficient_names().count(whole)) {
    result.value.role = Role::coefficient;
    result.value.name = coefficient_names().at(whole);
    result.side = side;
    return result;
  }
  // "R" and "l2r" are names, no sides; "tcncnm1" counts cameras.
  const bool names_pair = whole.find("l2r") != std::string::npos || whole.find("lefttoright") != std::string::npos ||
                          whole.find("left2right") != std::string::npos || whole.starts_with("tcncnm");
  std::string name = whole;
  if (whole == "tcncnm1") name = "tcncnm";
  if (!names_pair) {
    own = take_side(words, false);
    name = joined(words);
    if (own.camera == CameraSide::unknown && own.number < 0) own = take_last_letter(name);
  }
  if (is_number && coefficient_names().count(name)) {
    result.value.role = Role::coefficient;
    result.value.name = coefficient_names().at(name);
    result.side = own.camera != CameraSide::unknown || own.number >= 0 ? own : side;
    return result;
  }
  const auto& roles = roles_by_name();
  auto found = roles.find(name);
  // "left.camera.data" and "distortion.coefficients" say it with the key above.
  if ((found == roles.end() || name == "coefficients" || name == "matrix") && segments.size() > 1) {
    std::vector<std::string> above = words_of(segments[segments.size() - 2]);
    take_side(above, true);
    if (const auto both = roles.find(joined(above) + name); both != roles.end()) found = both;
    if (found == roles.end() && (name == "data" || name == "value" || name == "values" || name == "a"))
      found = roles.find(joined(above));
  }
  Role role = found == roles.end() ? Role::none : found->second;
  if (entry.numbers.empty()) {
    result.value.role = role == Role::distortion_model ? role : Role::none;
    result.value.meant = role == Role::distortion_model ? Role::none : role;
  } else if (role == Role::distortion_model) {
    result.value.role = role;
  } else {
    const Role by_name = role;
    if (role == Role::distortion && entry.numbers.size() == 9) role = Role::none;
    if (name == "k" && entry.numbers.size() != 9 && entry.numbers.size() >= 4) role = Role::distortion;
    result.value.role = role == Role::distortion ? role : by_size(role, whole, entry.numbers.size());
    const bool is_other = by_name == Role::camera_matrix && result.value.role == Role::distortion;
    if (result.value.role == Role::none || is_other) result.value.meant = by_name;
    // R1 and P1 of cv::stereoRectify; RotationOfCamera2 is the one rotation there is.
    const bool numbered = own.number >= 0 || own.camera != CameraSide::unknown;
    if (result.value.role == Role::rotation && name == "r" && numbered && entry.numbers.size() == 9)
      result.value.role = Role::rectification;
    if (name == "rotationofcamera" || name == "translationofcamera") own = side = {};
    if (result.value.role == Role::transform) own = side = {};
    if (is_first_extrinsic(segments)) side = {};
  }
  result.side = own.camera != CameraSide::unknown || own.number >= 0 ? own : side;
  return result;
}

}  // namespace

std::vector<CalibrationValue> recognised(const std::vector<CalibrationEntry>& entries) {
  std::vector<Recognised> found;
  bool from_zero = false;
  for (const CalibrationEntry& entry : entries) {
    found.push_back(recognise(entry));
    from_zero = from_zero || (found.back().side.number == 0 && found.back().value.role != Role::none);
  }
  std::vector<CalibrationValue> values;
  for (const Recognised& one : found) {
    CalibrationValue value = one.value;
    value.camera = one.side.camera;
    if (value.camera == CameraSide::unknown && one.side.number >= 0) {
      const int first = from_zero ? 0 : 1;
      value.camera = one.side.number == first       ? CameraSide::left
                     : one.side.number == first + 1 ? CameraSide::right
                                                    : CameraSide::unknown;
    }
    values.push_back(value);
  }
  return values;
}

std::string misfit(const CalibrationEntry& entry, CalibrationRole meant) {
  static const std::map<Role, std::string> kExpected = {
      {Role::camera_matrix, "9 numbers (3x3), or fx fy cx cy"},
      {Role::distortion, "4, 5, 8, 12 or 14 numbers"},
      {Role::rotation, "9 numbers (3x3), or the 3 of a rotation vector"},
      {Role::translation, "3 numbers"},
      {Role::transform, "12 or 16 numbers (3x4 or 4x4)"},
      {Role::projection, "12 numbers (3x4)"}};
  const auto expected = kExpected.find(meant);
  const size_t count = entry.numbers.size();
  std::string holds = "holds " + entry.text.substr(0, kMaxTextShown);
  if (!entry.is_spoiled)
    holds = entry.text.empty() ? "is empty" : "holds '" + entry.text.substr(0, kMaxTextShown) + "'";
  if (count > 0) holds = fmt::format("holds {} number{}", count, count == 1 ? "" : "s");
  return fmt::format("{} {}, expected {}", entry.path, holds,
                     expected == kExpected.end() ? "a value of that kind" : expected->second);
}

std::string keys_there(const std::vector<CalibrationEntry>& entries) {
  static const std::vector<std::string> kExpected = {"M1",
                                                     "M2",
                                                     "K1",
                                                     "K2",
                                                     "D1",
                                                     "D2",
                                                     "R",
                                                     "T",
                                                     "cameraMatrix1",
                                                     "cameraMatrix2",
                                                     "distCoeffs1",
                                                     "distCoeffs2",
                                                     "camera_matrix",
                                                     "camera_matrix_left",
                                                     "camera_matrix_right",
                                                     "distortion_coefficients",
                                                     "rectification_matrix",
                                                     "projection_matrix",
                                                     "intrinsics",
                                                     "distortion_coeffs",
                                                     "T_cn_cnm1",
                                                     "rotation",
                                                     "translation"};
  std::vector<std::string> shown;
  std::string nearest;
  for (const CalibrationEntry& entry : entries) {
    if (shown.size() < kMaxKeysShown) shown.push_back(entry.path);
    if (!nearest.empty() || recognise(entry).value.role != Role::none) continue;
    if (const std::string expected = nearest_word(entry.path, kExpected); !expected.empty() && expected != entry.path)
      nearest = fmt::format("; '{}' is nearest to '{}'", entry.path, expected);
  }
  return fmt::format("the keys there are {}{}{}", fmt::join(shown, ", "), entries.size() > shown.size() ? ", ..." : "",
                     nearest);
}

}  // namespace palpate
