#pragma once

#include <optional>
#include <string>
#include <vector>

#include "palpate/stereo/calibration_tree.h"

namespace palpate {

/// What a value of a calibration file is.
enum class CalibrationRole {
  none,
  camera_matrix,    ///< 3 x 3
  intrinsics,       ///< fx fy cx cy
  focal,            ///< fx fy
  principal,        ///< cx cy
  distortion,       ///< k1 k2 p1 p2 k3 ..., or k1 k2 k3 k4 of a fisheye lens
  radial,           ///< k1 k2 k3 of MATLAB
  tangential,       ///< p1 p2 of MATLAB
  coefficient,      ///< a single number: fx, fy, cx, cy, k1, p1, baseline ...
  rotation,         ///< 3 x 3 or a rotation vector
  translation,      ///< 3
  transform,        ///< 3 x 4 or 4 x 4
  body_pose,        ///< 4 x 4, from the camera to the body that carries it (EuRoC's T_BS)
  rectification,    ///< 3 x 3
  projection,       ///< 3 x 4
  image_size,       ///< width, height
  distortion_model  ///< a word
};

enum class CameraSide { unknown, left, right };

struct CalibrationValue {
  CalibrationRole role = CalibrationRole::none;
  CalibrationRole meant = CalibrationRole::none;  ///< what its name says, where what it holds does not fit
  CameraSide camera = CameraSide::unknown;
  std::string name;  ///< of a coefficient, in small letters
  const CalibrationEntry* entry = nullptr;
};

/// Told by its keys and its size: M1, K_left, LEFT.K, cameraMatrix1, KL, cam0.intrinsics, CameraParameters1.K ...
/// Cameras that are numbered count from 0 or from 1, as the file as a whole shows.
std::vector<CalibrationValue> recognised(const std::vector<CalibrationEntry>& entries);

/// "M1 holds 8 numbers, expected 9 numbers (3x3)" of a value that does not fit its name.
std::string misfit(const CalibrationEntry& entry, CalibrationRole meant);

/// "the keys there are a, b, c; 'camra_matrix' is nearest to 'camera_matrix'", for sentences.
std::string keys_there(const std::vector<CalibrationEntry>& entries);

}  // namespace palpate
