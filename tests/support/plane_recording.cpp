#include "tests/support/plane_recording.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <sstream>

namespace palpate::test {

namespace {

constexpr int kWidth = 320, kHeight = 240;

/// Disparity of the plane where the *right* camera sees it.
double disparity_at(double x, double y) {
  return 22 + 0.006 * x + 0.012 * y;
}

cv::Mat texture() {
  cv::RNG random(7);
  cv::Mat noise(kHeight, kWidth + 80, CV_32F), smooth, image;
  random.fill(noise, cv::RNG::NORMAL, 0, 1);
  cv::GaussianBlur(noise, smooth, {}, 1.6);
  cv::normalize(smooth, smooth, 0, 1, cv::NORM_MINMAX);
  std::vector<cv::Mat> channels = {smooth * 90 + 20, smooth * 100 + 25, smooth * 140 + 80};
  cv::merge(channels, image);
  return image;
}

}  // namespace

Workspace::Workspace() {
  std::string pattern = (std::filesystem::temp_directory_path() / "palpate_test_XXXXXX").string();
  folder_ = mkdtemp(pattern.data());
}

Workspace::~Workspace() {
  std::filesystem::remove_all(folder_);
}

PlanePair plane_pair(int frame) {
  static const cv::Mat kTexture = texture();
  cv::Mat map_x(kHeight, kWidth, CV_32F), map_y(kHeight, kWidth, CV_32F);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      map_x.at<float>(y, x) = static_cast<float>(x + disparity_at(x, y));
      map_y.at<float>(y, x) = static_cast<float>(y);
    }
  cv::Mat right, left = kTexture(cv::Rect(0, 0, kWidth, kHeight)).clone();
  cv::remap(kTexture, right, map_x, map_y, cv::INTER_CUBIC);
  cv::RNG random(static_cast<uint64_t>(frame) + 1);
  for (cv::Mat* image : {&left, &right}) {
    cv::Mat noise(image->size(), CV_32FC3);
    random.fill(noise, cv::RNG::NORMAL, 0, 1);
    *image += noise;
    image->convertTo(*image, CV_8U);
  }
  return {left, right};
}

void write_avi(const std::filesystem::path& file, const std::vector<cv::Mat>& frames) {
  cv::VideoWriter writer(file.string(), cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 25, frames.front().size());
  ASSERT_TRUE(writer.isOpened());
  writer.set(cv::VIDEOWRITER_PROP_QUALITY, 98);
  for (const cv::Mat& frame : frames) writer.write(frame);
}

void write_plane_recording(const std::filesystem::path& folder, int frames) {
  std::filesystem::create_directories(folder);
  std::vector<cv::Mat> left, right;
  for (int frame = 0; frame < frames; ++frame) {
    const PlanePair pair = plane_pair(frame);
    left.push_back(pair.left);
    right.push_back(pair.right);
  }
  write_avi(folder / "left.avi", left);
  write_avi(folder / "right.avi", right);
  const auto matrix = [](const char* name, int rows, int cols, const char* data) {
    return fmt::format("{}: !!opencv-matrix\n   rows: {}\n   cols: {}\n   dt: d\n   data: [{}]\n", name, rows, cols,
                       data);
  };
  const char* K = "300, 0, 159.5, 0, 300, 119.5, 0, 0, 1";
  write_file(folder / "calibration.yaml",
             "%YAML:1.0\n---\nimage_width: 320\nimage_height: 240\n" + matrix("K1", 3, 3, K) +
                 matrix("D1", 1, 5, "0, 0, 0, 0, 0") + matrix("K2", 3, 3, K) + matrix("D2", 1, 5, "0, 0, 0, 0, 0") +
                 matrix("R", 3, 3, "1, 0, 0, 0, 1, 0, 0, 0, 1") + matrix("T", 3, 1, "-5, 0, 0"));
  write_file(folder / "scene.yaml",
             "recording: {left: left.avi, right: right.avi, calibration: calibration.yaml}\n"
             "map: {frame: 0, elements: 400, thickness_mm: 15,\n"
             "      organ_region_px: [[40, 30], [300, 30], [300, 210], [40, 210]]}\n"
             "tissue: {law: saint-venant-kirchhoff, young_modulus_kPa: 27, poisson_ratio: 0.45}\n"
             "attachments:\n"
             "  - underside: {depth_mm: 3}\n"
             "instrument: {segmentation: colour}\n"
             "contact: {threshold_mm: 1.5, footprint_radius_mm: 2, grip: grasp}\n");
}

void write_file(const std::filesystem::path& file, const std::string& text) {
  std::ofstream(file) << text;
}

std::string read_file(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

void replace_in_file(const std::filesystem::path& file, const std::string& from, const std::string& to) {
  std::string text = read_file(file);
  const size_t at = text.find(from);
  ASSERT_NE(at, std::string::npos) << from;
  write_file(file, text.replace(at, from.size(), to));
}

}  // namespace palpate::test
