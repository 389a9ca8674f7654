#pragma once

#include <map>
#include <string>

#include "palpate/stereo/calibration_keys.h"

namespace palpate {

/// What a value is by its name: small letters, without blanks, underscores and what names the camera.
const std::map<std::string, CalibrationRole>& roles_by_name();

/// Names of single numbers, as they are called elsewhere and as they are called here.
const std::map<std::string, std::string>& coefficient_names();

}  // namespace palpate
