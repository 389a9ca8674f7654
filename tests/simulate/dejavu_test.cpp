#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <unistd.h>
#include <yaml-cpp/yaml.h>

#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <sstream>

#include "palpate/core/errors.h"
#include "palpate/simulate/dejavu.h"
#include "palpate/simulate/gesture.h"
#include "palpate/simulate/organ_shape.h"
#include "palpate/simulate/uterus_demo.h"
#include "palpate/stereo/rig.h"
#include "palpate/volume/body.h"
#include "palpate/volume/inside.h"

namespace palpate {
namespace {

// The demo in small: a quarter of the pixels per side, a coarse body, a fifth of the frames.
SimulatedCase small_case() {
  SimulatedCase demo = uterus_demo();
  demo.simulate.camera = {240, 136, 175, 5, 5};
  demo.simulate.body.elements = 900;
  for (GestureRow& row : demo.simulate.gesture) row.at_px *= 0.25;
  return demo;
}

std::vector<GestureRow> read_gesture(const std::string& rows) {
  SimulateOptions options;
  Settings settings;
  describe(settings, options);
  read_settings(YAML::Load("gesture: " + rows), {"scene.yaml", "/"}, settings, "simulate.");
  return options.gesture;
}

struct Row {
  int frame;
  double time_s;
  int in_contact;
  Vec3 force;
  double force_N;
  Vec3 tip;
};

std::vector<Row> read_truth(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  EXPECT_EQ(line.rfind("frame,time_s,in_contact,fx_N,fy_N,fz_N,force_N,tip_x_mm,tip_y_mm,tip_z_mm", 0), 0u);
  std::vector<Row> rows;
  while (std::getline(in, line)) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream cells(line);
    Row row;
    cells >> row.frame >> row.time_s >> row.in_contact >> row.force[0] >> row.force[1] >> row.force[2] >> row.force_N >>
        row.tip[0] >> row.tip[1] >> row.tip[2];
    EXPECT_FALSE(cells.fail()) << line;
    rows.push_back(row);
  }
  return rows;
}

// One recording for all tests of this suite.
class DejaVu : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder = std::filesystem::path(::testing::TempDir()) / ("palpate_dejavu_" + std::to_string(getpid()));
    std::filesystem::remove_all(folder);
    SimulatedCase demo = small_case();
    demo.simulate.write.surface = demo.simulate.write.depth = true;
    summary = simulate_dejavu(demo.simulate, demo.tissue, demo.attachments, demo.contact, folder,
                              [](int now, int all) { done = now, total = all; });
  }
  static void TearDownTestSuite() { std::filesystem::remove_all(folder); }

  static inline std::filesystem::path folder;
  static inline DejaVuSummary summary;
  static inline int done = 0, total = -1;
};

TEST_F(DejaVu, WritesOneRowAndOnePictureOfEachEyePerFrame) {
  EXPECT_EQ(done, total);
  EXPECT_EQ(static_cast<int>(read_truth(folder / "truth.csv").size()), summary.frames);
  for (const char* name : {"left.mp4", "right.mp4"}) {
    cv::VideoCapture video((folder / name).string());
    cv::Mat image;
    int frames = 0;
    while (video.read(image)) {
      EXPECT_EQ(image.size(), cv::Size(240, 136));
      EXPECT_GT(cv::mean(image)[2], 10);
      ++frames;
    }
    EXPECT_EQ(frames, summary.frames);
    EXPECT_NEAR(video.get(cv::CAP_PROP_FPS), 5, 1e-6);
  }
}

TEST_F(DejaVu, CalibrationIsReadBackByTheRigReader) {
  const StereoRig rig = read_rig(folder / "calibration.yaml");
  EXPECT_EQ(rig.image_size, cv::Size(240, 136));
  EXPECT_NEAR(rig.baseline_mm(), 5, 1e-12);
  EXPECT_LT(rig.right_from_left_mm.x(), 0);  // the right camera is on the right
  EXPECT_NEAR(rig.left.K(0, 0), 175, 1e-12);
  EXPECT_NEAR(rig.right.K(1, 2), 67.5, 1e-12);
  EXPECT_NO_THROW(check_rig_fits(rig, cv::Size(240, 136)));
}

TEST_F(DejaVu, ContactBeginsAndEndsWithTheGesture) {
  const auto gesture = small_case().simulate.gesture;
  for (const Row& row : read_truth(folder / "truth.csv")) {
    EXPECT_EQ(row.in_contact == 1, gesture_at(gesture, row.time_s).in_contact) << row.frame;
    EXPECT_NEAR(row.force.norm(), row.force_N, 1e-5);
    if (row.in_contact == 0) {
      EXPECT_EQ(row.force_N, 0);
    }
  }
  EXPECT_EQ(summary.first_contact_frame, 3);
}

TEST_F(DejaVu, PullsWhenMovedOutwardsAndPushesWhenMovedInwards) {
  bool pulled = false, pushed = false;
  const auto gesture = small_case().simulate.gesture;
  for (const Row& row : read_truth(folder / "truth.csv")) {
    const double outwards = gesture_at(gesture, row.time_s).move_mm.x();
    if (row.in_contact && outwards > 1) {
      EXPECT_GT(row.force.dot(summary.contact_normal), 1);
      pulled = true;
    }
    if (row.in_contact && outwards < -0.5) {
      EXPECT_LT(row.force.dot(summary.contact_normal), -0.5);
      pushed = true;
    }
  }
  EXPECT_TRUE(pulled && pushed);
  EXPECT_LE(summary.largest_residual, 1e-8);
}

TEST_F(DejaVu, TipIsTheCentreOfTheFootprintInContactAndFarWhenFree) {
  const auto gesture = small_case().simulate.gesture;
  for (const Row& row : read_truth(folder / "truth.csv")) {
    const double from_rest = (row.tip - summary.contact_mm).norm();
    const GesturePose pose = gesture_at(gesture, row.time_s);
    const double expected = row.in_contact ? pose.move_mm.norm() : small_case().simulate.instrument.free_distance_mm;
    if (row.in_contact || row.frame == 0) {
      EXPECT_NEAR(from_rest, expected, 1e-3);
    }
  }
}

TEST_F(DejaVu, OutlineCoversTheOrganInTheFirstPicture) {
  std::vector<cv::Point> polygon(summary.organ_region_px.begin(), summary.organ_region_px.end());
  cv::VideoCapture video((folder / "left.mp4").string());
  cv::Mat image, mask(136, 240, CV_8U, cv::Scalar(0));
  ASSERT_TRUE(video.read(image));
  cv::fillPoly(mask, std::vector<std::vector<cv::Point>>{polygon}, 255);
  // Tissue is redder and brighter than the wall.
  EXPECT_GT(cv::mean(image, mask)[2], 2 * cv::mean(image, ~mask)[2]);
  // The shape is convex but for a hair, so its outline is the hull of what its points project to.
  std::vector<cv::Point2f> projected;
  for (const Vec3& p : make_organ(small_case().simulate.body, 5000).vertices_mm)
    projected.emplace_back(static_cast<float>(175 * p.x() / p.z() + 119.5),
                           static_cast<float>(175 * p.y() / p.z() + 67.5));
  std::vector<cv::Point2f> hull;
  cv::convexHull(projected, hull);
  EXPECT_NEAR(cv::contourArea(polygon) / cv::contourArea(hull), 1, 0.05);
}

TEST_F(DejaVu, TheThicknessTimesTheShadowIsTheVolume) {
  const Surface organ = make_organ(small_case().simulate.body, 5000);
  std::vector<cv::Point2f> points, shadow;
  for (const Vec3& p : organ.vertices_mm) points.emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()));
  cv::convexHull(points, shadow);
  EXPECT_NEAR(summary.thickness_mm * cv::contourArea(shadow) / enclosed_volume_mm3(organ), 1, 0.03);
}

// The organ that the files tell of is where its depth is seen, but for where the instrument stands before it.
TEST_F(DejaVu, WritesSurfaceAndDepthOfEveryFrameThatAgree) {
  for (int frame = 0; frame < summary.frames; ++frame) {
    const auto name = [&](const char* pattern) { return (folder / cv::format(pattern, frame)).string(); };
    const Surface organ = read_body(name("surface/frame_%04d.ply"), LengthUnit::mm);
    const cv::Mat depth = cv::imread(name("depth/left_%04d.png"), cv::IMREAD_UNCHANGED);
    ASSERT_EQ(depth.type(), CV_16U);
    ASSERT_EQ(depth.size(), cv::Size(240, 136));
    const std::vector<Vec3> normals = vertex_normals(organ.vertices_mm, organ.triangles);
    int seen = 0, hidden = 0;
    for (size_t i = 0; i < organ.vertices_mm.size(); ++i) {
      const Vec3& p = organ.vertices_mm[i];
      if (normals[i].dot(-p.normalized()) < 0.5) continue;
      const auto x = static_cast<int>(std::lround(175 * p.x() / p.z() + 119.5));
      const auto y = static_cast<int>(std::lround(175 * p.y() / p.z() + 67.5));
      const double seen_mm = depth.at<ushort>(y, x) / 100.0;
      ASSERT_LT(seen_mm, p.z() + 1.0) << "frame " << frame;  // a pixel is 0.6 mm wide
      seen += seen_mm > p.z() - 1.0;
      hidden += seen_mm <= p.z() - 1.0;
    }
    EXPECT_GT(seen, 1000);
    EXPECT_LT(hidden, seen / 4) << "frame " << frame;
  }
}

// A probe presses, slides to the side, lifts and leaves, while the scene breathes; with all that a bad day brings.
TEST(DejaVuPush, IsInContactOnlyWhileItPressesAndLooksTheSameInTheFilesForAnyNumberOfThreads) {
  SimulatedCase demo = small_case();
  demo.simulate.body.elements = 5000;  // fewer cannot tell the patch from a point
  demo.tissue.law = Law::neo_hookean;
  demo.simulate.gesture = read_gesture(R"([{approach_s: 0.4, at_px: [102, 49], footprint_radius_mm: 4}, {push: true},
    {move_mm: [-1.2, 0, 0], during_s: 0.4}, {move_mm: [-1.2, 3, 0], during_s: 0.4}, {move_mm: [1, 3, 0], during_s: 0.6},
    {release: true, leave_s: 0.2}])");
  demo.simulate.look.smoke.density = 0.2;
  demo.simulate.look.interlace = true;
  demo.simulate.breathing = {{0, 2, 1}, 2, SimulatedBreathing::Instrument::follows};
  demo.simulate.write.surface = demo.simulate.write.depth = true;
  demo.simulate.write.grip = SimulatedFiles::Grip::automatic;
  const auto folder = std::filesystem::path(::testing::TempDir()) / ("palpate_push_" + std::to_string(getpid()));
  std::vector<std::vector<std::string>> written;
  for (const size_t threads : {1, 3}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const DejaVuSummary summary = simulate_dejavu(demo.simulate, demo.tissue, demo.attachments, demo.contact, folder);
    EXPECT_EQ(summary.grip, Grip::automatic);
    EXPECT_GT(summary.peak_force_N, 1);
    std::vector<std::string> files;
    for (const char* name : {"truth.csv", "depth/left_0004.png", "surface/frame_0005.ply"}) {
      std::ifstream in(folder / name, std::ios::binary);
      files.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
    }
    written.push_back(files);
    bool pressed = false;
    for (const Row& row : read_truth(folder / "truth.csv")) {
      const GesturePose pose = gesture_at(demo.simulate.gesture, row.time_s);
      if (pose.move_mm.x() > 0.3) {
        EXPECT_EQ(row.in_contact, 0) << row.frame;
      }
      if (pose.move_mm.x() < -0.3) {
        EXPECT_EQ(row.in_contact, 1) << row.frame;
      }
      if (row.in_contact == 1) {
        EXPECT_LE(row.force.dot(summary.contact_normal), 0);
      }
      pressed = pressed || pose.move_mm.x() < -1;
    }
    EXPECT_TRUE(pressed);
    std::filesystem::remove_all(folder);
  }
  EXPECT_EQ(written[0][0], written[1][0]);
  EXPECT_TRUE(written[0] == written[1]);  // what is drawn is compared before it is encoded, by the tests of Renderer
}

TEST(DejaVuSettings, RefuseAGestureThatMissesTheOrganAndWriteNothing) {
  SimulatedCase demo = small_case();
  demo.simulate.gesture[0].at_px = {5, 5};
  const auto folder =
      std::filesystem::path(::testing::TempDir()) / ("palpate_dejavu_missed_" + std::to_string(getpid()));
  EXPECT_THROW(simulate_dejavu(demo.simulate, demo.tissue, demo.attachments, demo.contact, folder), BadInput);
  EXPECT_FALSE(std::filesystem::exists(folder));
}

}  // namespace
}  // namespace palpate
