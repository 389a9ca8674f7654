#include "palpate/stereo/rig.h"

#include <fmt/core.h>

#include <Eigen/Geometry>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "palpate/stereo/triangulate.h"
#include "tests/stereo/files.h"
#include "tests/support/reference_data.h"

namespace palpate {
namespace {

using test::sentence_of;
using test::TemporaryFolder;
using testing::AllOf;
using testing::HasSubstr;

std::string matrix(const std::string& key, int rows, int columns, const std::string& data) {
  return fmt::format("{}: !!opencv-matrix\n   rows: {}\n   cols: {}\n   dt: d\n   data: [ {} ]\n", key, rows, columns,
                     data);
}

const std::string kK = "700., 0., 319.5, 0., 700., 239.5, 0., 0., 1.";
const std::string kNoTurn = "1., 0., 0., 0., 1., 0., 0., 0., 1.";

std::string calibration(const std::string& camera = "M", const std::string& rotation = kNoTurn,
                        const std::string& translation = "-5., 0., 0.", const std::string& K = kK,
                        const std::string& extra = "") {
  return "%YAML:1.0\n---\n" + extra + matrix(camera + "1", 3, 3, K) + matrix("D1", 1, 5, "0., 0., 0., 0., 0.") +
         matrix(camera + "2", 3, 3, K) + matrix("D2", 1, 5, "0., 0., 0., 0., 0.") + matrix("R", 3, 3, rotation) +
         matrix("T", 3, 1, translation);
}

std::string camera_info(double shift, const std::string& model = "plumb_bob") {
  return fmt::format(
      "image_width: 640\nimage_height: 480\ncamera_name: camera\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: [{}]\n"
      "distortion_model: {}\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [0.1, 0, 0, 0, 0]\n"
      "rectification_matrix:\n  rows: 3\n  cols: 3\n  data: [{}]\n"
      "projection_matrix:\n  rows: 3\n  cols: 4\n  data: [700, 0, 320, {}, 0, 700, 240, 0, 0, 0, 1, 0]\n",
      kK, model, kNoTurn, shift);
}

TEST(ReadRig, UnderstandsBothNamesOfTheCameraMatrices) {
  const TemporaryFolder folder;
  for (const char* name : {"M", "K"}) {
    const StereoRig rig = read_rig(folder.write("calibration.yaml", calibration(name)));
    EXPECT_EQ(rig.left.K(0, 0), 700);
    EXPECT_EQ(rig.right.K(1, 2), 239.5);
    EXPECT_DOUBLE_EQ(rig.baseline_mm(), 5);
    EXPECT_TRUE(rig.image_size.empty());
  }
}

TEST(ReadRig, TakesTheImageSizeWhereItIsNamed) {
  const TemporaryFolder folder;
  for (const char* size : {"image_width: 640\nimage_height: 480\n", "image_size: [ 640, 480 ]\n"})
    EXPECT_EQ(read_rig(folder.write("c.yaml", calibration("M", kNoTurn, "-5., 0., 0.", kK, size))).image_size,
              cv::Size(640, 480));
}

TEST(ReadRig, DetectsMetresAndObeysAStatedUnit) {
  const TemporaryFolder folder;
  const auto file = folder.write("c.yaml", calibration("M", kNoTurn, "-0.005, 0., 0."));
  EXPECT_DOUBLE_EQ(read_rig(file).baseline_mm(), 5);
  EXPECT_DOUBLE_EQ(read_rig(file, TranslationUnit::m).baseline_mm(), 5);
  EXPECT_THAT(sentence_of([&] { read_rig(file, TranslationUnit::mm); }),
              AllOf(HasSubstr("c.yaml"), HasSubstr("0.005 mm"), HasSubstr("1 to 200 mm")));
}

TEST(ReadRig, UnderstandsARosCameraInfoPair) {
  const TemporaryFolder folder;
  folder.write("right.yaml", camera_info(-700 * 0.0043));
  const StereoRig rig = read_rig(folder.write("left.yaml", camera_info(0)));
  EXPECT_EQ(rig.image_size, cv::Size(640, 480));
  EXPECT_NEAR(rig.baseline_mm(), 4.3, 1e-9);
  EXPECT_LT(rig.right_from_left_mm.x(), 0);
  EXPECT_EQ(rig.left.distortion.at(0), 0.1);
}

TEST(ReadRig, SaysWhatIsWrongWithARosPair) {
  const TemporaryFolder folder;
  const auto left = folder.write("left.yaml", camera_info(0));
  EXPECT_THAT(sentence_of([&] { read_rig(left); }), HasSubstr("right.yaml"));
  folder.write("right.yaml", camera_info(-3, "equidistant"));
  EXPECT_THAT(sentence_of([&] { read_rig(left); }), AllOf(HasSubstr("equidistant"), HasSubstr("plumb_bob")));
  EXPECT_THAT(sentence_of([&] { read_rig(folder.write("eye.yaml", camera_info(0))); }), HasSubstr("\"left\""));
}

TEST(ReadRig, SaysWhichFileIsMissingEmptyOrBroken) {
  const TemporaryFolder folder;
  EXPECT_THAT(sentence_of([&] { read_rig(folder / "none.yaml"); }),
              AllOf(HasSubstr("none.yaml"), HasSubstr("does not exist")));
  EXPECT_THAT(sentence_of([&] { read_rig(folder.write("empty.yaml", "")); }), HasSubstr("empty"));
  for (const char* text :
       {"%YAML:1.0\n---\nM1: !!opencv-matrix\n   rows: 3\n   cols: [\n", "not yaml at all", "{", "<a>"})
    EXPECT_THAT(sentence_of([&] { read_rig(folder.write("broken.yaml", text)); }), HasSubstr("broken.yaml")) << text;
}

TEST(ReadRig, SaysWhichKeyIsMissing) {
  const TemporaryFolder folder;
  std::string text = calibration();
  text.replace(text.find("D2"), 2, "X2");
  EXPECT_THAT(sentence_of([&] { read_rig(folder.write("c.yaml", text)); }),
              AllOf(HasSubstr("c.yaml"), HasSubstr("D2")));
}

TEST(ReadRig, RefusesWhatCannotBeARig) {
  const TemporaryFolder folder;
  const auto sentence = [&](const std::string& text) {
    return sentence_of([&] { read_rig(folder.write("c.yaml", text)); });
  };
  EXPECT_THAT(sentence(calibration("M", "1., 0., 0., 0., 1.1, 0., 0., 0., 1.")), HasSubstr("R is not a rotation"));
  EXPECT_THAT(sentence(calibration("M", "1., 0., 0., 0., 1., 0., 0., 0., -1.")), HasSubstr("R is not a rotation"));
  EXPECT_THAT(sentence(calibration("M", kNoTurn, "-300., 0., 0.")), AllOf(HasSubstr("300"), HasSubstr("baseline")));
  EXPECT_THAT(sentence(calibration("M", kNoTurn, "-0.5, 0., 0.")), AllOf(HasSubstr("0.5 mm"), HasSubstr("baseline")));
  EXPECT_THAT(sentence(calibration("M", kNoTurn, "5., 0., 0.")), AllOf(HasSubstr("T[0] < 0"), HasSubstr("5 mm")));
  EXPECT_THAT(sentence(calibration("M", kNoTurn, "0., -5., 0.")), HasSubstr("side by side"));
  EXPECT_THAT(sentence(calibration("M", kNoTurn, "-5., 0., 0.", "7., 0., 3., 0., 7., 2., 0., 0., 1.")),
              AllOf(HasSubstr("focal"), HasSubstr("7 x 7")));
  EXPECT_THAT(sentence(calibration("M", kNoTurn, "-5., 0., .Nan")), HasSubstr("T is"));
}

TEST(CheckRigFits, ComparesWithTheVideo) {
  const TemporaryFolder folder;
  const StereoRig without_size = read_rig(folder.write("c.yaml", calibration()));
  EXPECT_NO_THROW(check_rig_fits(without_size, {640, 480}));
  EXPECT_THAT(sentence_of([&] {
                check_rig_fits(without_size, {1920, 1080});
              }),
              AllOf(HasSubstr("principal point"), HasSubstr("1920x1080")));
  const StereoRig with_size = read_rig(
      folder.write("d.yaml", calibration("M", kNoTurn, "-5., 0., 0.", kK, "image_width: 640\nimage_height: 480\n")));
  EXPECT_THAT(sentence_of([&] {
                check_rig_fits(with_size, {720, 480});
              }),
              AllOf(HasSubstr("640x480"), HasSubstr("720x480")));
}

TEST(DescribeRig, NamesBaselineFocalLengthAndFieldOfView) {
  PALPATE_NEEDS_REFERENCE("surgt_tissue/calibration.yaml");
  const StereoRig rig = read_rig(test::reference_data() / "surgt_tissue/calibration.yaml");
  EXPECT_EQ(describe_rig(rig, {1280, 1024}), "baseline 4.14 mm, focal 1035 px, field of view 63 x 53 degrees");
}

// Cameras that differ in everything, turned against each other, with strong distortion.
StereoRig awkward_rig() {
  StereoRig rig;
  rig.left.K = {705, 0, 330, 0, 698, 232, 0, 0, 1};
  rig.right.K = {712, 0, 345, 0, 709, 251, 0, 0, 1};
  rig.left.distortion = {-0.21, 0.08, 0.001, -0.0007, 0.01};
  rig.right.distortion = {-0.19, 0.06, -0.0012, 0.0005, 0.0};
  rig.right_from_left = (Eigen::AngleAxisd(0.03, Vec3::UnitY()) * Eigen::AngleAxisd(-0.02, Vec3::UnitX()) *
                         Eigen::AngleAxisd(0.015, Vec3::UnitZ()))
                            .toRotationMatrix();
  rig.right_from_left_mm = {-5.2, 0.15, -0.1};
  rig.file = "awkward.yaml";
  return rig;
}

cv::Point2d project(const Camera& camera, const Vec3& point) {
  std::vector<cv::Point2d> pixels;
  cv::projectPoints(std::vector<cv::Point3d>{{point.x(), point.y(), point.z()}}, cv::Vec3d(0, 0, 0), cv::Vec3d(0, 0, 0),
                    camera.K, camera.distortion, pixels);
  return pixels[0];
}

float interpolate(const cv::Mat& map, cv::Point2d at) {
  cv::Mat value;
  cv::getRectSubPix(map, {1, 1}, cv::Point2f(at), value);
  return value.at<float>(0);
}

TEST(Rectification, LeadsPixelsAndPointsBackToWhereOpenCvProjectsThem) {
  const StereoRig rig = awkward_rig();
  const Rectification rectification = make_rectification(rig, {640, 480});
  EXPECT_FALSE(rectification.identity);
  EXPECT_NEAR(rectification.baseline_mm, rig.baseline_mm(), 1e-9);
  for (const double z : {40.0, 70.0, 130.0})
    for (const double x : {-0.25, 0.0, 0.2})
      for (const double y : {-0.2, 0.05, 0.18}) {
        const Vec3 point(x * z, y * z, z);
        const Vec3 in_right = rig.right_from_left * point + rig.right_from_left_mm;
        const cv::Point2d left = project_to_rectified(rectification, point);
        const double disparity = rectification.disparity_px(rectified_depth_mm(rectification, point));

        EXPECT_LT((triangulate_pixel(rectification, left, disparity) - point).norm(), 1e-3);
        EXPECT_LT(cv::norm(project_to_recorded_left(rig, point) - project(rig.left, point)), 1e-9);

        const cv::Point2d right(left.x - disparity, left.y);
        if (!cv::Rect2d(1, 1, 637, 477).contains(left) || !cv::Rect2d(1, 1, 637, 477).contains(right)) continue;
        const cv::Point2d recorded_left(interpolate(rectification.left_map_x, left),
                                        interpolate(rectification.left_map_y, left));
        const cv::Point2d recorded_right(interpolate(rectification.right_map_x, right),
                                         interpolate(rectification.right_map_y, right));
        EXPECT_LT(cv::norm(recorded_left - project(rig.left, point)), 1e-3);
        EXPECT_LT(cv::norm(recorded_right - project(rig.right, in_right)), 1e-3);
      }
}

TEST(Rectification, PassesARectifiedRecordingThroughUntouched) {
  const TemporaryFolder folder;
  const StereoRig rig = read_rig(folder.write("c.yaml", calibration()));
  const Rectification rectification = make_rectification(rig, {640, 480});
  EXPECT_TRUE(rectification.identity);
  EXPECT_EQ(rectification.focal_px, 700);
  EXPECT_EQ(rectification.principal_x_px, 319.5);
  EXPECT_TRUE(rectification.rectified_from_left.isIdentity(0));
  StereoFrame frame{3, 0.12, cv::Mat(480, 640, CV_8UC3, cv::Scalar(1, 2, 3)), cv::Mat(480, 640, CV_8UC3)};
  const RectifiedPair pair = rectify(rectification, frame);
  EXPECT_EQ(pair.left.data, frame.left.data);
  EXPECT_EQ(pair.index, 3);
}

TEST(Rectification, MarksPixelsThatTheRecordingDoesNotHold) {
  const Rectification rectification = make_rectification(awkward_rig(), {640, 480});
  StereoFrame white{0, 0, cv::Mat(480, 640, CV_8UC3, cv::Scalar::all(255)),
                    cv::Mat(480, 640, CV_8UC3, cv::Scalar::all(255))};
  const RectifiedPair pair = rectify(rectification, white);
  const int valid = cv::countNonZero(rectification.valid_left);
  EXPECT_GT(valid, 640 * 480 * 8 / 10);
  EXPECT_LT(valid, 640 * 480);
  cv::Mat channel;
  cv::extractChannel(pair.left, channel, 0);
  EXPECT_EQ(cv::countNonZero((channel < 255) & rectification.valid_left), 0);
}

TEST(Rectification, CarriesAPolygonOfTheRecordedImageAlong) {
  const StereoRig rig = awkward_rig();
  const Rectification rectification = make_rectification(rig, {640, 480});
  const cv::Mat mask = rectified_polygon_mask(rectification, {{200, 150}, {420, 150}, {420, 330}, {200, 330}});
  const Vec3 inside(0, 0, 60), outside(14, 0, 60);
  EXPECT_EQ(mask.at<uchar>(cv::Point(project_to_rectified(rectification, inside))), 255);
  EXPECT_EQ(mask.at<uchar>(cv::Point(project_to_rectified(rectification, outside))), 0);
  EXPECT_EQ(cv::countNonZero(rectified_polygon_mask(rectification, {})), 640 * 480);
}

TEST(Triangulate, GivesPointsInTheLeftCameraFrameWithTheirDepthDeviation) {
  const StereoRig rig = awkward_rig();
  const Rectification rectification = make_rectification(rig, {640, 480});
  const Vec3 point(4, -6, 80);
  const cv::Point2d at = project_to_rectified(rectification, point);
  const cv::Point pixel(cvRound(at.x), cvRound(at.y));
  const float nothing = std::numeric_limits<float>::quiet_NaN();
  DisparityMap map{cv::Mat(480, 640, CV_32F, cv::Scalar(nothing)), cv::Mat(480, 640, CV_32F, cv::Scalar(0.1)),
                   cv::Mat(480, 640, CV_32F, cv::Scalar(0.9))};
  const double z = rectified_depth_mm(rectification, point);
  map.disparity_px.at<float>(pixel) = static_cast<float>(rectification.disparity_px(z));
  const cv::Mat left(480, 640, CV_8UC3, cv::Scalar(10, 20, 30));
  const PointCloud cloud = triangulate(map, rectification, left);
  ASSERT_EQ(cloud.size(), 1u);
  EXPECT_LT((cloud.position_mm[0] - point).norm(), 1.5 * z / rectification.focal_px);  // half a pixel off
  const double step = 0.1;
  const double expected = 0.5 * (rectification.depth_mm(rectification.disparity_px(z) - step) -
                                 rectification.depth_mm(rectification.disparity_px(z) + step));
  EXPECT_NEAR(cloud.depth_deviation_mm[0], expected, 0.01 * expected);
  EXPECT_EQ(cloud.colour[0], cv::Vec3b(10, 20, 30));
}

}  // namespace
}  // namespace palpate
