#include "palpate/stereo/grow.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <queue>

namespace palpate {
namespace {

constexpr int kLooks = 4;       // Gauss-Newton steps of a fit
constexpr int kTogether = 256;  // the best matches that hand on their planes at a time
constexpr float kMinCorrelation = 0.6f;
constexpr float kMinSeedCorrelation = 0.8f;
constexpr int kScale = 2;            // works on images so many times smaller
constexpr int kStep = 4;             // between cells, px of those images
constexpr float kMaxStep = 0.75f;    // px of those images from the prediction of a neighbour
constexpr float kSteepest = 0.8f;    // disparity gradient limit
constexpr float kMaxReturn = 0.5f;   // px of those images, left-right check
constexpr int kSmallestIsland = 15;  // cells

Level shrunk(const cv::Mat& grey, const cv::Mat& mask) {
  cv::Mat small = grey, small_mask;
  for (int scale = 1; scale < kScale; scale *= 2) cv::pyrDown(small, small);
  cv::resize(mask, small_mask, small.size(), 0, 0, cv::INTER_NEAREST);
  return make_level(small, small_mask);
}

// A plane that a neighbour hands on, and what the fit from there found.
struct Proposal {
  int index;
  DisparityPlane plane;
  WindowFit found = {};
  bool accepted = false;
};

class Grower {
 public:
  Grower(const PreparedPair& prepared, double min, double max)
      : min_(static_cast<float>(min / kScale)), max_(static_cast<float>(max / kScale)), wanted_(prepared.wanted) {
    tbb::parallel_invoke([&] { left_ = shrunk(prepared.left, prepared.left_mask); },
                         [&] { right_ = shrunk(prepared.right, prepared.right_mask); });
    grid_.columns = (left_.size.width + kStep - 1) / kStep;
    grid_.rows = (left_.size.height + kStep - 1) / kStep;
    grid_.cells.resize(static_cast<size_t>(grid_.columns * grid_.rows));
    proposed_.resize(grid_.cells.size());
  }

  CellGrid run(const Seeds& seeds) {
    for (const Seed& seed : seeds.matches)
      propose(cvRound(seed.left_px.x / (kStep * kScale)), cvRound(seed.left_px.y / (kStep * kScale)),
              {seed.disparity_px / kScale, 0, 0});
    try_proposals(kMinSeedCorrelation);
    while (!queue_.empty()) {
      for (int i = 0; i < kTogether && !queue_.empty(); ++i) {
        spread(queue_.top().second);
        queue_.pop();
      }
      try_proposals(kMinCorrelation);
    }
    check_from_the_right();
    drop_islands();
    return drawn_large();
  }

 private:
  static bool fit(const Level& from, const Level& to, cv::Point at, const DisparityPlane& predicted, int looks,
                  WindowFit& found) {
    Window window;
    return window.cut(from, at) && window.fit(to, predicted, kMaxStep, kSteepest, looks, found);
  }

  void propose(int column, int row, const DisparityPlane& plane) {
    if (!grid_.holds(column, row)) return;
    const int index = row * grid_.columns + column;
    const cv::Point at(column * kStep, row * kStep);
    if (grid_.at(column, row).matched || proposed_[static_cast<size_t>(index)] || !left_.holds(at) ||
        !wanted_.at<uchar>(row * kStep * kScale, column * kStep * kScale))
      return;
    proposed_[static_cast<size_t>(index)] = true;
    proposals_.push_back({index, plane});
  }

  void spread(int index) {
    const int column = index % grid_.columns, row = index / grid_.columns;
    const DisparityPlane from = grid_.at(column, row).plane;
    for (const auto& [i, j] : {std::pair{-1, 0}, std::pair{1, 0}, std::pair{0, -1}, std::pair{0, 1}}) {
      const float shift = kStep * (static_cast<float>(i) * from.dx + static_cast<float>(j) * from.dy);
      propose(column + i, row + j, {from.d + shift, from.dx, from.dy});
    }
  }

  // Fits side by side, taken over in the order of the proposals, so that the answer does not depend on threads.
  void try_proposals(float min_correlation) {
    tbb::parallel_for(
        tbb::blocked_range<size_t>(0, proposals_.size(), 16), [&](const tbb::blocked_range<size_t>& some) {
          for (size_t i = some.begin(); i != some.end(); ++i) {
            Proposal& proposal = proposals_[i];
            const cv::Point at(proposal.index % grid_.columns * kStep, proposal.index / grid_.columns * kStep);
            WindowFit& found = proposal.found;
            proposal.accepted = fit(left_, right_, at, proposal.plane, kLooks, found) &&
                                found.correlation >= min_correlation && found.plane.d >= min_ && found.plane.d <= max_;
          }
        });
    for (const Proposal& proposal : proposals_) {
      proposed_[static_cast<size_t>(proposal.index)] = false;
      if (!proposal.accepted) continue;
      grid_.cells[static_cast<size_t>(proposal.index)] = {proposal.found.plane, proposal.found.correlation,
                                                          proposal.found.information, true};
      queue_.emplace(proposal.found.correlation, proposal.index);
    }
    proposals_.clear();
  }

  void check_from_the_right() {
    std::vector<char> confirmed(grid_.cells.size(), 0);
    tbb::parallel_for(0, grid_.rows, [&](int row) {
      for (int column = 0; column < grid_.columns; ++column)
        if (grid_.at(column, row).matched)
          confirmed[static_cast<size_t>(row * grid_.columns + column)] = found_again(column, row);
    });
    for (size_t i = 0; i < confirmed.size(); ++i) grid_.cells[i].matched = confirmed[i];
  }

  // Seen from the right pixel u' = u - d(u), the plane reads d' = d0 + dx (u - u0), u = (u' + ...) / (1 - dx).
  bool found_again(int column, int row) const {
    const DisparityPlane& plane = grid_.at(column, row).plane;
    const float x = static_cast<float>(column * kStep) - plane.d;
    const cv::Point at(cvRound(x), row * kStep);
    const float stretch = 1 / (1 - plane.dx);
    const float off = (static_cast<float>(at.x) - x) * stretch;
    const DisparityPlane expected{-(plane.d + plane.dx * off), -plane.dx * stretch, -plane.dy * stretch};
    WindowFit seen;
    return right_.holds(at) && fit(right_, left_, at, expected, 1, seen) &&
           std::abs(seen.plane.d - expected.d) < kMaxReturn;
  }

  // The cells of the full size, each with the plane of the nearest cell found.
  CellGrid drawn_large() const {
    CellGrid large;
    large.columns = (wanted_.cols + CellGrid::kStep_px - 1) / CellGrid::kStep_px;
    large.rows = (wanted_.rows + CellGrid::kStep_px - 1) / CellGrid::kStep_px;
    large.cells.resize(static_cast<size_t>(large.columns * large.rows));
    constexpr int ratio = kStep * kScale / CellGrid::kStep_px;
    for (int row = 0; row < large.rows; ++row)
      for (int column = 0; column < large.columns; ++column) {
        const Cell* nearest = nullptr;
        int min = 2 * ratio * ratio + 1;
        for (int j = 0; j < 2; ++j)
          for (int i = 0; i < 2; ++i) {
            const int c = column / ratio + i, r = row / ratio + j;
            if (!grid_.holds(c, r) || !grid_.at(c, r).matched) continue;
            const int x = column - c * ratio, y = row - r * ratio, distance = x * x + y * y;
            if (distance > min || (nearest && distance == min && grid_.at(c, r).correlation < nearest->correlation))
              continue;
            min = distance;
            nearest = &grid_.at(c, r);
          }
        if (!nearest) continue;
        const int index = static_cast<int>(nearest - grid_.cells.data());
        const float u = static_cast<float>((column - index % grid_.columns * ratio) * CellGrid::kStep_px);
        const float v = static_cast<float>((row - index / grid_.columns * ratio) * CellGrid::kStep_px);
        Cell& cell = large.at(column, row);
        cell = *nearest;
        cell.plane.d = kScale * nearest->plane.d + nearest->plane.dx * u + nearest->plane.dy * v;
      }
    return large;
  }

  void drop_islands() {
    std::vector<char> visited(grid_.cells.size(), 0);
    for (int start = 0; start < static_cast<int>(grid_.cells.size()); ++start) {
      if (visited[static_cast<size_t>(start)] || !grid_.cells[static_cast<size_t>(start)].matched) continue;
      std::vector<int> island{start};
      visited[static_cast<size_t>(start)] = 1;
      for (size_t k = 0; k < island.size(); ++k) visit_neighbours(island[k], visited, island);
      if (island.size() >= kSmallestIsland) continue;
      for (const int index : island) grid_.cells[static_cast<size_t>(index)].matched = false;
    }
  }

  void visit_neighbours(int index, std::vector<char>& visited, std::vector<int>& island) const {
    const int column = index % grid_.columns, row = index / grid_.columns;
    const float d = grid_.at(column, row).plane.d;
    for (const auto& [i, j] : {std::pair{-1, 0}, std::pair{1, 0}, std::pair{0, -1}, std::pair{0, 1}}) {
      const int c = column + i, r = row + j;
      if (!grid_.holds(c, r)) continue;
      const size_t next = static_cast<size_t>(r * grid_.columns + c);
      if (visited[next] || !grid_.cells[next].matched) continue;
      if (std::abs(grid_.cells[next].plane.d - d) > 2 * kSteepest * kStep) continue;
      visited[next] = 1;
      island.push_back(static_cast<int>(next));
    }
  }

  Level left_;
  Level right_;
  float min_;
  float max_;
  cv::Mat wanted_;
  CellGrid grid_;
  std::vector<Proposal> proposals_;
  std::vector<char> proposed_;  // cells among them
  std::priority_queue<std::pair<float, int>> queue_;
};

}  // namespace

CellGrid grow(const PreparedPair& prepared, const Seeds& seeds, double min_disparity_px, double max_disparity_px) {
  return Grower(prepared, min_disparity_px, max_disparity_px).run(seeds);
}

}  // namespace palpate
