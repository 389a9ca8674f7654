#include "palpate/stereo/input_kinds.h"

#include <algorithm>

namespace palpate {

namespace {

struct CalibrationKind {
  InputKind input;
  std::vector<std::string> keys;  ///< in small letters; one of them in a path tells the kind
};

const std::vector<CalibrationKind>& registry() {
  static const std::vector<CalibrationKind> kKinds = {
      {{"MATLAB stereoParams", "MATLAB's Stereo Camera Calibrator, by `jsonencode(toStruct(stereoParams))`",
        "transposed matrices, pixels counted from 1 and size as [rows, columns] are converted"},
       {"cameraparameters"}},
      {{"Kalibr camchain", "Kalibr", "`intrinsics`, `distortion_coeffs` (radtan, equidistant), `T_cn_cnm1` in m"},
       {"t_cn_cnm1"}},
      {{"SCARED frame data", "SCARED (`frame_data.json`, `endoscope_calibration.yaml`)", "KL KR DL DR R T"},
       {"camera-calibration"}},
      {{"StereoMIS calibration", "StereoMIS (`StereoCalibration.ini`)",
        "fc_x, cc_x, kc_0 ..., R_0 ..., T_0 ... of StereoLeft and StereoRight"},
       {"stereoleft", "stereoright"}},
      {{"EndoVis text file", "EndoVis challenges (`camera_calibration.txt`)",
        "Camera-0-F, Camera-0-C, Camera-0-K ..., Extrinsic-Omega (a rotation vector), Extrinsic-T; remarks behind //"},
       {"extrinsic-omega"}},
      {{"camcal.json", "da Vinci recordings (StereoMIS and others)",
        "data.intrinsics of both cameras (f, c, k), data.extrinsics (om, T)"},
       {"extrinsics.om", "extrinsics[0].om"}},
      {{"EuRoC sensor.yaml", "EuRoC, and whoever writes its layout",
        "cam0/sensor.yaml is named, cam1/sensor.yaml stands beside it; intrinsics, distortion_coefficients, T_BS"},
       {"t_bs"}},
      {{"Hamlyn text files", "Hamlyn Centre (a folder of text files with bare numbers)",
        "files of one folder, called by left, right, intrinsic, distortion, extrinsic or l2r"},
       {"l2r", "_txt"}},
      {{"ROS camera_info",
        "camera_calibration, `rostopic echo`, `ros2 topic echo`, OpenCV's FileStorage with these keys",
        "a pair of files of which the left one is named; K D R P or k d r p; the right P holds the baseline"},
       {"projection_matrix", "rectification_matrix", "binning_x"}},
      {{"Middlebury calib.txt", "Middlebury, and whoever has rectified pictures", "cam0, cam1, baseline"}, {"doffs"}},
      {{"OpenCV stereo calibration",
        "cv::stereoCalibrate, its samples (one file, or intrinsics.yml and extrinsics.yml), SimpleStereo",
        "M1 D1 M2 D2 R T in every spelling (K1, M_l, KL, cameraMatrix1, camera_matrix_left, LEFT.K ...), YAML, XML or "
        "JSON of FileStorage, or nested lists of PyYAML and json"},
       {}},
  };
  return kKinds;
}

}  // namespace

std::vector<InputKind> calibration_kinds() {
  std::vector<InputKind> kinds;
  for (const CalibrationKind& kind : registry()) kinds.push_back(kind.input);
  kinds.push_back(
      {"lens models", "",
       "4, 5, 8, 12 or 14 coefficients of OpenCV; fisheye (Kannala-Brandt, 4) where the file says so "
       "(`distortion_model: equidistant`, `fisheye: 1`) or where third and fourth coefficient are above 0.02, "
       "refused where it can be either; omnidirectional models are refused"});
  kinds.push_back(
      {"pictures cut or scaled after the calibration", "", "`recording: {crop: [310, 20, 1280, 960], scale: 0.5}`"});
  return kinds;
}

std::string calibration_kind(const std::vector<CalibrationEntry>& entries) {
  const auto has = [&](const std::string& word) {
    return std::any_of(entries.begin(), entries.end(), [&](const CalibrationEntry& entry) {
      std::string path = entry.path;
      std::transform(path.begin(), path.end(), path.begin(), [](unsigned char c) { return std::tolower(c); });
      return path.find(word) != std::string::npos;
    });
  };
  for (const CalibrationKind& kind : registry())
    if (kind.keys.empty() || std::any_of(kind.keys.begin(), kind.keys.end(), has)) return kind.input.kind;
  return {};
}

std::vector<InputKind> recording_kinds() {
  return {
      {"video files", "whatever FFmpeg decodes: MP4, MOV, MKV, WebM, AVI, MPEG-TS ...",
       "every frame at its presentation stamp: edit lists, a varying rate, empty chunks and a start other than zero "
       "count; "
       "colour matrix and range as the file states; rotation; 10 and 12 bits"},
      {"left and right", "",
       "paired by stamp within half a frame; rows are those of the left video; `camera_missing` where the right one "
       "has "
       "none"},
      {"numbered images", "KITTI, Hamlyn, SCARED, EuRoC, Blender",
       "`left_%04d.png`, `image01/%010d.jpg`, `%04d/left.png`; gaps are gaps; times from times.txt, timestamps.txt or "
       "data.csv beside the images or one folder above; numbers that are ns, us or ms since 1970 are stamps; 8, 10, 12 "
       "or 16 bits; a name that is there as it stands is a file, `%%` is a percent sign"},
      {"both cameras in one picture", "da Vinci, 3D recorders", "`stereo` with `layout: side-by-side` or `top-bottom`"},
      {"interlaced pictures", "3D recorders, HD-SDI", "said; `deinterlace: true` keeps the even rows"},
      {"live", "V4L2, DeckLink, RTSP and RTP, whatever GStreamer reads",
       "a device (`0`, `/dev/video0`), a GStreamer pipeline (`a ! b`) or an `rtsp://` address for each camera, or for "
       "both in one picture; both in one pipeline and clock, paired by stamp, the newest pair wins, what was dropped "
       "is "
       "counted; a source that stops gives `source_lost` until it comes back ([console](console.md#live))"},
      {"addresses", "HTTP, UDP", "other addresses as OpenCV opens them; times are counted"},
  };
}

}  // namespace palpate
