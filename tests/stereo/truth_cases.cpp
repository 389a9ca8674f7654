#include "tests/stereo/truth_cases.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "palpate/core/errors.h"
#include "palpate/core/quantile.h"
#include "palpate/stereo/recording.h"
#include "tests/support/reference_data.h"

namespace palpate::test {
namespace {

cv::Mat read_image(const std::filesystem::path& file, int flags) {
  cv::Mat image = cv::imread(file.string(), flags);
  if (image.empty()) throw BadInput(file.string() + ": cannot be read, expected an image");
  return image;
}

// Portable float map: OpenCV divides by its scale, which others take for a unit.
cv::Mat read_float_map(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::string kind;
  int width = 0, height = 0;
  double scale = 0;
  stream >> kind >> width >> height >> scale;
  stream.get();
  cv::Mat values(height, width, CV_32F);
  for (int y = height - 1; y >= 0; --y) stream.read(values.ptr<char>(y), static_cast<std::streamsize>(values.step[0]));
  if (!stream || kind != "Pf" || scale >= 0)
    throw BadInput(file.string() + ": cannot be read, expected a little-endian float map of one channel");
  return values;
}

Rectification plain_rectification(cv::Size size, double focal_px, double baseline_mm) {
  Rectification result;
  result.size = size;
  result.focal_px = focal_px;
  result.baseline_mm = baseline_mm;
  result.identity = true;
  result.valid_left = cv::Mat(size, CV_8U, cv::Scalar(255));
  result.valid_right = result.valid_left;
  return result;
}

TruthCase read_rendered(const std::filesystem::path& folder) {
  RecordingOptions options;
  options.left = folder / "left.mp4";
  options.right = folder / "right.mp4";
  options.calibration = folder / "calibration.yaml";
  Recording recording(options);
  TruthCase result;
  result.rectification = make_rectification(read_rig(options.calibration), recording.size());
  result.pair = rectify(result.rectification, *recording.next());
  const cv::Mat depth_mm = read_image(folder / "depth0_left.tiff", cv::IMREAD_UNCHANGED);
  result.truth_px = result.rectification.focal_px * result.rectification.baseline_mm / depth_mm;
  result.scored = read_image(folder / "id0_left.png", cv::IMREAD_GRAYSCALE) == 1;
  result.metric = true;
  return result;
}

TruthCase read_structured_light(const std::filesystem::path& folder) {
  TruthCase result;
  result.pair.left = read_image(folder / "left.png", cv::IMREAD_COLOR);
  result.pair.right = read_image(folder / "right.png", cv::IMREAD_COLOR);
  result.rectification = plain_rectification(result.pair.left.size(), 517.5, 4.1435);
  read_image(folder / "disparity_px.tiff", cv::IMREAD_UNCHANGED).convertTo(result.truth_px, CV_32F);
  const cv::Mat hidden = read_image(folder / "occlusion.png", cv::IMREAD_GRAYSCALE) == 128;
  result.scored = (result.truth_px > 0) & ~hidden;
  return result;
}

// The cameras of this rig have principal points 32.778 px apart, so disparity 0 is not infinitely far.
TruthCase read_motorcycle(const std::filesystem::path& folder) {
  constexpr double focal_px = 999.421, baseline_mm = 193.001;
  TruthCase result;
  result.pair.left = read_image(folder / "im0.png", cv::IMREAD_COLOR);
  result.pair.right = read_image(folder / "im1.png", cv::IMREAD_COLOR);
  result.rectification = plain_rectification(result.pair.left.size(), focal_px, baseline_mm);
  result.options.nearest_mm = focal_px * baseline_mm / 70;
  result.options.farthest_mm = focal_px * baseline_mm / 2;
  result.truth_px = read_float_map(folder / "disp0GT.pfm");
  const cv::Mat known = cv::abs(result.truth_px) < 1e6;
  result.scored = (read_image(folder / "mask0nocc.png", cv::IMREAD_GRAYSCALE) == 255) & known;
  result.shift_px = 32.778;
  result.metric = true;
  return result;
}

double mean_of(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

// How far the truth lies from the middle between its neighbours four px on either side, where on a plane it would lie:
// structured light comes in steps.
double scatter_of(const cv::Mat& truth_px, const cv::Mat& scored) {
  constexpr int k = 4;
  std::vector<double> off;
  for (int y = 0; y < truth_px.rows; ++y)
    for (int x = k; x + k < truth_px.cols; ++x)
      if (scored.at<uchar>(y, x - k) && scored.at<uchar>(y, x) && scored.at<uchar>(y, x + k))
        off.push_back(
            std::abs(truth_px.at<float>(y, x) - 0.5f * (truth_px.at<float>(y, x - k) + truth_px.at<float>(y, x + k))));
  return 1.4826 / std::sqrt(1.5) * median_of(std::move(off));
}

}  // namespace

const std::vector<std::string>& truth_case_names() {
  static const std::vector<std::string> names = {"scared_keyframe", "rendered_liver", "rendered_uterus", "motorcycle"};
  return names;
}

TruthCase read_truth_case(const std::string& name) {
  const std::filesystem::path folder = reference_data() / name;
  TruthCase result = name == "scared_keyframe" ? read_structured_light(folder)
                     : name == "motorcycle"    ? read_motorcycle(folder)
                                               : read_rendered(folder);
  result.name = name;
  result.truth_deviation_px = scatter_of(result.truth_px, result.scored);
  return result;
}

MatchScore score(const DisparityMap& map, const TruthCase& truth) {
  const double focal_baseline = truth.rectification.focal_px * truth.rectification.baseline_mm;
  std::vector<double> errors_px, errors_mm;
  int above = 0, within = 0, within_both = 0;
  for (int y = 0; y < truth.truth_px.rows; ++y)
    for (int x = 0; x < truth.truth_px.cols; ++x) {
      const double d = map.disparity_px.at<float>(y, x), t = truth.truth_px.at<float>(y, x);
      if (!truth.scored.at<uchar>(y, x) || std::isnan(d)) continue;
      const double error = std::abs(d - t);
      errors_px.push_back(error);
      errors_mm.push_back(std::abs(focal_baseline / (d + truth.shift_px) - focal_baseline / (t + truth.shift_px)));
      above += error > 1;
      const double deviation = map.deviation_px.empty() ? 0 : map.deviation_px.at<float>(y, x);
      within += error < deviation;
      within_both += error < std::hypot(deviation, truth.truth_deviation_px);
    }
  MatchScore result;
  const double count = std::max<double>(1, static_cast<double>(errors_px.size()));
  result.mean_px = mean_of(errors_px);
  result.mean_mm = mean_of(errors_mm);
  result.median_px = median_of(std::move(errors_px));
  result.median_mm = median_of(std::move(errors_mm));
  result.above_one_px = above / count;
  result.within_one_deviation = within / count;
  result.within_both_deviations = within_both / count;
  result.covered = count / std::max(1, cv::countNonZero(truth.scored));
  return result;
}

}  // namespace palpate::test
