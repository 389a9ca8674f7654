#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/stereo/quasi_dense_stereo.hpp>
#include <opencv2/video/tracking.hpp>

#include "palpate/stereo/match.h"
#include "palpate/stereo/recording.h"
#include "tests/stereo/truth_cases.h"
#include "tests/support/reference_data.h"

// Disparity against truth, our matcher and OpenCV's on the same pairs in one run, goal beside measured; prints
// Markdown.
//   bench_matching [--ours] [--pictures FOLDER]
namespace {

using namespace palpate;
using test::MatchScore;
using test::TruthCase;

struct Goal {
  double mean_px, median_px, above_one_px, covered;
};

Goal goal_of(const std::string& name) {
  if (name == "scared_keyframe") return {0.25, 0.19, 0.015, 0.96};
  if (name == "motorcycle") return {0.6, 0.18, 0.05, 0.90};
  return {0.06, 0.04, 0.002, 0.98};
}

struct Timed {
  DisparityMap map;
  double wall_ms = 0;
  double cpu_ms = 0;  // of all threads
};

// The best of several runs: what the machine does besides is not ours.
Timed timed(const std::function<DisparityMap()>& match_once, int runs) {
  Timed best{{}, std::numeric_limits<double>::max(), std::numeric_limits<double>::max()};
  for (int i = 0; i < runs; ++i) {
    const auto wall = std::chrono::steady_clock::now();
    const std::clock_t cpu = std::clock();
    best.map = match_once();
    const std::chrono::duration<double, std::milli> passed = std::chrono::steady_clock::now() - wall;
    best.cpu_ms = std::min(best.cpu_ms, 1e3 * static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC);
    best.wall_ms = std::min(best.wall_ms, passed.count());
  }
  return best;
}

cv::Mat grey(const cv::Mat& bgr) {
  cv::Mat result;
  cv::cvtColor(bgr, result, cv::COLOR_BGR2GRAY);
  return result;
}

constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();

DisparityMap by_sgbm(const TruthCase& c) {
  constexpr int kBlock = 5;
  const int first = cvFloor(c.rectification.disparity_px(c.options.farthest_mm));
  const int max = cvCeil(c.rectification.disparity_px(c.options.nearest_mm));
  const auto matcher = cv::StereoSGBM::create(first, (max - first + 16) / 16 * 16, kBlock, 8 * kBlock * kBlock,
                                              32 * kBlock * kBlock, 1, 31, 5, 100, 2, cv::StereoSGBM::MODE_SGBM_3WAY);
  cv::Mat sixteenths;
  DisparityMap map;
  matcher->compute(grey(c.pair.left), grey(c.pair.right), sixteenths);
  sixteenths.convertTo(map.disparity_px, CV_32F, 1.0 / 16);
  map.disparity_px.setTo(kNothing, sixteenths < 16 * first);
  return map;
}

DisparityMap by_dis(const TruthCase& c) {
  const cv::Mat left = grey(c.pair.left), right = grey(c.pair.right);
  const auto flow = cv::DISOpticalFlow::create(cv::DISOpticalFlow::PRESET_MEDIUM);
  cv::Mat forth, back;
  flow->calc(left, right, forth);
  flow->calc(right, left, back);
  DisparityMap map;
  map.disparity_px = cv::Mat(left.size(), CV_32F, cv::Scalar(kNothing));
  const cv::Rect image({0, 0}, left.size());
  for (int y = 0; y < left.rows; ++y)
    for (int x = 0; x < left.cols; ++x) {
      const cv::Vec2f there = forth.at<cv::Vec2f>(y, x);
      const cv::Point at(cvRound(static_cast<float>(x) + there[0]), cvRound(static_cast<float>(y) + there[1]));
      if (image.contains(at) && cv::norm(there + back.at<cv::Vec2f>(at)) < 1)
        map.disparity_px.at<float>(y, x) = -there[0];
    }
  return map;
}

DisparityMap by_quasi_dense_of_opencv(const TruthCase& c) {
  DisparityMap map;
  map.disparity_px = cv::Mat(c.pair.left.size(), CV_32F, cv::Scalar(kNothing));
  const auto matcher = cv::stereo::QuasiDenseStereo::create(c.pair.left.size());
  matcher->process(c.pair.left, c.pair.right);
  std::vector<cv::stereo::MatchQuasiDense> matches;
  matcher->getDenseMatches(matches);
  for (const auto& match : matches) map.disparity_px.at<float>(match.p0) = static_cast<float>(match.p0.x - match.p1.x);
  return map;
}

DisparityMap by_us(const TruthCase& c) {
  return match(c.pair, c.rectification, cv::Mat(c.pair.left.size(), CV_8U, cv::Scalar(255)), c.options);
}

void print_row(const TruthCase& c, const std::string& matcher, const Timed& result) {
  const MatchScore s = score(result.map, c);
  const bool tells_deviation = !result.map.deviation_px.empty();
  fmt::print("| {} | {} | {:.3f} | {:.3f} | {:.2f} | {:.1f} | {} | {} | {} | {} | {:.0f} | {:.0f} |\n", c.name, matcher,
             s.mean_px, s.median_px, 100 * s.above_one_px, 100 * s.covered,
             c.metric ? fmt::format("{:.3f}", s.mean_mm) : "-", c.metric ? fmt::format("{:.3f}", s.median_mm) : "-",
             tells_deviation ? fmt::format("{:.2f}", s.within_one_deviation) : "-",
             tells_deviation ? fmt::format("{:.2f}", s.within_both_deviations) : "-", result.cpu_ms, result.wall_ms);
  std::fflush(stdout);
}

void print_goal(const TruthCase& c) {
  const Goal goal = goal_of(c.name);
  fmt::print("| {} | *goal* | *{:.2f}* | *{:.2f}* | *{:.1f}* | *{:.0f}* | | | | *0.58-0.78* | | |\n", c.name,
             goal.mean_px, goal.median_px, 100 * goal.above_one_px, 100 * goal.covered);
}

// Error from -1 px (blue) over 0 (white) to 1 px (red), black where not scored, green where nothing was measured.
void write_error_picture(const TruthCase& c, const DisparityMap& map, const std::filesystem::path& file) {
  cv::Mat picture(c.truth_px.size(), CV_8UC3, cv::Scalar::all(0));
  for (int y = 0; y < picture.rows; ++y)
    for (int x = 0; x < picture.cols; ++x) {
      if (!c.scored.at<uchar>(y, x)) continue;
      const float error = map.disparity_px.at<float>(y, x) - c.truth_px.at<float>(y, x);
      const auto fade = [](float e) { return cv::saturate_cast<uchar>(255 * (1 - std::abs(e))); };
      picture.at<cv::Vec3b>(y, x) = std::isnan(error) ? cv::Vec3b(0, 160, 0)
                                    : error > 0       ? cv::Vec3b(fade(error), fade(error), 255)
                                                      : cv::Vec3b(255, fade(error), fade(error));
    }
  cv::imwrite(file.string(), picture);
}

void print_accuracy(const std::vector<TruthCase>& cases, bool ours_alone, const std::filesystem::path& pictures) {
  fmt::print(
      "| case | matcher | mean px | median px | > 1 px, % | covered, % | mean mm | median mm | within one deviation | "
      "with the truth's own | CPU ms | wall ms |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (const TruthCase& c : cases) {
    print_goal(c);
    const Timed ours = timed([&] { return by_us(c); }, 5);
    print_row(c, "Palpate", ours);
    if (!pictures.empty()) write_error_picture(c, ours.map, pictures / (c.name + ".png"));
    if (ours_alone) continue;
    print_row(c, "SGBM", timed([&] { return by_sgbm(c); }, 3));
    print_row(c, "DIS", timed([&] { return by_dis(c); }, 3));
    print_row(c, "OpenCV quasi-dense", timed([&] { return by_quasi_dense_of_opencv(c); }, 1));
  }
}

// Living tissue at the size of a da Vinci, which has no truth.
TruthCase read_living_tissue() {
  RecordingOptions options;
  options.stereo = test::reference_data() / "surgt_tissue/video.mp4";
  options.calibration = test::reference_data() / "surgt_tissue/calibration.yaml";
  Recording recording(options);
  TruthCase result;
  result.name = "surgt_tissue";
  result.rectification = make_rectification(read_rig(options.calibration), recording.size());
  result.pair = rectify(result.rectification, *recording.next());
  return result;
}

void print_speed(const std::vector<TruthCase>& cases) {
  fmt::print("\n| recording | size | goal, wall ms on two cores | wall ms | CPU ms |\n|---|---|---|---|---|\n");
  for (const TruthCase& c : cases) {
    const cv::Size size = c.pair.left.size();
    const Timed ours = timed([&] { return by_us(c); }, 15);
    fmt::print("| {} | {}x{} | *{}* | {:.0f} | {:.0f} |\n", c.name, size.width, size.height,
               size.width > 960 ? 150 : 60, ours.wall_ms, ours.cpu_ms);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  const auto given = [&](const char* name) { return std::find(arguments.begin(), arguments.end(), name); };
  const auto pictures = given("--pictures");
  const bool has_folder = arguments.end() - pictures >= 2;
  std::vector<TruthCase> cases;
  for (const std::string& name : test::truth_case_names()) {
    if (std::filesystem::exists(test::reference_data() / name))
      cases.push_back(test::read_truth_case(name));
    else
      fmt::print(stderr, "reference data missing: {}\n", (test::reference_data() / name).string());
  }
  if (cases.empty()) return EXIT_FAILURE;
  print_accuracy(cases, given("--ours") != arguments.end(), has_folder ? pictures[1] : "");
  std::erase_if(cases, [](const TruthCase& c) { return c.pair.left.size() != cv::Size(960, 540); });
  if (std::filesystem::exists(test::reference_data() / "surgt_tissue")) cases.push_back(read_living_tissue());
  print_speed(cases);
  return EXIT_SUCCESS;
}
