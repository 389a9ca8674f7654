// A recording played over and over, with frames that are lost and stretches that are cut out: does memory grow, does
// the force at rest drift?  ./dev soak [MINUTES]
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <map>

#include "palpate/palpate.h"

namespace {

using namespace palpate;

constexpr int kFramesToSettle = 1000;
constexpr int kFramesBetweenSamples = 25;

/// What a loop does to its frames; every loop has contacts, because the recording has.
enum class Trouble { none, right_camera_missing, both_black, cut };
constexpr int kTroubles = 4, kLostFrames = 6, kCutFrames = 15;

double resident_MiB() {
  std::ifstream file("/proc/self/statm");
  long pages = 0, resident = 0;
  file >> pages >> resident;
  return static_cast<double>(resident) * static_cast<double>(sysconf(_SC_PAGESIZE)) / (1 << 20);
}

/// Least squares: slope and its standard error.
struct Slope {
  double value = 0, error = 0;
};

Slope slope_of(const std::vector<std::pair<double, double>>& samples) {
  const auto n = static_cast<double>(samples.size());
  if (n < 3) return {};
  double x = 0, y = 0, xx = 0, xy = 0, left = 0;
  for (const auto& [a, b] : samples) x += a / n, y += b / n;
  for (const auto& [a, b] : samples) xx += (a - x) * (a - x), xy += (a - x) * (b - y);
  const double slope = xy / xx;
  for (const auto& [a, b] : samples) left += std::pow(b - y - slope * (a - x), 2);
  return {slope, std::sqrt(left / (n - 2) / xx)};
}

struct Rest {
  int loop;
  double force_N, unnoticed_N;
};

double mean_of(const std::vector<Rest>& rests, size_t begin, size_t end, double Rest::*what) {
  double sum = 0;
  for (size_t i = begin; i < end; ++i) sum += rests[i].*what;
  return end > begin ? sum / static_cast<double>(end - begin) : 0;
}

StereoFrame with_trouble(StereoFrame frame, Trouble trouble, int from_start_of_trouble) {
  if (from_start_of_trouble < 0 || from_start_of_trouble >= kLostFrames) return frame;
  if (trouble == Trouble::right_camera_missing) frame.right = cv::Mat();
  if (trouble == Trouble::both_black)
    for (cv::Mat* image : {&frame.left, &frame.right}) *image = cv::Mat::zeros(image->size(), image->type());
  return frame;
}

}  // namespace

int main(int count, char** arguments) {
  if (count < 3) {
    fmt::print(stderr, "usage: bench_soak SCENE MINUTES\n");
    return 2;
  }
  const Scene scene = read_scene(arguments[1]);
  const std::chrono::duration<double> lasts(60 * std::stod(arguments[2]));
  Recording recording(scene.recording);
  const double step_s = 1 / recording.fps();
  const Rectification rectification = make_rectification(read_rig(scene.recording), recording.size());
  std::vector<StereoFrame> frames;
  while (const auto frame = recording.next()) frames.push_back(*frame);
  const TissueMap map = build_tissue_map(frames[0], rectification, scene.map, scene.tissue, scene.attachments);
  ForceEstimator estimator(map, frames[0], rectification, scene.instrument, scene.contact);

  const auto start = std::chrono::steady_clock::now();
  const auto length = static_cast<int>(frames.size());
  std::map<std::string, int> statuses, warnings;
  std::vector<std::pair<double, double>> memory;  // thousands of frames, MiB
  std::vector<Rest> rests;
  double peak_N = 0;
  int index = 0, loop = 0;
  for (; std::chrono::steady_clock::now() - start < lasts; ++loop) {
    const auto trouble = static_cast<Trouble>(loop % kTroubles);
    // At another place of the sequence each time.
    const int at = length / 5 + loop * 7 % (length * 3 / 5);
    for (int i = 0; i < length; ++i) {
      if (trouble == Trouble::cut && i == at) i += kCutFrames;
      StereoFrame frame = with_trouble(frames[static_cast<size_t>(std::min(i, length - 1))], trouble, i - at);
      frame.index = index;
      frame.time_s = index * step_s;
      const ForceEstimate estimate = estimator.update(frame);
      ++statuses[status_name(estimate.status)];
      for (const std::string& warning : estimate.warnings) ++warnings[warning];
      peak_N = std::max(peak_N, estimate.force_N.norm());
      if (i < 5) rests.push_back({loop, estimate.force_N.norm(), estimate.band.high_N});
      if (++index % kFramesBetweenSamples == 0) memory.emplace_back(1e-3 * index, resident_MiB());
    }
  }

  fmt::print("frames            {} in {} loops, {:.1f} minutes\n", index, loop, lasts.count() / 60);
  for (const auto& [status, frames_with] : statuses) fmt::print("status            {} {}\n", status, frames_with);
  for (const auto& [warning, frames_with] : warnings) fmt::print("warning           {} {}\n", warning, frames_with);
  std::vector<std::pair<double, double>> settled;
  for (const auto& sample : memory)
    if (1000 * sample.first > kFramesToSettle) settled.push_back(sample);
  const Slope growth = slope_of(settled);
  fmt::print("resident memory   {:.1f} MiB at frame {}, {:.1f} at the end\n",
             memory.empty() ? 0 : memory.front().second, kFramesBetweenSamples,
             memory.empty() ? 0 : memory.back().second);
  fmt::print("its slope         {:+.3f} +- {:.3f} MiB per 1000 frames after the first {}\n", growth.value, growth.error,
             kFramesToSettle);
  const size_t quarter = rests.size() / 4;
  for (const auto& [name, begin, end] :
       {std::tuple{"first", size_t{0}, quarter}, std::tuple{"last ", rests.size() - quarter, rests.size()}})
    fmt::print("rest, {} quarter {:.4f} N mean, {:.4f} N would have gone unnoticed\n", name,
               mean_of(rests, begin, end, &Rest::force_N), mean_of(rests, begin, end, &Rest::unnoticed_N));
  fmt::print("peak force        {:.3f} N\n", peak_N);
}
