#include "palpate/stereo/calibration_names.h"

#include <vector>

namespace palpate {

using Role = CalibrationRole;

const std::map<std::string, Role>& roles_by_name() {
  static const std::map<std::string, Role> kRoles = [] {
    std::map<std::string, Role> roles;
    const auto add = [&roles](Role role, const std::vector<std::string>& names) {
      for (const std::string& name : names) roles[name] = role;
    };
    add(Role::camera_matrix, {"k",
                              "m",
                              "a",
                              "mtx",
                              "mat",
                              "cm",
                              "camera",
                              "cameramatrix",
                              "kk",
                              "intrinsic",
                              "intrinsics",
                              "intrinsicmtx",
                              "mtxintrinsic",
                              "intrinsicmatrix",
                              "intrinsicsmatrix",
                              "cameramat",
                              "cammat",
                              "cammatrix",
                              "cameramtx",
                              "cammtx",
                              "kmatrix",
                              "matrix",
                              "cam",
                              "cameraintrinsics",
                              "cameraintrinsicmatrix",
                              "intrinsicparameters",
                              "newcameramatrix"});
    add(Role::distortion, {"d",
                           "dist",
                           "distortion",
                           "distcoeffs",
                           "distcoeff",
                           "distcoefs",
                           "distcoef",
                           "distortioncoefficients",
                           "distortioncoefficient",
                           "distortioncoeffs",
                           "distortioncoeff",
                           "distortioncoefs",
                           "distortionvector",
                           "distortionparameters",
                           "distortionparams",
                           "distortioncoefficents",
                           "kc",
                           "dc",
                           "coeffs",
                           "coefficients",
                           "distcoefficients",
                           "cameradistortion",
                           "distvec",
                           "distortionparameter",
                           "dcoeffs",
                           "camerak"});
    add(Role::rotation, {"r",
                         "rot",
                         "rotation",
                         "rotationmatrix",
                         "rotmat",
                         "rmat",
                         "om",
                         "rvec",
                         "rotationvector",
                         "stereor",
                         "rotmatrix",
                         "rodrigues",
                         "rotationofcamera",
                         "extrinsicrotation",
                         "rstereo",
                         "rotationlefttoright",
                         "rlefttoright",
                         "rl2r",
                         "rlr",
                         "extrinsicsr",
                         "omega",
                         "extrinsicomega",
                         "extrinsicsomega"});
    add(Role::translation, {"t",
                            "trans",
                            "translation",
                            "translationvector",
                            "transvec",
                            "tvec",
                            "tmat",
                            "translationofcamera",
                            "stereot",
                            "tstereo",
                            "translationmatrix",
                            "extrinsictranslation",
                            "translationlefttoright",
                            "tlefttoright",
                            "tl2r",
                            "tlr",
                            "transmat",
                            "transvector",
                            "extrinsict",
                            "extrinsicst"});
    add(Role::transform, {"tcncnm", "transform", "extrinsic", "extrinsics", "extrinsicmatrix", "extrinsicsmatrix",
                          "lefttoright", "l2r", "left2right", "stereotransform", "rt", "tlr", "trl", "cameraextrinsic",
                          "cameraextrinsics", "rightfromleft", "transformation", "transformationmatrix", "posecamera"});
    add(Role::body_pose, {"tbs", "timucam", "tbodycam", "tbc"});
    add(Role::rectification, {"rect", "rectification", "rectificationmatrix", "rectificationrotation", "rrect"});
    add(Role::projection, {"p", "proj", "projection", "projectionmatrix", "prect"});
    add(Role::image_size, {"imagesize", "size", "resolution", "imgsize", "imagesizepx", "imageresolution", "framesize",
                           "camerasize", "res", "imagedimensions"});
    add(Role::distortion_model,
        {"distortionmodel", "distortiontype", "lensmodel", "lens", "cameramodel", "model", "fisheye", "isfisheye",
         "calibrationmodel", "projectionmodel", "cameratype", "modeltype"});
    add(Role::focal, {"fc", "f", "focallength", "focal", "focalpx", "cameraf"});
    add(Role::principal, {"cc", "c", "principalpoint", "opticalcenter", "center", "principal", "pp", "camerac"});
    add(Role::radial, {"radialdistortion", "radial"});
    add(Role::tangential, {"tangentialdistortion", "tangential"});
    return roles;
  }();
  return kRoles;
}

const std::map<std::string, std::string>& coefficient_names() {
  static const std::map<std::string, std::string> kNames = {
      {"fx", "fx"},
      {"fcx", "fx"},
      {"focallengthx", "fx"},
      {"focalx", "fx"},
      {"alphax", "fx"},
      {"fy", "fy"},
      {"fcy", "fy"},
      {"focallengthy", "fy"},
      {"focaly", "fy"},
      {"alphay", "fy"},
      {"cx", "cx"},
      {"ccx", "cx"},
      {"u0", "cx"},
      {"ppx", "cx"},
      {"principalpointx", "cx"},
      {"x0", "cx"},
      {"cy", "cy"},
      {"ccy", "cy"},
      {"v0", "cy"},
      {"ppy", "cy"},
      {"principalpointy", "cy"},
      {"y0", "cy"},
      {"f", "f"},
      {"focal", "f"},
      {"focallength", "f"},
      {"focalpx", "f"},
      {"k1", "k1"},
      {"k2", "k2"},
      {"k3", "k3"},
      {"k4", "k4"},
      {"k5", "k5"},
      {"k6", "k6"},
      {"p1", "p1"},
      {"p2", "p2"},
      {"baseline", "baseline"},
      {"baselinemm", "baseline"},
      {"baselinem", "baseline"},
      {"imagewidth", "width"},
      {"width", "width"},
      {"resx", "width"},
      {"imgwidth", "width"},
      {"w", "width"},
      {"imageheight", "height"},
      {"height", "height"},
      {"resy", "height"},
      {"imgheight", "height"},
      {"h", "height"},
  };
  return kNames;
}

}  // namespace palpate
