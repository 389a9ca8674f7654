#include <fmt/core.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <optional>
#include <sstream>

#include "palpate/core/errors.h"
#include "palpate/stereo/calibration_files.h"
#include "palpate/stereo/check_rig.h"
#include "palpate/stereo/input_kinds.h"
#include "palpate/stereo/rig.h"

namespace palpate {
namespace {

using Role = CalibrationRole;
using Numbers = std::vector<double>;

constexpr double kMaxBaseline_mm = 200;

/// The camera matrix, wherever its numbers stand.
std::optional<cv::Matx33d> camera_matrix_of(const Said& camera, const Said& both) {
  if (const Numbers* K = camera.find(Role::camera_matrix)) return cv::Matx33d(K->data());
  const auto from = [](double fx, double fy, double cx, double cy) {
    return cv::Matx33d(fx, 0, cx, 0, fy, cy, 0, 0, 1);
  };
  if (const Numbers* n = camera.find(Role::intrinsics)) return from((*n)[0], (*n)[1], (*n)[2], (*n)[3]);
  if (const Numbers* f = camera.find(Role::focal), *c = camera.find(Role::principal); f && c)
    return from((*f)[0], (*f)[1], (*c)[0], (*c)[1]);
  for (const Said* said : {&camera, &both}) {
    const double f = said->coefficient("f"), fx = said->coefficient("fx", f);
    if (fx > 0 && said->coefficients.count("cx") && said->coefficients.count("cy"))
      return from(fx, said->coefficient("fy", fx), said->coefficient("cx"), said->coefficient("cy"));
  }
  if (const Numbers* P = camera.find(Role::projection))
    return cv::Matx33d((*P)[0], (*P)[1], (*P)[2], (*P)[4], (*P)[5], (*P)[6], (*P)[8], (*P)[9], (*P)[10]);
  return std::nullopt;
}

/// Nothing where the file says nothing of it.
std::optional<Numbers> distortion_of(const Said& said) {
  if (const Numbers* D = said.find(Role::distortion)) return *D;
  if (const Numbers* radial = said.find(Role::radial)) {
    const Numbers* tangential = said.find(Role::tangential);
    Numbers D = {(*radial)[0], (*radial)[1], tangential ? (*tangential)[0] : 0, tangential ? (*tangential)[1] : 0};
    if (radial->size() == 3) D.push_back((*radial)[2]);
    return D;
  }
  if (!said.coefficients.count("k1")) return std::nullopt;
  if (said.coefficients.count("k4") && !said.coefficients.count("p1"))
    return Numbers{said.coefficient("k1"), said.coefficient("k2"), said.coefficient("k3"), said.coefficient("k4")};
  return Numbers{said.coefficient("k1"), said.coefficient("k2"), said.coefficient("p1"), said.coefficient("p2"),
                 said.coefficient("k3")};
}

bool is_transposed(const cv::Matx33d& K) {
  return K(2, 2) == 1 && K(0, 2) == 0 && K(1, 2) == 0 && (K(2, 0) != 0 || K(2, 1) != 0);
}

/// Tangential distortion above this does not exist in a lens that somebody glued straight; below the smaller one four
/// numbers are k1 k2 p1 p2.
constexpr double kLargestTangential = 0.02, kUsualTangential = 0.01;

/// "pinhole radtan": what the file calls the lens, word by word, in small letters.
std::vector<std::string> lens_words(const Calibration& calibration, const Said& said) {
  std::istringstream text(said.model + calibration.of(CameraSide::unknown).model);
  return {std::istream_iterator<std::string>(text), {}};
}

/// Before anything of such a camera is read: its intrinsics are other numbers.
void refuse_other_lenses(const Calibration& calibration, const Said& said, const char* camera) {
  for (const std::string& word : lens_words(calibration, said))
    for (const char* other : {"omni", "eucm", "ucm", "double_sphere", "double-sphere", "fov", "mei"})
      if (word == "ds" || word.find(other) != std::string::npos)
        refuse(calibration, fmt::format("the lens model of the {} camera is {}, expected plumb_bob (k1 k2 p1 p2 k3), "
                                        "rational_polynomial or a fisheye model (equidistant, Kannala-Brandt)",
                                        camera, word));
}

LensModel lens_of(const Calibration& calibration, const Said& said, const Numbers& D, const char* camera) {
  const std::string model = said.model + calibration.of(CameraSide::unknown).model;
  const auto says = [&model](std::initializer_list<const char*> words) {
    return std::any_of(words.begin(), words.end(), [&](const char* w) { return model.find(w) != std::string::npos; });
  };
  if (says({"fisheye", "equidistant", "kannala", "kb4", "equi"})) {
    if (D.size() != 4)
      refuse(calibration,
             fmt::format("the lens model of the {} camera is{}, expected 4 coefficients (k1 k2 k3 k4) where "
                         "there are {}, or distortion_model plumb_bob",
                         camera, model, D.size()));
    return LensModel::fisheye;
  }
  if (D.size() != 4 || says({"plumb", "radtan", "rational", "brown", "radial", "opencv"})) return LensModel::brown;
  const double tangential = std::max(std::abs(D[2]), std::abs(D[3]));
  if (tangential > kLargestTangential) return LensModel::fisheye;
  if (tangential <= kUsualTangential) return LensModel::brown;
  refuse(calibration,
         fmt::format(
             "the four distortion coefficients of the {} camera can be k1 k2 p1 p2 or, with {:g} and {:g} in third "
             "and fourth place, k1 k2 k3 k4 of a fisheye lens; say which by distortion_model: plumb_bob or "
             "distortion_model: fisheye in the file",
             camera, D[2], D[3]));
}

/// fx, fy, cx without cy.
void refuse_half_a_matrix(const Calibration& calibration, const Said& said, const char* camera) {
  std::vector<std::string> there, missing;
  for (const char* name : {"fx", "cx", "cy"})
    (said.coefficients.count(name) || (name == std::string("fx") && said.coefficients.count("f")) ? there : missing)
        .push_back(name);
  if (there.empty()) return;
  refuse(calibration, fmt::format("the {} camera has {} but no {}, expected fx, fy, cx, cy (or fc_x, fc_y, cc_x, cc_y)",
                                  camera, fmt::join(there, ", "), fmt::join(missing, ", ")));
}

Camera camera_of(const Calibration& calibration, CameraSide side, StereoRig& rig) {
  const char* name = side == CameraSide::left ? "left" : "right";
  const int number = side == CameraSide::left ? 1 : 2;
  const Said& said = calibration.of(side);
  refuse_other_lenses(calibration, said, name);
  const auto K = camera_matrix_of(said, calibration.of(CameraSide::unknown));
  if (!K) refuse_half_a_matrix(calibration, said, name);
  if (!K)
    refuse_missing(calibration, side, {Role::camera_matrix, Role::intrinsics, Role::projection},
                   fmt::format("no camera matrix of the {} camera, expected M{} (or K{}, cameraMatrix{}, "
                               "camera_matrix_{}, {}.K, cam{}.intrinsics ...)",
                               name, number, number, number, name, name, number - 1));
  Camera camera;
  camera.K = *K;
  const bool transposed = is_transposed(camera.K);
  if (transposed) camera.K = camera.K.t();
  if (transposed || calibration.by_matlab) {
    camera.K(0, 2) -= 1;
    camera.K(1, 2) -= 1;
    rig.notes.push_back(fmt::format("{} camera matrix as MATLAB writes it: {}pixels counted from 1, turned into ours",
                                    name, transposed ? "transposed, " : ""));
  }
  if (const auto D = distortion_of(said)) {
    camera.distortion = *D;
    camera.lens = lens_of(calibration, said, *D, name);
    if (camera.lens == LensModel::fisheye)
      rig.notes.push_back(fmt::format("{} camera: fisheye lens (Kannala-Brandt, k1 k2 k3 k4)", name));
  } else if (const auto words = lens_words(calibration, said);
             !said.find(Role::projection) && !calibration.of(CameraSide::unknown).coefficients.count("baseline") &&
             std::find(words.begin(), words.end(), "none") == words.end()) {
    refuse_missing(calibration, side, {Role::distortion},
                   fmt::format("no distortion of the {} camera, expected D{} (or distCoeffs{}, "
                               "distortion_coefficients_{}, cam{}.distortion_coeffs ...; distortion_model: none where "
                               "there is none)",
                               name, number, number, name, number - 1));
  }
  return camera;
}

Mat3 rotation_from(const Numbers& numbers) {
  cv::Mat rotation(3, 3, CV_64F);
  if (numbers.size() == 3)
    cv::Rodrigues(cv::Vec3d(numbers.data()), rotation);
  else
    rotation = cv::Mat(cv::Matx33d(numbers.data()));
  Mat3 result;
  cv::cv2eigen(rotation, result);
  return result;
}

Vec3 vector_from(const Numbers& numbers) {
  return {numbers[0], numbers[1], numbers[2]};
}

struct Pose {
  Mat3 rotation = Mat3::Identity();
  Vec3 translation = Vec3::Zero();
};

/// In a rectified pair x_right = x_left + (P_right[0,3] / P_right[0,0], 0, 0), each in its rectified axes.
Pose pose_of_projections(const Said& left, const Said& right) {
  const auto shift = [](const Said& said) {
    const Numbers& P = *said.find(Role::projection);
    return P[0] != 0 ? P[3] / P[0] : 0;
  };
  const auto turned = [](const Said& said) {
    const Numbers* R = said.find(Role::rectification) ? said.find(Role::rectification) : said.find(Role::rotation);
    return R && R->size() == 9 && said.find(Role::camera_matrix) ? rotation_from(*R) : Mat3(Mat3::Identity());
  };
  const Mat3 left_turned = turned(left), right_turned = turned(right);
  return {right_turned.transpose() * left_turned, right_turned.transpose() * Vec3(shift(right) - shift(left), 0, 0)};
}

/// Of the first three rows of a 4 x 4 matrix.
Pose pose_from(const Numbers& m) {
  Pose pose;
  pose.rotation << m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10];
  pose.translation = {m[3], m[7], m[11]};
  return pose;
}

/// Both cameras in the axes of the body that carries them.
Pose pose_of_bodies(const Said& left, const Said& right) {
  const Pose body_from_left = pose_from(*left.find(Role::body_pose)),
             body_from_right = pose_from(*right.find(Role::body_pose));
  const Mat3 right_from_body = body_from_right.rotation.transpose();
  return {right_from_body * body_from_left.rotation,
          right_from_body * (body_from_left.translation - body_from_right.translation)};
}

std::optional<Pose> world_pose(const Said& said) {
  Pose pose;
  if (const Numbers* M = said.find(Role::transform)) return pose_from(*M);
  const Numbers *R = said.find(Role::rotation), *T = said.find(Role::translation);
  if (!T) return std::nullopt;
  if (R) pose.rotation = rotation_from(*R);
  pose.translation = vector_from(*T);
  return pose;
}

Pose pose_of(const Calibration& calibration) {
  const Said &both = calibration.of(CameraSide::unknown), &left = calibration.of(CameraSide::left),
             &right = calibration.of(CameraSide::right);
  if (const auto pose = world_pose(both)) {
    if (!both.find(Role::transform) && !both.find(Role::rotation))
      refuse_missing(calibration, CameraSide::unknown, {Role::rotation}, "key R is missing");
    return *pose;
  }
  const auto of_right = world_pose(right);
  if (of_right && !(right.find(Role::projection) && !right.find(Role::translation))) {
    const auto of_left = world_pose(left);
    if (!of_left) return *of_right;
    const Mat3 rotation = of_right->rotation * of_left->rotation.transpose();
    return {rotation, of_right->translation - rotation * of_left->translation};
  }
  if (both_have(calibration, Role::body_pose)) return pose_of_bodies(left, right);
  if (both_have(calibration, Role::projection)) return pose_of_projections(left, right);
  if (both.coefficients.count("baseline"))
    return {Mat3::Identity(), Vec3(-std::abs(both.coefficient("baseline")), 0, 0)};
  refuse_missing(calibration, CameraSide::unknown, {Role::rotation, Role::translation, Role::transform},
                 "no pose of the cameras to each other, expected R and T (x_right = R x_left + T)");
}

// All distances below 0.2 are metres and all above 1 are millimetres, because a baseline is 1-200 mm.
double to_mm(TranslationUnit unit, double length) {
  if (unit == TranslationUnit::mm) return 1;
  if (unit == TranslationUnit::m) return 1000;
  return length <= kMaxBaseline_mm / 1000 ? 1000 : 1;
}

StereoRig rig_of(const Calibration& calibration, TranslationUnit unit) {
  StereoRig rig;
  rig.file = calibration.file;
  rig.image_size = image_size_of(calibration);
  rig.left = camera_of(calibration, CameraSide::left, rig);
  rig.right = camera_of(calibration, CameraSide::right, rig);
  Pose pose = pose_of(calibration);
  const bool transposed = calibration.by_matlab && calibration.of(CameraSide::unknown).find(Role::rotation) &&
                          calibration.of(CameraSide::unknown).find(Role::rotation)->size() == 9;
  const Numbers* K = calibration.of(CameraSide::left).find(Role::camera_matrix);
  if (transposed || (K && is_transposed(cv::Matx33d(K->data())))) pose.rotation.transposeInPlace();
  rig.right_from_left = pose.rotation;
  rig.right_from_left_mm = pose.translation * to_mm(unit, pose.translation.norm());
  rig.notes.insert(rig.notes.begin(), "read as " + calibration_kind(calibration.entries));
  return rig;
}

}  // namespace

StereoRig read_rig(const std::filesystem::path& calibration, TranslationUnit unit) {
  StereoRig rig = rig_of(whole_calibration(calibration), unit);
  check_rig(rig);
  return rig;
}

}  // namespace palpate
