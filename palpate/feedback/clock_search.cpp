#include "palpate/feedback/clock_search.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

namespace palpate {

namespace {

constexpr size_t kMaxDelays = 12;

/// Mean of the values that fall into each step of a grid; empty steps are filled along the line between their
/// neighbours. Three rows, one per axis.
template <class Item, class TimeOf, class ForceOf>
cv::Mat_<double> on_grid(const std::vector<Item>& items, double step_s, TimeOf time_of, ForceOf force_of) {
  const double first_s = time_of(items.front());
  const auto place = [&](const Item& item) {
    return static_cast<int>(std::lround((time_of(item) - first_s) / step_s));
  };
  const int length = place(items.back()) + 1;
  cv::Mat_<double> grid = cv::Mat_<double>::zeros(3, length);
  std::vector<int> count(static_cast<size_t>(length), 0);
  for (const Item& item : items) {
    const int at = place(item);
    if (at < 0 || at >= length) continue;
    ++count[static_cast<size_t>(at)];
    for (int axis = 0; axis < 3; ++axis) grid(axis, at) += force_of(item)[axis];
  }
  int known = 0;
  for (int i = 0; i < length; ++i) {
    const int n = count[static_cast<size_t>(i)];
    if (n == 0) continue;
    for (int axis = 0; axis < 3; ++axis) {
      grid(axis, i) /= n;
      for (int k = known + 1; k < i; ++k)
        grid(axis, k) = grid(axis, known) + (grid(axis, i) - grid(axis, known)) * (k - known) / (i - known);
    }
    known = i;
  }
  return grid;
}

/// Sums over [0, i) of each axis and of the square, for means over any window.
struct RunningSums {
  std::vector<Vec3> sum;
  std::vector<double> square;

  explicit RunningSums(const cv::Mat_<double>& grid) {
    sum.assign(static_cast<size_t>(grid.cols) + 1, Vec3::Zero());
    square.assign(sum.size(), 0);
    for (int i = 0; i < grid.cols; ++i) {
      const auto k = static_cast<size_t>(i);
      const Vec3 value(grid(0, i), grid(1, i), grid(2, i));
      sum[k + 1] = sum[k] + value;
      square[k + 1] = square[k] + value.squaredNorm();
    }
  }
};

/// Sums over i of video(a, i) log(b, i + shift), for every shift from -(video.cols - 1) on, as row 3 a + b.
cv::Mat_<double> cross_sums(const cv::Mat_<double>& video, const cv::Mat_<double>& log) {
  const int shifts = video.cols + log.cols - 1, size = cv::getOptimalDFTSize(shifts);
  const auto transformed = [size](const cv::Mat& row, int at) {
    cv::Mat padded = cv::Mat::zeros(1, size, CV_64F), result;
    row.copyTo(padded.colRange(at, at + row.cols));
    cv::dft(padded, result);
    return result;
  };
  std::array<cv::Mat, 3> of_video, of_log;
  for (int axis = 0; axis < 3; ++axis) {
    of_video[static_cast<size_t>(axis)] = transformed(video.row(axis), 0);
    of_log[static_cast<size_t>(axis)] = transformed(log.row(axis), video.cols - 1);
  }
  cv::Mat_<double> sums(9, shifts);
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) {
      cv::Mat product, back;
      cv::mulSpectrums(of_log[static_cast<size_t>(b)], of_video[static_cast<size_t>(a)], product, 0, true);
      cv::dft(product, back, cv::DFT_INVERSE | cv::DFT_SCALE | cv::DFT_REAL_OUTPUT);
      back.colRange(0, shifts).copyTo(sums.row(3 * a + b));
    }
  return sums;
}

/// Without what both have as a mean; nothing tells where one of them does not move.
double score_at(int shift, const cv::Mat_<double>& sums, const RunningSums& video, const RunningSums& log) {
  const int video_length = static_cast<int>(video.sum.size()) - 1, log_length = static_cast<int>(log.sum.size()) - 1;
  const int begin = std::max(0, -shift), end = std::min(video_length, log_length - shift);
  const auto within = [](const auto& running, int from, int to) ->
      typename std::decay_t<decltype(running)>::value_type {
        return running[static_cast<size_t>(to)] - running[static_cast<size_t>(from)];
      };
  const double n = end - begin;
  const Vec3 e = within(video.sum, begin, end), s = within(log.sum, begin + shift, end + shift);
  const double ee = within(video.square, begin, end) - e.squaredNorm() / n;
  const double ss = within(log.square, begin + shift, end + shift) - s.squaredNorm() / n;
  const double rounding = 1e-9 * (log.square.back() / log_length) * n;
  if (!(ee > 0) || !(ss > rounding)) return 0;
  double squared = 0;
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) {
      const double covariance = sums(3 * a + b, shift + video_length - 1) - e[a] * s[b] / n;
      squared += covariance * covariance;
    }
  return std::sqrt(squared / (ee * ss));
}

}  // namespace

std::vector<double> likely_delays_s(const std::vector<ForceRow>& estimate, const std::vector<SensorReading>& sensor,
                                    double min_overlap, double step_s) {
  const cv::Mat_<double> video = on_grid(
      estimate, step_s, [](const ForceRow& row) { return row.time_s; },
      [](const ForceRow& row) -> const Vec3& { return row.force_N; });
  const cv::Mat_<double> log = on_grid(
      sensor, step_s, [](const SensorReading& reading) { return reading.time_s; },
      [](const SensorReading& reading) -> const Vec3& { return reading.force_N; });
  const cv::Mat_<double> sums = cross_sums(video, log);
  const RunningSums video_sums(video), log_sums(log);
  const int min = std::max(2, static_cast<int>(std::ceil(min_overlap * video.cols)));
  std::vector<std::pair<double, int>> scores;
  for (int shift = min - video.cols; shift <= log.cols - min; ++shift)
    scores.emplace_back(score_at(shift, sums, video_sums, log_sums), shift);
  std::vector<std::pair<double, int>> peaks;
  for (size_t i = 0; i < scores.size(); ++i) {
    const double before = i > 0 ? scores[i - 1].first : -1, after = i + 1 < scores.size() ? scores[i + 1].first : -1;
    if (scores[i].first >= before && scores[i].first >= after) peaks.push_back(scores[i]);
  }
  const size_t kept = std::min(peaks.size(), kMaxDelays);
  std::partial_sort(peaks.begin(), peaks.begin() + static_cast<std::ptrdiff_t>(kept), peaks.end(), std::greater<>());
  std::vector<double> delays_s;
  for (size_t i = 0; i < kept; ++i)
    delays_s.push_back(sensor.front().time_s - estimate.front().time_s + step_s * peaks[i].second);
  return delays_s;
}

}  // namespace palpate
