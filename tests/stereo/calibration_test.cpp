#include <fmt/core.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "palpate/stereo/rig.h"
#include "tests/stereo/files.h"
#include "tests/support/reference_data.h"

namespace palpate {
namespace {

using test::sentence_of;
using test::TemporaryFolder;
using testing::AllOf;
using testing::HasSubstr;

using Numbers = std::vector<double>;

/// One pair of cameras, that every file below says in its own way.
const Numbers kK1 = {705, 0, 330, 0, 698, 232, 0, 0, 1}, kK2 = {712, 0, 345, 0, 709, 251, 0, 0, 1};
const Numbers kD1 = {-0.21, 0.08, 0.001, -0.0007, 0.01}, kD2 = {-0.19, 0.06, -0.0012, 0.0005, 0.002};
const Numbers kT = {-5.2, 0.15, -0.1};

Mat3 turn() {
  return (Eigen::AngleAxisd(0.03, Vec3::UnitY()) * Eigen::AngleAxisd(-0.02, Vec3::UnitX())).toRotationMatrix();
}
Numbers rows_of(const Mat3& m) {
  Numbers numbers;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) numbers.push_back(m(i, j));
  return numbers;
}
Numbers transposed(const Numbers& m) {
  return {m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]};
}
Numbers kR() {
  return rows_of(turn());
}

std::string list(const Numbers& numbers) {
  return fmt::format("{:.12g}", fmt::join(numbers, ", "));
}
std::string nested(const Numbers& numbers, size_t columns) {
  std::string text;
  for (size_t i = 0; i < numbers.size(); i += columns)
    text +=
        fmt::format("{}[{}]", i > 0 ? ", " : "",
                    list({numbers.begin() + static_cast<long>(i), numbers.begin() + static_cast<long>(i + columns)}));
  return "[" + text + "]";
}
std::string matrix(const std::string& key, int rows, const Numbers& numbers) {
  return fmt::format("{}: !!opencv-matrix\n   rows: {}\n   cols: {}\n   dt: d\n   data: [ {} ]\n", key, rows,
                     numbers.size() / static_cast<size_t>(rows), list(numbers));
}
std::string file_storage(const std::string& k1, const std::string& d1, const std::string& k2, const std::string& d2,
                         const std::string& r = "R", const std::string& t = "T") {
  return "%YAML:1.0\n---\n" + matrix(k1, 3, kK1) + matrix(d1, 1, kD1) + matrix(k2, 3, kK2) + matrix(d2, 5, kD2) +
         matrix(r, 3, kR()) + matrix(t, 3, kT);
}

class CalibrationFile : public ::testing::Test {
 protected:
  StereoRig read(const std::string& name, const std::string& text) { return read_rig(folder_.write(name, text)); }

  void expect_the_pair(const std::string& name, const std::string& text, double tolerance = 1e-9) {
    SCOPED_TRACE(text.substr(0, 600));
    StereoRig rig;
    ASSERT_EQ(sentence_of([&] { rig = read(name, text); }), "");
    EXPECT_LT(cv::norm(rig.left.K - cv::Matx33d(kK1.data())), tolerance);
    EXPECT_LT(cv::norm(rig.right.K - cv::Matx33d(kK2.data())), tolerance);
    EXPECT_LT((rig.right_from_left - turn()).norm(), tolerance);
    EXPECT_LT((rig.right_from_left_mm - Vec3(kT[0], kT[1], kT[2])).norm(), tolerance);
    EXPECT_EQ(rig.left.distortion, kD1);
    EXPECT_EQ(rig.right.distortion, kD2);
  }
  std::string refusal(const std::string& name, const std::string& text) {
    return sentence_of([&] { read(name, text); });
  }

  TemporaryFolder folder_;
};

TEST_F(CalibrationFile, IsKnownInEverySpellingOfItsKeys) {
  const std::vector<std::array<std::string, 4>> spellings = {
      {"M1", "D1", "M2", "D2"},
      {"K1", "D1", "K2", "D2"},
      {"M_l", "D_l", "M_r", "D_r"},
      {"KL", "DL", "KR", "DR"},
      {"mtxL", "distL", "mtxR", "distR"},
      {"K0", "D0", "K1", "D1"},
      {"mtx1", "dist1", "mtx2", "dist2"},
      {"cameraMatrix1", "distCoeffs1", "cameraMatrix2", "distCoeffs2"},
      {"camera_matrix_left", "distortion_coefficients_left", "camera_matrix_right", "distortion_coefficients_right"},
      {"left_camera_matrix", "left_distortion", "right_camera_matrix", "right_distortion"},
      {"leftCameraMatrix", "leftDistCoeffs", "rightCameraMatrix", "rightDistCoeffs"},
      {"LEFT.K", "LEFT.D", "RIGHT.K", "RIGHT.D"},
      {"Intrinsic_mtx_1", "dist_1", "Intrinsic_mtx_2", "dist_2"},
  };
  for (const auto& [k1, d1, k2, d2] : spellings) expect_the_pair("c.yaml", file_storage(k1, d1, k2, d2));
  for (const auto& [r, t] : {std::pair{"Rot", "Trans"}, std::pair{"rotation", "translation"},
                             std::pair{"rotation_matrix", "translation_vector"}, std::pair{"rotationMatrix", "tvec"}})
    expect_the_pair("c.yml", file_storage("M1", "D1", "M2", "D2", r, t));
}

TEST_F(CalibrationFile, IsYamlOfPythonXmlOrJsonAlike) {
  const std::string lists = fmt::format("M1: {}\nD1: [[{}]]\nM2: {}\nD2: [{}]\nR: {}\nT: {}\n", nested(kK1, 3),
                                        list(kD1), nested(kK2, 3), list(kD2), nested(kR(), 3), nested(kT, 1));
  expect_the_pair("python.yaml", lists);
  expect_the_pair("notepad.yaml", "\xEF\xBB\xBF%YAML 1.0\r\n---\r\n" + lists);
  expect_the_pair("c.json",
                  fmt::format("{{\n\t\"M1\": {}, \"D1\": [{}], \"M2\": {}, \"D2\": [{}],\n\t\"R\": {}, \"T\": [{}]}}",
                              nested(kK1, 3), list(kD1), nested(kK2, 3), list(kD2), nested(kR(), 3), list(kT)));
  const auto xml = [](const std::string& key, int rows, const Numbers& numbers) {
    return fmt::format(
        "<{0} type_id=\"opencv-matrix\"><rows>{1}</rows><cols>{2}</cols><dt>d</dt>\n<data>{3:.12g}</data></{0}>\n", key,
        rows, numbers.size() / static_cast<size_t>(rows), fmt::join(numbers, " "));
  };
  expect_the_pair("c.xml", "<?xml version=\"1.0\"?>\n<opencv_storage>\n" + xml("M1", 3, kK1) + xml("D1", 1, kD1) +
                               xml("M2", 3, kK2) + xml("D2", 1, kD2) + xml("R", 3, kR()) + xml("T", 3, kT) +
                               "</opencv_storage>\n");
}

TEST_F(CalibrationFile, MayBeTwoFilesOfWhichEitherIsNamed) {
  const std::string intrinsics =
      "%YAML:1.0\n---\n" + matrix("M1", 3, kK1) + matrix("D1", 1, kD1) + matrix("M2", 3, kK2) + matrix("D2", 1, kD2);
  const std::string extrinsics = "%YAML:1.0\n---\n" + matrix("R", 3, kR()) + matrix("T", 3, kT) +
                                 matrix("R1", 3, kR()) + matrix("P1", 3, {9, 0, 9, 0, 0, 9, 9, 0, 0, 0, 1, 0}) +
                                 matrix("P2", 3, {9, 0, 9, -9, 0, 9, 9, 0, 0, 0, 1, 0});
  EXPECT_THAT(refusal("intrinsics.yml", intrinsics), AllOf(HasSubstr("R and T are missing"), HasSubstr("extrinsics")));
  folder_.write("extrinsics.yml", extrinsics);
  expect_the_pair("intrinsics.yml", intrinsics);
  expect_the_pair("extrinsics.yml", extrinsics);
}

TEST_F(CalibrationFile, MayComeFromKalibr) {
  const std::string kalibr = fmt::format(
      "cam0:\n  cam_overlaps: [1]\n  camera_model: pinhole\n  distortion_coeffs: [{}]\n  distortion_model: radtan\n"
      "  intrinsics: [705, 698, 330, 232]\n  resolution: [640, 480]\n  rostopic: /cam0/image_raw\n"
      "cam1:\n  T_cn_cnm1:\n  - [{:.12g}, {:.12g}, {:.12g}, -0.0052]\n  - [{:.12g}, {:.12g}, {:.12g}, 0.00015]\n"
      "  - [{:.12g}, {:.12g}, {:.12g}, -0.0001]\n  - [0.0, 0.0, 0.0, 1.0]\n  camera_model: pinhole\n"
      "  distortion_coeffs: [{}]\n  distortion_model: radtan\n  intrinsics: [712, 709, 345, 251]\n"
      "  resolution: [640, 480]\n",
      list(kD1), turn()(0, 0), turn()(0, 1), turn()(0, 2), turn()(1, 0), turn()(1, 1), turn()(1, 2), turn()(2, 0),
      turn()(2, 1), turn()(2, 2), list(kD2));
  expect_the_pair("camchain.yaml", kalibr);
  EXPECT_EQ(read("camchain.yaml", kalibr).image_size, cv::Size(640, 480));
  std::string omni = kalibr;
  omni.replace(omni.find("pinhole"), 7, "omni");
  EXPECT_THAT(refusal("camchain.yaml", omni), AllOf(HasSubstr("omni"), HasSubstr("Kannala-Brandt")));
}

/// x' = x R + t with pixels from 1: everything is transposed.
TEST_F(CalibrationFile, MayComeFromMatlab) {
  const auto matlab = [](const Numbers& K) {
    Numbers m = transposed(K);
    m[6] += 1;
    m[7] += 1;
    return nested(m, 3);
  };
  const auto camera = [&](const Numbers& K, const Numbers& D) {
    return fmt::format(
        "{{\"RadialDistortion\":[{}],\"TangentialDistortion\":[{}],\"ImageSize\":[480,640],"
        "\"IntrinsicMatrix\":{}}}",
        list({D[0], D[1], D[4]}), list({D[2], D[3]}), matlab(K));
  };
  const std::string json = fmt::format(
      "{{\"CameraParameters1\":{},\"CameraParameters2\":{},\"RotationOfCamera2\":{},\"TranslationOfCamera2\":[{}]}}",
      camera(kK1, kD1), camera(kK2, kD2), nested(transposed(kR()), 3), list(kT));
  expect_the_pair("stereo.json", json);
  EXPECT_EQ(read("stereo.json", json).image_size, cv::Size(640, 480));

  Numbers k1 = transposed(kK1), k2 = transposed(kK2);
  for (Numbers* K : {&k1, &k2}) (*K)[6] += 1, (*K)[7] += 1;
  const std::string by_hand = "%YAML:1.0\n---\n" + matrix("M1", 3, k1) + matrix("D1", 1, kD1) + matrix("M2", 3, k2) +
                              matrix("D2", 1, kD2) + matrix("R", 3, transposed(kR())) + matrix("T", 3, kT);
  expect_the_pair("by_hand.yaml", by_hand);
  EXPECT_THAT(read("by_hand.yaml", by_hand).notes.at(1), HasSubstr("transposed"));
}

TEST_F(CalibrationFile, MayBeThatOfAnEndoscopicDataSet) {
  const auto ini = [](const std::string& side, const Numbers& K, const Numbers& D, const Numbers& R, const Numbers& T) {
    std::string text = fmt::format("[{}]\nres_x = 640\nres_y = 480\nfc_x = {}\nfc_y = {}\ncc_x = {}\ncc_y = {}\n", side,
                                   K[0], K[4], K[2], K[5]);
    for (size_t i = 0; i < 5; ++i) text += fmt::format("kc_{} = {:.12g}\n", i, D[i]);
    for (size_t i = 0; i < 9; ++i) text += fmt::format("R_{} = {:.12g}\n", i, R[i]);
    for (size_t i = 0; i < 3; ++i) text += fmt::format("T_{} = {:.12g}\n", i, T[i]);
    return text;
  };
  expect_the_pair("StereoCalibration.ini", ini("StereoLeft", kK1, kD1, {1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}) + "\n" +
                                               ini("StereoRight", kK2, kD2, kR(), kT));
  expect_the_pair(
      "frame_data.json",
      fmt::format("{{\"camera-calibration\": {{\"KL\": {}, \"KR\": {}, \"DL\": [[{}]], \"DR\": [[{}]], \"R\": {}, "
                  "\"T\": [[{}]]}}, \"camera-pose\": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}}",
                  nested(kK1, 3), nested(kK2, 3), list(kD1), list(kD2), nested(kR(), 3), list(kT)));
  const auto text = [](const Numbers& numbers, size_t columns) {
    std::string lines;
    for (size_t i = 0; i < numbers.size(); ++i)
      lines += fmt::format("{:.12g}{}", numbers[i], (i + 1) % columns == 0 ? "\n" : " ");
    return lines;
  };
  folder_.write("calib.left.distortion.txt", text(kD1, 5));
  folder_.write("calib.right.intrinsic.txt", text(kK2, 3));
  folder_.write("calib.right.distortion.txt", text(kD2, 5));
  const Numbers R = kR();
  folder_.write("calib.l2r.4x4",
                text({R[0], R[1], R[2], kT[0], R[3], R[4], R[5], kT[1], R[6], R[7], R[8], kT[2], 0, 0, 0, 1}, 4));
  expect_the_pair("calib.left.intrinsic.txt", text(kK1, 3));
}

TEST_F(CalibrationFile, MayBeThatOfAChallengeWithRemarks) {
  cv::Vec3d omega;
  cv::Rodrigues(cv::Matx33d(kR().data()), omega);
  const auto camera = [](int number, const Numbers& K, const Numbers& D) {
    return fmt::format(
        "Camera-{0}-F: {1} {2}        // x,y focal length in pixels\nCamera-{0}-C: {3} {4} // center: in pixels\n"
        "Camera-{0}-Alpha: 0.0\nCamera-{0}-K: {5:.12g}  // distortion\n",
        number, K[0], K[4], K[2], K[5], fmt::join(D, " "));
  };
  expect_the_pair(
      "camera_calibration.txt",
      fmt::format("// made by a program\nWidth: 640 // px\nHeight: 480\n{}{}Extrinsic-Omega: {:.14g} {:.14g} "
                  "{:.14g} // rotation\nExtrinsic-T: {:.12g}\n",
                  camera(0, kK1, kD1), camera(1, kK2, kD2), omega[0], omega[1], omega[2], fmt::join(kT, " ")));
}

TEST_F(CalibrationFile, MayBeThatOfARobotsRecorder) {
  cv::Vec3d omega;
  cv::Rodrigues(cv::Matx33d(kR().data()), omega);
  const auto camera = [](const Numbers& K, const Numbers& D) {
    return fmt::format("{{\"f\": [{}, {}], \"c\": [{}, {}], \"k\": [{}]}}", K[0], K[4], K[2], K[5], list(D));
  };
  for (const auto& [open, close] : {std::pair{"", ""}, std::pair{"[", "]"}})
    expect_the_pair(
        "camcal.json",
        fmt::format("{{\"data\": {{\"width\": 640, \"height\": 480, \"intrinsics\": [{}, {}], "
                    "\"extrinsics\": {}{{\"om\": [{:.14g}, {:.14g}, {:.14g}], \"T\": [{}]}}{}}}}}",
                    camera(kK1, kD1), camera(kK2, kD2), open, omega[0], omega[1], omega[2], list(kT), close));
}

TEST_F(CalibrationFile, MayBeOnePerCameraOnABody) {
  // The body's axes are any; only how the cameras stand to each other counts.
  const Mat3 body = Eigen::AngleAxisd(1.1, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  const Vec3 place(40, -7, 12);
  const auto sensor = [&](const std::string& name, const Numbers& K, const Numbers& D, const Mat3& R, const Vec3& t) {
    Numbers rows;
    for (int i = 0; i < 3; ++i) rows.insert(rows.end(), {R(i, 0), R(i, 1), R(i, 2), t[i]});
    rows.insert(rows.end(), {0, 0, 0, 1});
    std::filesystem::create_directories(folder_ / name);
    return folder_.write(
        name + "/sensor.yaml",
        fmt::format("sensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [{:.15g}]\nrate_hz: 20\n"
                    "resolution: [640, 480]\ncamera_model: pinhole\nintrinsics: [{}, {}, {}, {}] #fu, fv\n"
                    "distortion_model: radial-tangential\ndistortion_coefficients: [{}]\n",
                    fmt::join(rows, ", "), K[0], K[4], K[2], K[5], list(D)));
  };
  sensor("cam1", kK2, kD2, body * turn().transpose(), place - body * turn().transpose() * Vec3(kT[0], kT[1], kT[2]));
  const StereoRig rig = read_rig(sensor("cam0", kK1, kD1, body, place));
  EXPECT_LT((rig.right_from_left - turn()).norm(), 1e-9);
  EXPECT_LT((rig.right_from_left_mm - Vec3(kT[0], kT[1], kT[2])).norm(), 1e-9);
  EXPECT_EQ(rig.right.distortion, kD2);
  EXPECT_EQ(rig.image_size, cv::Size(640, 480));
}

TEST(CalibrationData, OfTheHamlynHeartAndOfMiddleburyAreRead) {
  PALPATE_NEEDS_REFERENCE("hamlyn_heart/calib.left.intrinsic.txt");
  const StereoRig heart = read_rig(test::reference_data() / "hamlyn_heart/calib.left.intrinsic.txt");
  EXPECT_NEAR(heart.right_from_left_mm.x(), -5.520739, 1e-9);
  EXPECT_NEAR(heart.left.K(0, 0), 391.656525, 1e-9);
  EXPECT_NEAR(heart.right.K(0, 2), 190.896454, 1e-9);
  const StereoRig motorcycle = read_rig(test::reference_data() / "motorcycle/calib.txt");
  EXPECT_NEAR(motorcycle.baseline_mm(), 193.001, 1e-9);
  EXPECT_EQ(motorcycle.image_size, cv::Size(741, 497));
}

std::string camera_info(const std::string& D, const std::string& K, const std::string& R, const std::string& P,
                        double shift, bool as_lists) {
  const auto value = [&](const Numbers& numbers) {
    if (!as_lists) return " [" + list(numbers) + "]\n";
    std::string text = "\n";
    for (const double number : numbers) text += fmt::format("- {}\n", number);
    return text;
  };
  return "header:\n  frame_id: camera\nheight: 480\nwidth: 640\ndistortion_model: plumb_bob\n" + D + ":" + value(kD1) +
         K + ":" + value(kK1) + R + ":" + value({1, 0, 0, 0, 1, 0, 0, 0, 1}) + P + ":" +
         value({700, 0, 320, shift, 0, 700, 240, 0, 0, 0, 1, 0}) + "binning_x: 0\nroi:\n  height: 0\n  width: 0\n---\n";
}

TEST_F(CalibrationFile, MayBeAMessageOfRosOneOrTwo) {
  for (const auto& keys : {std::array{"D", "K", "R", "P"}, std::array{"d", "k", "r", "p"}}) {
    const bool as_lists = keys[0][0] == 'd';
    folder_.write("info_right.yaml", camera_info(keys[0], keys[1], keys[2], keys[3], -3.01, as_lists));
    const StereoRig rig = read("info_left.yaml", camera_info(keys[0], keys[1], keys[2], keys[3], 0, as_lists));
    EXPECT_NEAR(rig.baseline_mm(), 4.3, 1e-9);
    EXPECT_EQ(rig.image_size, cv::Size(640, 480));
    EXPECT_EQ(rig.left.distortion, kD1);
  }
}

TEST_F(CalibrationFile, OfSeveralPictureSizesIsRefused) {
  EXPECT_THAT(refusal("two.yaml",
                      "hd:\n  left: {fx: 700, fy: 700, cx: 640, cy: 360}\nfhd:\n  left: {fx: 1050, fy: 1050, "
                      "cx: 960, cy: 540}\n"),
              AllOf(HasSubstr("fhd.left.fx is 1050"), HasSubstr("another fx of that camera is 700")));
  EXPECT_THAT(refusal("SN1234.conf", "[LEFT_CAM_HD]\nfx=700\n[STEREO]\nBaseline=120\nRX_HD=0.001\n"),
              HasSubstr("a factory file of a ZED camera"));
}

TEST_F(CalibrationFile, GoesOnWithTheSameMessageWhereATopicWasEchoed) {
  const std::string message = fmt::format("M1: [{}]\nD1: [{}]\nM2: [{}]\nD2: [{}]\nR: [{}]\nT: [{}]\n", list(kK1),
                                          list(kD1), list(kK2), list(kD2), list(kR()), list(kT));
  expect_the_pair("echo.yaml", "header: {seq: 1}\n" + message + "---\nheader: {seq: 2}\n" + message + "---\n");
}

TEST_F(CalibrationFile, ThatClosesABraceTooOftenIsRefused) {
  EXPECT_THAT(
      refusal("twice.json", fmt::format("{{\"M1\":[{}]}},\"rms\":0.2,\"size\":{{\"width\":640}}}}\n", list(kK1))),
      AllOf(HasSubstr("twice.json"), HasSubstr("a bracket too many?")));
}

TEST_F(CalibrationFile, ThatIsNotUnderstoodNamesItsKeysAndTheNearest) {
  std::string text = file_storage("camra_matrix_left", "D1", "M2", "D2");
  EXPECT_THAT(refusal("c.yaml", text), AllOf(HasSubstr("no camera matrix of the left camera"),
                                             HasSubstr("the keys there are camra_matrix_left, D1"),
                                             HasSubstr("'camra_matrix_left' is nearest to 'camera_matrix_left'")));
  EXPECT_THAT(refusal("poses_bounds.npy", "\x93NUMPY something"), HasSubstr("no stereo calibration"));
  EXPECT_THAT(refusal("c.mat", "MATLAB 5.0 MAT-file"), HasSubstr("jsonencode"));
  EXPECT_THAT(refusal("c.npz", "PK\x03\x04"), HasSubstr("NumPy archive"));
}

std::string lists(const std::string& m1, const std::string& d1, const std::string& r, const std::string& t) {
  return fmt::format("{{\"M1\": {}, \"D1\": {}, \"M2\": [{}], \"D2\": [{}], \"R\": {}, \"T\": {}}}", m1, d1, list(kK2),
                     list(kD2), r, t);
}

TEST_F(CalibrationFile, WithAValueThatIsThereButUnfitSaysWhatItHolds) {
  const std::string M = "[" + list(kK1) + "]", D = "[" + list(kD1) + "]", R = "[" + list(kR()) + "]",
                    T = "[" + list(kT) + "]";
  expect_the_pair("c.json", lists(M, D, R, T));
  EXPECT_THAT(refusal("c.json", lists("[705, 0, 330, 0, 698, 232, 0, 0]", D, R, T)),
              HasSubstr("M1 holds 8 numbers, expected 9 numbers (3x3)"));
  EXPECT_THAT(refusal("c.json", lists("\"see other file\"", D, R, T)),
              HasSubstr("M1 holds 'see other file', expected 9"));
  EXPECT_THAT(refusal("c.json", lists("null", D, R, T)), HasSubstr("M1 is empty, expected 9 numbers"));
  EXPECT_THAT(refusal("c.json", lists("3", D, R, T)), HasSubstr("M1 holds 1 number, expected 9 numbers"));
  EXPECT_THAT(refusal("c.json", lists("[705, 0, 330, 0, abc, 232, 0, 0, 1]", D, R, T)),
              HasSubstr("M1 holds 'abc' among 8 numbers, expected 9"));
  EXPECT_THAT(refusal("c.json", lists("[[705, 0, 330], [0, 698], [0, 0, 1]]", D, R, T)),
              HasSubstr("M1 holds rows of different length"));
  EXPECT_THAT(refusal("c.json", lists(M, "null", R, T)), HasSubstr("D1 is empty, expected 4, 5, 8"));
  EXPECT_THAT(refusal("c.json", lists(M, D, "[1, 0, 0, 0, 1, 0, 0, 0]", T)),
              HasSubstr("R holds 8 numbers, expected 9 numbers (3x3)"));
  EXPECT_THAT(refusal("c.json", lists(M, D, R, "[-5, 0]")), HasSubstr("T holds 2 numbers, expected 3"));
  EXPECT_THAT(refusal("c.json", lists(M, D, R, "[-.Inf, 0, 0]")), HasSubstr("T is [-inf, 0, 0], expected finite"));
  // A decimal comma makes one number two.
  EXPECT_THAT(
      refusal("c.yaml", "%YAML:1.0\n---\n" + matrix("M1", 3, {705, 0, 0, 330, 5, 0, 698, 0, 232, 5, 0, 0, 1, 0}) +
                            matrix("D1", 1, kD1)),
      HasSubstr("M1 holds 14 numbers"));
}

TEST_F(CalibrationFile, ThatIsNoYamlNamesTheLine) {
  EXPECT_THAT(refusal("c.yaml", "%YAML:1.0\n---\nM1: [1, 2\nD1: {"), HasSubstr("c.yaml:4: not valid YAML"));
  EXPECT_THAT(refusal("c.json", "{\"M1\": [1, 2,\n"), AllOf(HasSubstr("c.json:"), HasSubstr("not valid YAML")));
}

TEST_F(CalibrationFile, WithOneKeyTwiceIsRefused) {
  EXPECT_THAT(refusal("c.yaml", file_storage("M1", "D1", "M2", "D2") + matrix("M1", 3, kK2)),
              HasSubstr("M1 stands there twice, expected once"));
  EXPECT_THAT(refusal("c.txt", "cam0: {K: [1, 2],\n K: [3]}\n"), HasSubstr("c.txt:2: K stands there twice"));
}

TEST_F(CalibrationFile, OfKalibrMayHaveNoDistortionAndNamesALensThatIsNotRead) {
  const auto kalibr = [](const std::string& model, const std::string& distortion, const std::string& intrinsics) {
    const std::string camera = fmt::format("  camera_model: {}\n  {}\n  intrinsics: [{}]\n  resolution: [640, 480]\n",
                                           model, distortion, intrinsics);
    return "cam0:\n" + camera + "cam1:\n  T_cn_cnm1: [[1, 0, 0, -0.0052], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n" +
           camera;
  };
  const std::string none = "distortion_coeffs: []\n  distortion_model: none";
  const StereoRig rig = read("k.yaml", kalibr("pinhole", none, "705, 698, 330, 232"));
  EXPECT_NEAR(rig.baseline_mm(), 5.2, 1e-9);
  EXPECT_LT(cv::norm(rig.left.K - cv::Matx33d(kK1.data())), 1e-9);
  EXPECT_EQ(distorted(rig.left, {0.3, -0.2}), cv::Point2d(0.3, -0.2));
  EXPECT_THAT(refusal("k.yaml", kalibr("pinhole", "distortion_coeffs: []", "705, 698, 330, 232")),
              HasSubstr("cam0.distortion_coeffs is empty"));
  for (const auto& [model, intrinsics] :
       {std::pair{"ds", "-0.2, 0.59, 705, 698, 330, 232"}, std::pair{"eucm", "0.6, 1.1, 705, 698, 330, 232"},
        std::pair{"omni", "1.6, 705, 698, 330, 232"}})
    EXPECT_THAT(
        refusal("k.yaml", kalibr(model, none, intrinsics)),
        AllOf(HasSubstr(fmt::format("the lens model of the left camera is {},", model)), HasSubstr("plumb_bob")));
}

TEST_F(CalibrationFile, InSectionsMayHaveRemarksAndSmallLettersAndNamesWhatIsMissing) {
  const auto ini = [](const char* side, const char* cy, const std::string& pose) {
    return fmt::format(
        "[{}] ; a camera\nfc_x=705 ; px\nfc_y=698 # px\ncc_x=330\n{}kc_0=0\nkc_1=0\nkc_2=0\nkc_3=0\nkc_4=0\n{}", side,
        cy, pose);
  };
  const std::string pose = "r_0=1\nr_1=0\nr_2=0\nr_3=0\nr_4=1\nr_5=0\nr_6=0\nr_7=0\nr_8=1\nt_0=-5\nt_1=0\nt_2=0 ; mm\n";
  const StereoRig rig =
      read("c.ini", "; made by hand\n" + ini("stereoleft", "cc_y=232\n", "") + ini("stereoright", "cc_y=251\n", pose));
  EXPECT_LT(cv::norm(rig.left.K - cv::Matx33d(kK1.data())), 1e-9);
  EXPECT_NEAR(rig.right.K(1, 2), 251, 1e-9);
  EXPECT_NEAR(rig.right_from_left_mm.x(), -5, 1e-9);
  EXPECT_THAT(refusal("c.ini", ini("StereoLeft", "", "") + ini("StereoRight", "cc_y=251\n", pose)),
              HasSubstr("the left camera has fx, cx but no cy"));
}

TEST_F(CalibrationFile, MayBeTwoFilesOfOneProjectionEach) {
  folder_.write("camera_right.txt", "705 0 330 -3525\n0 705 232 0\n0 0 1 0\n");
  const StereoRig rig = read("camera_left.txt", "705 0 330 0\n0 705 232 0\n0 0 1 0\n");
  EXPECT_NEAR(rig.right_from_left_mm.x(), -5, 1e-9);
  EXPECT_NEAR(rig.left.K(0, 2), 330, 1e-9);
}

TEST_F(CalibrationFile, WithARotationThatOneSignSpoilsNamesTheEntry) {
  Numbers R = kR();
  R[2] = -R[2];
  const std::string text = "%YAML:1.0\n---\n" + matrix("M1", 3, kK1) + matrix("D1", 1, kD1) + matrix("M2", 3, kK2) +
                           matrix("D2", 1, kD2) + matrix("R", 3, R) + matrix("T", 3, kT);
  EXPECT_THAT(refusal("c.yaml", text),
              AllOf(HasSubstr("R is not a rotation"), HasSubstr(fmt::format("R[0,2] = {:.6g}", R[2]))));
}

std::string with_distortion(const Numbers& D, const std::string& extra = "") {
  return "%YAML:1.0\n---\n" + extra + matrix("K1", 3, kK1) + matrix("D1", 4, D) + matrix("K2", 3, kK2) +
         matrix("D2", 4, D) + matrix("R", 3, kR()) + matrix("T", 3, kT);
}

TEST_F(CalibrationFile, IsThatOfAFisheyeLensWhereItSaysSoOrCanBeNothingElse) {
  const Numbers bent = {0.12, -0.03, 0.05, -0.04}, slight = {-0.1, 0.02, 0.001, -0.0004},
                unclear = {0.1, -0.02, 0.015, 0.002};
  EXPECT_EQ(read("c.yaml", with_distortion(bent)).left.lens, LensModel::fisheye);
  EXPECT_EQ(read("c.yaml", with_distortion(slight)).left.lens, LensModel::brown);
  EXPECT_THAT(refusal("c.yaml", with_distortion(unclear)), AllOf(HasSubstr("fisheye"), HasSubstr("plumb_bob")));
  for (const char* word : {"fisheye: 1\n", "distortion_model: equidistant\n", "camera_model: KANNALA_BRANDT\n"})
    EXPECT_EQ(read("c.yaml", with_distortion(unclear, word)).left.lens, LensModel::fisheye) << word;
  EXPECT_EQ(read("c.yaml", with_distortion(unclear, "distortion_model: plumb_bob\n")).left.lens, LensModel::brown);
}

TEST(Lens, BendsAsOpenCvDoesAndBack) {
  for (const Numbers& D :
       {Numbers{-0.2, 0.05, 0.001, -0.002}, Numbers{-0.2, 0.05, 0.001, -0.002, 0.01, 0.1, -0.02, 0.003},
        Numbers{-0.2, 0.05, 0.001, -0.002, 0.01, 0.1, -0.02, 0.003, 1e-3, 2e-3, -1e-3, 4e-4},
        Numbers{-0.2, 0.05, 0.001, -0.002, 0.01, 0.1, -0.02, 0.003, 1e-3, 2e-3, -1e-3, 4e-4, 0.02, -0.03}}) {
    const Camera camera{cv::Matx33d(kK1.data()), D, LensModel::brown};
    std::vector<cv::Point2d> px;
    cv::projectPoints(std::vector<cv::Point3d>{{0.3, -0.2, 1}}, cv::Vec3d(), cv::Vec3d(), camera.K, D, px);
    const cv::Point2d bent = distorted(camera, {0.3, -0.2});
    EXPECT_NEAR(px[0].x, 705 * bent.x + 330, 1e-9) << D.size();
    EXPECT_NEAR(px[0].y, 698 * bent.y + 232, 1e-9) << D.size();
    EXPECT_LT(cv::norm(undistorted(camera, px)[0] - cv::Point2d(0.3, -0.2)), 2e-3) << D.size();
  }
  const Camera fisheye{cv::Matx33d(kK1.data()), {0.12, -0.03, 0.05, -0.04}, LensModel::fisheye};
  std::vector<cv::Point2d> px;
  cv::fisheye::projectPoints(std::vector<cv::Point3d>{{0.3, -0.2, 1}}, px, cv::Vec3d(), cv::Vec3d(), fisheye.K,
                             fisheye.distortion);
  const cv::Point2d bent = distorted(fisheye, {0.3, -0.2});
  EXPECT_NEAR(px[0].x, 705 * bent.x + 330, 1e-9);
  EXPECT_LT(cv::norm(undistorted(fisheye, px)[0] - cv::Point2d(0.3, -0.2)), 1e-6);
}

TEST_F(CalibrationFile, HoldsForPicturesThatWereCutAndScaledAfterwards) {
  const StereoRig whole = read("c.yaml", file_storage("M1", "D1", "M2", "D2"));
  const StereoRig part = cut_and_scaled(whole, {100, 40, 400, 300}, 0.5);
  EXPECT_EQ(part.image_size, cv::Size(200, 150));
  const Vec3 point(4, -3, 60);
  const cv::Point2d before = project_to_recorded_left(whole, point), after = project_to_recorded_left(part, point);
  // The middle of a pixel of the smaller picture lies between two of the larger one.
  EXPECT_NEAR(after.x, (before.x - 100 + 0.5) / 2 - 0.5, 1e-9);
  EXPECT_NEAR(after.y, (before.y - 40 + 0.5) / 2 - 0.5, 1e-9);
  StereoRig sized = whole;
  sized.image_size = {640, 480};
  EXPECT_THAT(sentence_of([&] { cut_and_scaled(sized, {300, 40, 400, 300}, 1); }), HasSubstr("recording.crop"));
  EXPECT_THAT(sentence_of([&] { check_rig_fits(sized, {320, 240}); }), HasSubstr("recording.scale: 0.5"));
  EXPECT_THAT(sentence_of([&] { check_rig_fits(sized, {480, 640}); }), HasSubstr("turned by 90 degrees"));
}

TEST(Rectification, OfAFisheyePairLeadsPixelsBackToWhereOpenCvProjectsThem) {
  StereoRig rig;
  rig.left = {cv::Matx33d(kK1.data()), {0.12, -0.03, 0.05, -0.04}, LensModel::fisheye};
  rig.right = {cv::Matx33d(kK2.data()), {0.11, -0.02, 0.04, -0.03}, LensModel::fisheye};
  rig.right_from_left = turn();
  rig.right_from_left_mm = {kT[0], kT[1], kT[2]};
  const Rectification rectification = make_rectification(rig, {640, 480});
  const Vec3 point(9, -6, 70);
  const cv::Point2d rectified = project_to_rectified(rectification, point);
  cv::Mat x, y;
  cv::getRectSubPix(rectification.left_map_x, {1, 1}, cv::Point2f(rectified), x);
  cv::getRectSubPix(rectification.left_map_y, {1, 1}, cv::Point2f(rectified), y);
  const cv::Point2d recorded = project_to_recorded_left(rig, point);
  EXPECT_NEAR(x.at<float>(0), recorded.x, 0.01);
  EXPECT_NEAR(y.at<float>(0), recorded.y, 0.01);
}

}  // namespace
}  // namespace palpate
