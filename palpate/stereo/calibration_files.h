#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "palpate/core/geometry.h"
#include "palpate/stereo/calibration_keys.h"
#include "palpate/stereo/calibration_tree.h"

namespace palpate {

/// What a file says of one camera, or, of CalibrationEye::unknown, of the pair or of the only camera in it.
struct Said {
  std::map<CalibrationRole, std::vector<double>> values;
  std::map<std::string, double> coefficients;
  std::string model;

  const std::vector<double>* find(CalibrationRole role) const {
    const auto found = values.find(role);
    return found == values.end() ? nullptr : &found->second;
  }
  double coefficient(const std::string& name, double otherwise = 0) const {
    const auto found = coefficients.find(name);
    return found == coefficients.end() ? otherwise : found->second;
  }
};

/// A value that is there and is not what its name says.
struct Misfit {
  CalibrationRole meant = CalibrationRole::none;
  CameraSide camera = CameraSide::unknown;
  std::string sentence;
};

struct Calibration {
  std::filesystem::path file;
  std::vector<CalibrationEntry> entries;
  std::array<Said, 3> said;  // by Camera
  bool by_matlab = false;
  std::vector<Misfit> misfits;

  Said& of(CameraSide camera) { return said[static_cast<size_t>(camera)]; }
  const Said& of(CameraSide camera) const { return said[static_cast<size_t>(camera)]; }
};

/// Throws BadInput with the reason and the keys that are there.
[[noreturn]] void refuse(const Calibration& calibration, const std::string& why);

/// The same where something of these kinds is missing: where it is there and unfit, that is the reason.
[[noreturn]] void refuse_missing(const Calibration& calibration, CameraSide camera,
                                 const std::vector<CalibrationRole>& roles, const std::string& why);

/// Both cameras have a value of this kind.
bool both_have(const Calibration& calibration, CalibrationRole role);

/// As the file states it; empty where it states none.
cv::Size image_size_of(const Calibration& calibration);

/// All that is said of a pair of cameras. Calibrations come in pieces: intrinsics.yml and extrinsics.yml, left.yaml and
/// right.yaml, cam0/sensor.yaml and cam1/sensor.yaml, a folder of text files. Throws BadInput.
Calibration whole_calibration(const std::filesystem::path& file);

}  // namespace palpate
