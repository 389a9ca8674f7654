#include "palpate/surface/depth_edges.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <opencv2/imgproc.hpp>

namespace palpate {

namespace {

/// Cells that a line is fitted over; those nearest to the edge are blurred by the matcher and left out.
constexpr int kFitted = 6, kMinFitted = 3, kGuard = 2;
/// Fraction of the stated deviation that does not cancel between the two sides: errors of neighbours are alike.
constexpr double kOwnDeviation = 0.5;
/// A cell nearer than this fraction of a jump to one side belongs to it; two cells are parted by half of it.
constexpr double kMixed = 0.25, kParted = 0.5;
/// Stretch in which something else must be seen before a face is believed to hide it, mm.
constexpr double kSeenThrough_mm = 0.8;
/// Slopes beyond this (depth per lateral mm) are not carried on.
constexpr double kSteepest = 4;

/// One row or column of cells.
struct Line {
  const DepthCells& cells;
  cv::Point start, step;
  int length;

  cv::Point at(int i) const { return start + i * step; }
  bool known(int i) const { return i >= 0 && i < length && std::isfinite(cells.w(at(i))); }
};

/// What one side continues to at a place between cells.
struct Side {
  int cells = 0;
  double w = 0, slope = 0;  ///< per cell
  double variance = 0;
};

/// From the known cells beginning with `first`, going by `direction`, carried to `place`.
Side continued(const Line& line, int first, int direction, int wanted, double place) {
  double x[64], w[64], stated = 0;
  int n = 0;
  for (int i = first; std::abs(i - first) < 2 * wanted && n < wanted; i += direction) {
    if (i < 0 || i >= line.length) break;
    if (!line.known(i)) continue;
    x[n] = i - place;
    w[n] = static_cast<double>(line.cells.w(line.at(i)));
    stated += static_cast<double>(line.cells.deviation(line.at(i)));
    ++n;
  }
  Side side;
  side.cells = n;
  if (n < kMinFitted) return side;
  const double mean_x = std::accumulate(x, x + n, 0.0) / n, mean_w = std::accumulate(w, w + n, 0.0) / n;
  double xx = 0, xw = 0, squares = 0;
  for (int i = 0; i < n; ++i) xx += (x[i] - mean_x) * (x[i] - mean_x), xw += (x[i] - mean_x) * (w[i] - mean_w);
  const double max = kSteepest * line.cells.pitch * mean_w;
  side.slope = std::clamp(xw / xx, -max, max);
  side.w = mean_w - side.slope * mean_x;
  for (int i = 0; i < n; ++i) squares += std::pow(w[i] - side.w - side.slope * x[i], 2);
  const double noise = squares / (n - 1.0);
  side.variance = noise * (1.0 / n + mean_x * mean_x / xx) + std::pow(kOwnDeviation * stated / n, 2);
  return side;
}

/// Both sides of the place between two known cells with nothing known between them.
struct Step {
  int before = 0, after = 0;
  Side left, right;
  double jump_w = 0;
  double score = 0;  ///< the jump over what is allowed
};

Step step_between(const Line& line, int before, int after, const EdgeOptions& options) {
  Step step;
  step.before = before;
  step.after = after;
  const double place = 0.5 * (before + after);
  step.left = continued(line, before - kGuard, -1, kFitted, place);
  step.right = continued(line, after + kGuard, 1, kFitted, place);
  if (step.left.cells < kMinFitted || step.right.cells < kMinFitted) return step;
  step.jump_w = step.right.w - step.left.w;
  const double w = std::max(0.5 * (step.left.w + step.right.w), 1e-6);
  const double allowed = std::max(options.min_jump_mm * w * w,
                                  options.jump_deviations * std::sqrt(step.left.variance + step.right.variance));
  step.score = std::abs(step.jump_w) / allowed;
  return step;
}

std::vector<Step> steps_along(const Line& line, const EdgeOptions& options) {
  std::vector<Step> steps;
  int last = -1;
  for (int i = 0; i < line.length; ++i) {
    if (!line.known(i)) continue;
    if (last >= 0) steps.push_back(step_between(line, last, i, options));
    last = i;
  }
  return steps;
}

std::vector<Line> all_lines(const DepthCells& cells) {
  std::vector<Line> lines;
  for (int r = 0; r < cells.w.rows; ++r) lines.push_back({cells, {0, r}, {1, 0}, cells.w.cols});
  for (int c = 0; c < cells.w.cols; ++c) lines.push_back({cells, {c, 0}, {0, 1}, cells.w.rows});
  return lines;
}

/// Steps that no neighbour exceeds.
bool is_sharpest(const std::vector<Step>& steps, size_t k) {
  for (size_t other = k; other-- > 0 && steps[k].before - steps[other].after <= kGuard;)
    if (steps[other].score > steps[k].score) return false;
  for (size_t other = k + 1; other < steps.size() && steps[other].before - steps[k].after <= kGuard; ++other)
    if (steps[other].score >= steps[k].score) return false;
  return true;
}

/// Marks the cells beside a step, and those that both sides are mixed in.
void mark(const Line& line, const Step& step, cv::Mat1f& jump_w, cv::Mat1b& mixed) {
  const double place = 0.5 * (step.before + step.after), jump = std::abs(step.jump_w);
  for (int i = std::max(0, step.before - kGuard); i <= std::min(line.length - 1, step.after + kGuard); ++i) {
    const cv::Point cell = line.at(i);
    jump_w(cell) = std::max(jump_w(cell), static_cast<float>(jump));
    if (!line.known(i)) continue;
    const double w = static_cast<double>(line.cells.w(cell)), away = i - place;
    if (std::min(std::abs(w - step.left.w - step.left.slope * away),
                 std::abs(w - step.right.w - step.right.slope * away)) > kMixed * jump)
      mixed(cell) = 255;
  }
}

/// Without edges that are shorter than wanted, wherever they lie.
void drop_short_edges(const DepthCells& cells, double min_edge_mm, cv::Mat1f& jump_w) {
  cv::Mat labels, boxes, middles;
  const int edges = cv::connectedComponentsWithStats(jump_w > 0, labels, boxes, middles, 8, CV_32S);
  std::vector<double> sum_w(static_cast<size_t>(edges), 0), known(static_cast<size_t>(edges), 0);
  for (int r = 0; r < jump_w.rows; ++r)
    for (int c = 0; c < jump_w.cols; ++c)
      if (const auto label = static_cast<size_t>(labels.at<int>(r, c)); label > 0 && cells.is_known({c, r})) {
        sum_w[label] += static_cast<double>(cells.w(r, c));
        ++known[label];
      }
  for (int r = 0; r < jump_w.rows; ++r)
    for (int c = 0; c < jump_w.cols; ++c) {
      const int label = labels.at<int>(r, c);
      if (label == 0) continue;
      const auto l = static_cast<size_t>(label);
      const int extent = std::max(boxes.at<int>(label, cv::CC_STAT_WIDTH), boxes.at<int>(label, cv::CC_STAT_HEIGHT));
      // Every mark reaches a guard beyond its step.
      if (known[l] == 0 || (extent - 2 * kGuard) * cells.size_mm(sum_w[l] / known[l]) < min_edge_mm) jump_w(r, c) = 0;
    }
}

/// Calls visit(cell, t, next) for the cells between two points, 0 < t < 1, until it returns false.
template <class Visit>
void walk(const DepthCells& cells, const Vec3& a_mm, const Vec3& b_mm, Visit visit) {
  const cv::Point from = cells.cell_of(a_mm), to = cells.cell_of(b_mm);
  const int steps = std::max(std::abs(to.x - from.x), std::abs(to.y - from.y));
  for (int i = 0; i <= steps; ++i) {
    const double t = steps == 0 ? 0.5 : static_cast<double>(i) / steps;
    if (!visit(cv::Point(cvRound(from.x + t * (to.x - from.x)), cvRound(from.y + t * (to.y - from.y))), t)) return;
  }
}

/// Longest stretch in mm of cells on the way for which `counts(cell, w on the straight way)`.
template <class Counts>
double longest_stretch_mm(const DepthCells& cells, const Vec3& a_mm, const Vec3& b_mm, Counts counts) {
  const double w_a = 1 / a_mm.z(), w_b = 1 / b_mm.z();
  const cv::Point way = cells.cell_of(b_mm) - cells.cell_of(a_mm);
  const double cells_per_step = std::hypot(way.x, way.y) / std::max({std::abs(way.x), std::abs(way.y), 1});
  double stretch_mm = 0, longest_mm = 0;
  walk(cells, a_mm, b_mm, [&](const cv::Point& cell, double t) {
    const double w = w_a + t * (w_b - w_a);
    stretch_mm = cells.contains(cell) && counts(cell, w) ? stretch_mm + cells_per_step * cells.size_mm(w) : 0;
    longest_mm = std::max(longest_mm, stretch_mm);
    return true;
  });
  return longest_mm;
}

class Groups {
 public:
  explicit Groups(size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0); }
  int root(int i) {
    while (parent_[static_cast<size_t>(i)] != i)
      i = parent_[static_cast<size_t>(i)] = parent_[static_cast<size_t>(parent_[static_cast<size_t>(i)])];
    return i;
  }
  void join(int a, int b) { parent_[static_cast<size_t>(root(a))] = root(b); }

 private:
  std::vector<int> parent_;
};

}  // namespace

void describe(Settings& settings, EdgeOptions& o) {
  settings.number("edge_cell_mm", o.cell_mm, {0.05, 10}, "resolution at which edges of the tissue are looked for");
  settings.number("edge_jump_mm", o.min_jump_mm, {0, 1000, true}, "the surface is cut where depth jumps by more");
  settings.number("edge_jump_deviations", o.jump_deviations, {0, 100},
                  "and by more than so many deviations of what both sides continue to");
  settings.number("edge_length_mm", o.min_edge_mm, {0, 1000}, "shorter edges are taken for noise");
  settings.number("edge_bridge_mm", o.max_bridge_mm, {0, 1000, true},
                  "a face spans no wider stretch in which nothing was measured");
  settings.number("piece_mm2", o.min_piece_mm2, {0, 1e6}, "smaller pieces of surface are dropped");
  settings.number("covered_mm", o.max_covered_mm, {0, 1000},
                  "widest stretch behind an instrument that is closed where both sides continue each other");
}

DepthEdges find_depth_edges(DepthCells cells, const EdgeOptions& options) {
  DepthEdges edges{std::move(cells), options, {}};
  edges.jump_w = cv::Mat1f(edges.cells.w.size(), 0.0f);
  cv::Mat1b mixed(edges.cells.w.size(), uchar{0});
  for (const Line& line : all_lines(edges.cells)) {
    const std::vector<Step> steps = steps_along(line, options);
    for (size_t k = 0; k < steps.size(); ++k)
      if (steps[k].score > 1 && is_sharpest(steps, k)) mark(line, steps[k], edges.jump_w, mixed);
  }
  drop_short_edges(edges.cells, options.min_edge_mm, edges.jump_w);
  edges.cells.w.setTo(std::numeric_limits<float>::quiet_NaN(), mixed & (edges.jump_w > 0));
  return edges;
}

void close_covered(DepthCells& cells, const EdgeOptions& options) {
  cv::Mat1f sum(cells.w.size(), 0.0f), weights(cells.w.size(), 0.0f);
  for (const Line& line : all_lines(cells)) {
    int last = -1, covered = 0;
    for (int i = 0; i < line.length; ++i) {
      if (!line.known(i)) {
        covered += cells.covered(line.at(i)) > 0;
        continue;
      }
      const int before = last, gap = i - last - 1, hidden = covered;
      last = i;
      covered = 0;
      if (before < 0 || gap == 0 || hidden * 2 < gap) continue;
      const int fitted = std::clamp(gap, kFitted, 60);
      const double place = 0.5 * (before + i);
      const Side left = continued(line, before - kGuard, -1, fitted, place);
      const Side right = continued(line, i + kGuard, 1, fitted, place);
      if (left.cells < kMinFitted || right.cells < kMinFitted) continue;
      const double w = std::max(0.5 * (left.w + right.w), 1e-6), gap_mm = gap * cells.size_mm(w);
      // Each side bends while it is not seen: by half the way at most.
      const double allowed = std::max(options.min_jump_mm, 0.5 * gap_mm) * w * w;
      if (gap_mm > options.max_covered_mm || std::abs(right.w - left.w) > allowed) continue;
      for (int k = before + 1; k < i; ++k) {
        const double t = static_cast<double>(k - before) / (gap + 1), blend = t * t * (3 - 2 * t), away = k - place;
        const double between = (1 - blend) * (left.w + left.slope * away) + blend * (right.w + right.slope * away);
        const auto weight = static_cast<float>(1.0 / (gap * gap));
        sum(line.at(k)) += static_cast<float>(between) * weight;
        weights(line.at(k)) += weight;
      }
    }
  }
  constexpr int kRounds = 20;  // the two directions, and neighbouring lines, settle with each other
  cells.closed = weights > 0;
  cv::Mat1f filled = sum / weights;
  filled.copyTo(cells.w, cells.closed);
  const cv::Mat1f deviation_of(cells.w.size(), static_cast<float>(cv::mean(cells.deviation, cells.deviation > 0)[0]));
  deviation_of.copyTo(cells.deviation, cells.closed);
  for (int round = 0; round < kRounds; ++round) {
    const cv::Mat1f before = cells.w.clone();
    for (int r = 1; r + 1 < cells.w.rows; ++r)
      for (int c = 1; c + 1 < cells.w.cols; ++c) {
        if (!cells.closed(r, c)) continue;
        float total = 0;
        int count = 0;
        for (const cv::Point& beside : {cv::Point(-1, 0), cv::Point(1, 0), cv::Point(0, -1), cv::Point(0, 1)})
          if (const float w = before(cv::Point(c, r) + beside); std::isfinite(w)) total += w, ++count;
        if (count > 0) cells.w(r, c) = 0.5f * (before(r, c) + total / static_cast<float>(count));
      }
  }
}

bool is_torn(const DepthEdges& edges, const Vec3& a_mm, const Vec3& b_mm) {
  const double apart_w = std::abs(1 / a_mm.z() - 1 / b_mm.z());
  bool crosses = false;
  walk(edges.cells, a_mm, b_mm, [&](const cv::Point& cell, double) {
    if (edges.cells.contains(cell)) {
      const double jump_w = static_cast<double>(edges.jump_w(cell));
      crosses = jump_w > 0 && apart_w > kParted * jump_w;
    }
    return !crosses;
  });
  if (crosses) return true;
  const double unmeasured_mm = longest_stretch_mm(
      edges.cells, a_mm, b_mm, [&](const cv::Point& cell, double) { return !edges.cells.is_known(cell); });
  return unmeasured_mm > edges.options.max_bridge_mm || shows_another_depth(edges, a_mm, b_mm);
}

bool shows_another_depth(const DepthEdges& edges, const Vec3& a_mm, const Vec3& b_mm) {
  const double length_mm = (a_mm - b_mm).norm();
  return longest_stretch_mm(edges.cells, a_mm, b_mm, [&](const cv::Point& cell, double w) {
           if (!edges.cells.is_known(cell)) return false;
           // A surface that bulges or dips between the two points is no other one.
           const double allowed_mm = std::max(edges.options.min_jump_mm, 0.3 * length_mm);
           const double off_w = std::abs(static_cast<double>(edges.cells.w(cell)) - w);
           const double noise_w = static_cast<double>(edges.cells.deviation(cell));
           return off_w > std::max(allowed_mm * w * w, edges.options.jump_deviations * noise_w);
         }) > kSeenThrough_mm;
}

cv::Mat1i label_pieces(const DepthEdges& edges) {
  const DepthCells& cells = edges.cells;
  const auto number = [&](const cv::Point& cell) { return cell.y * cells.w.cols + cell.x; };
  Groups groups(cells.w.total());
  for (const Line& line : all_lines(cells)) {
    int last = -1;
    float jump_w = 0;
    for (int i = 0; i < line.length; ++i) {
      const cv::Point cell = line.at(i);
      jump_w = std::max(jump_w, edges.jump_w(cell));
      if (!line.known(i)) continue;
      if (last >= 0) {
        const cv::Point before = line.at(last);
        const float w = cells.w(cell), apart_w = std::abs(w - cells.w(before));
        const float jump = std::max(jump_w, edges.jump_w(before));
        const bool parted = jump > 0 && apart_w > static_cast<float>(kParted) * jump;
        const double gap_mm = (i - last - 1) * cells.size_mm(static_cast<double>(w));
        if (!parted && gap_mm <= edges.options.max_bridge_mm) groups.join(number(cell), number(before));
      }
      last = i;
      jump_w = edges.jump_w(cell);
    }
  }
  cv::Mat1i labels(cells.w.size(), -1);
  std::vector<int> label_of(cells.w.total(), -1);
  int count = 0;
  for (int r = 0; r < labels.rows; ++r)
    for (int c = 0; c < labels.cols; ++c) {
      if (!cells.is_known({c, r})) continue;
      int& label = label_of[static_cast<size_t>(groups.root(number({c, r})))];
      if (label < 0) label = count++;
      labels(r, c) = label;
    }
  return labels;
}

}  // namespace palpate
