#include "palpate/stereo/calibration_files.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <optional>

#include "palpate/core/errors.h"

namespace palpate {
namespace {

using Role = CalibrationRole;
using Numbers = std::vector<double>;

std::string small(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

/// Several sets of cameras in one file (one per picture size): which of them is meant cannot be told.
void require_one_set(const Calibration& calibration, const CalibrationValue& value, const Said& said) {
  const auto known = said.coefficients.find(value.name);
  if (known == said.coefficients.end() || known->second == value.entry->numbers.front()) return;
  if (value.name != "fx" && value.name != "cx") return;
  refuse(calibration,
         fmt::format("{} is {:.6g} where another {} of that camera is {:.6g}, expected one pair of cameras: "
                     "keep those of the size of your pictures",
                     value.entry->path, value.entry->numbers.front(), value.name, known->second));
}

/// The factory file of ZED cameras says its rotation by RX, CV and RZ in an order of its own.
void refuse_zed(const Calibration& calibration) {
  for (const CalibrationEntry& entry : calibration.entries)
    if (entry.path.starts_with("LEFT_CAM_"))
      refuse(calibration, "a factory file of a ZED camera, which is not read; expected M1 D1 M2 D2 R T");
}

void sort_in(Calibration& calibration) {
  refuse_zed(calibration);
  for (const CalibrationValue& value : recognised(calibration.entries)) {
    const CalibrationEntry& entry = *value.entry;
    if (value.meant != Role::none)
      calibration.misfits.push_back({value.meant, value.camera, misfit(entry, value.meant)});
    if (value.role != Role::none &&
        !std::all_of(entry.numbers.begin(), entry.numbers.end(), [](double number) { return std::isfinite(number); }))
      throw BadInput(fmt::format("{}: {} is [{:.6g}], expected finite numbers", calibration.file.string(), entry.path,
                                 fmt::join(entry.numbers, ", ")));
    calibration.by_matlab = calibration.by_matlab || small(entry.path).find("cameraparameters") != std::string::npos;
    Said& said = calibration.of(value.camera);
    if (value.role == Role::coefficient) {
      require_one_set(calibration, value, said);
      said.coefficients.emplace(value.name, entry.numbers.front());
    } else if (value.role == Role::distortion_model) {
      const bool is_flag = small(entry.path).find("fisheye") != std::string::npos;
      const bool is_set = entry.text == "true" || (!entry.numbers.empty() && entry.numbers.front() != 0);
      if (is_flag && is_set) said.model += " fisheye";
      if (!is_flag) said.model += " " + small(entry.text);
    } else if (value.role != Role::none) {
      said.values.emplace(value.role, entry.numbers);
    }
  }
}

Calibration calibration_of(const std::filesystem::path& file) {
  Calibration calibration{file, read_calibration_tree(file), {}, false, {}};
  sort_in(calibration);
  return calibration;
}

bool has_camera(const Said& said) {
  return said.find(Role::camera_matrix) || said.find(Role::intrinsics) || said.find(Role::projection) ||
         said.find(Role::focal) || said.coefficients.count("fx");
}
bool has_pose(const Calibration& calibration) {
  for (const CameraSide camera : {CameraSide::unknown, CameraSide::right})
    for (const Role role : {Role::translation, Role::transform})
      if (calibration.of(camera).find(role)) return true;
  return calibration.of(CameraSide::unknown).coefficients.count("baseline") > 0;
}

/// The same name with one word exchanged for another, in the same capitals; nothing where the word is not in it or no
/// such file is there.
std::optional<std::filesystem::path> beside(const std::filesystem::path& file, const std::string& word,
                                            const std::string& other) {
  const std::string name = file.filename().string();
  const size_t at = small(name).rfind(word);
  if (at == std::string::npos) return std::nullopt;
  std::string spelled = other;
  if (std::isupper(static_cast<unsigned char>(name[at]))) spelled[0] = static_cast<char>(std::toupper(spelled[0]));
  if (word.size() > 1 && std::isupper(static_cast<unsigned char>(name[at + 1])))
    std::transform(spelled.begin(), spelled.end(), spelled.begin(), [](unsigned char c) { return std::toupper(c); });
  return file.parent_path() / (name.substr(0, at) + spelled + name.substr(at + word.size()));
}

std::optional<std::filesystem::path> first_there(const std::filesystem::path& file,
                                                 const std::vector<std::pair<std::string, std::string>>& exchanges) {
  std::error_code ignored;
  for (const auto& [word, other] : exchanges)
    if (const auto path = beside(file, word, other); path && std::filesystem::exists(*path, ignored)) return path;
  return std::nullopt;
}

/// Of what one file lacks, the other one gives.
void add_what_is_missing(Calibration& calibration, const Calibration& other) {
  for (size_t camera = 0; camera < calibration.said.size(); ++camera) {
    calibration.said[camera].values.insert(other.said[camera].values.begin(), other.said[camera].values.end());
    calibration.said[camera].coefficients.insert(other.said[camera].coefficients.begin(),
                                                 other.said[camera].coefficients.end());
  }
}

}  // namespace

void refuse(const Calibration& calibration, const std::string& why) {
  throw BadInput(fmt::format("{}: {}; {}", calibration.file.string(), why, keys_there(calibration.entries)));
}

void refuse_missing(const Calibration& calibration, CameraSide camera, const std::vector<Role>& roles,
                    const std::string& why) {
  for (const Misfit& unfit : calibration.misfits) {
    const bool is_its = camera == CameraSide::unknown || unfit.camera == camera || unfit.camera == CameraSide::unknown;
    if (is_its && std::find(roles.begin(), roles.end(), unfit.meant) != roles.end())
      refuse(calibration, unfit.sentence);
  }
  refuse(calibration, why);
}

bool both_have(const Calibration& calibration, Role role) {
  return calibration.of(CameraSide::left).find(role) && calibration.of(CameraSide::right).find(role);
}

cv::Size image_size_of(const Calibration& calibration) {
  for (const CameraSide camera : {CameraSide::unknown, CameraSide::left}) {
    const Said& said = calibration.of(camera);
    const double width = said.coefficient("width"), height = said.coefficient("height");
    if (width > 0 && height > 0 && width < 1e5 && height < 1e5) return cv::Size(cvRound(width), cvRound(height));
    if (const Numbers* size = said.find(Role::image_size);
        size && (*size)[0] > 0 && (*size)[0] < 1e5 && (*size)[1] < 1e5) {
      const cv::Size stated(cvRound((*size)[0]), cvRound((*size)[1]));
      return calibration.by_matlab ? cv::Size(stated.height, stated.width) : stated;
    }
  }
  return {};
}

Calibration whole_calibration(const std::filesystem::path& file) {
  Calibration calibration = calibration_of(file);
  if (is_bare_numbers(file)) {
    std::error_code ignored;
    for (const auto& entry : std::filesystem::directory_iterator(file.parent_path(), ignored)) {
      if (!is_bare_numbers(entry.path()) || entry.path() == file) continue;
      const auto more = read_calibration_tree(entry.path());
      calibration.entries.insert(calibration.entries.end(), more.begin(), more.end());
    }
    calibration.said = {};
    calibration.misfits.clear();
    sort_in(calibration);
    return calibration;
  }
  const bool has_left = has_camera(calibration.of(CameraSide::left)),
             has_right = has_camera(calibration.of(CameraSide::right));
  const bool only_camera = !has_left && !has_right && has_camera(calibration.of(CameraSide::unknown)) &&
                           !calibration.of(CameraSide::unknown).coefficients.count("baseline");
  if (only_camera) {
    const std::vector<std::pair<std::string, std::string>> names = {
        {"left", "right"}, {"cam0", "cam1"}, {"camera0", "camera1"}, {"_l", "_r"}, {"_0", "_1"}, {"cam1", "cam2"}};
    auto right = first_there(file, names);
    // cam0/sensor.yaml and cam1/sensor.yaml
    if (const auto folder = first_there(std::filesystem::absolute(file).parent_path(), names); !right && folder)
      if (std::error_code ignored; std::filesystem::exists(*folder / file.filename(), ignored))
        right = *folder / file.filename();
    if (!right) right = beside(file, "left", "right");
    if (!right)
      throw BadInput(
          fmt::format("{}: it holds one camera only; of a pair of files the left one is named, expected "
                      "\"left\" in the name so that the right one can be found beside it",
                      file.string()));
    Calibration other = calibration_of(*right);
    calibration.of(CameraSide::left) = calibration.of(CameraSide::unknown);
    calibration.of(CameraSide::right) = other.of(CameraSide::unknown);
    calibration.of(CameraSide::unknown) = {};
    const cv::Size size = image_size_of(calibration);
    other.of(CameraSide::left) = other.of(CameraSide::unknown);
    if (image_size_of(other) != size)
      throw BadInput(fmt::format("{} is for {}x{} px but {} for {}x{} px, expected the same size", file.string(),
                                 size.width, size.height, right->string(), image_size_of(other).width,
                                 image_size_of(other).height));
    if (!both_have(calibration, Role::projection) && !both_have(calibration, Role::body_pose))
      throw BadInput(
          fmt::format("{} and {}: no projection_matrix (P) in both of them, which holds the distance of the "
                      "cameras",
                      file.string(), right->string()));
  } else if ((has_left || has_right) && !has_pose(calibration) && !both_have(calibration, Role::projection)) {
    const auto extrinsics =
        first_there(file, {{"intrinsics", "extrinsics"}, {"intrinsic", "extrinsic"}, {"int", "ext"}});
    if (!extrinsics)
      refuse_missing(calibration, CameraSide::unknown, {Role::rotation, Role::translation, Role::transform},
                     "R and T are missing, and no extrinsics file stands beside it (the same name with extrinsics for "
                     "intrinsics); expected all of a stereo calibration, M1 D1 M2 D2 R T");
    add_what_is_missing(calibration, calibration_of(*extrinsics));
  } else if (!has_camera(calibration.of(CameraSide::left)) || !has_camera(calibration.of(CameraSide::right)) ||
             !calibration.of(CameraSide::left).find(Role::camera_matrix)) {
    if (const auto intrinsics =
            first_there(file, {{"extrinsics", "intrinsics"}, {"extrinsic", "intrinsic"}, {"ext", "int"}}))
      if (has_pose(calibration)) {
        Calibration cameras = calibration_of(*intrinsics);
        cameras.file = calibration.file;
        add_what_is_missing(cameras, calibration);
        return cameras;
      }
  }
  return calibration;
}

}  // namespace palpate
