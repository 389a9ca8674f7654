#include "palpate/instrument/way_choice.h"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "palpate/instrument/find_tip.h"
#include "palpate/instrument/tip_tracker.h"

namespace palpate {
namespace {

constexpr double kAgreementRate = 0.5;  // by which one comparison changes what is known of it
constexpr double kAgreed = 0.2;         // overlap below which the colours show something else

bool any(const cv::Mat& mask) {
  return !mask.empty() && cv::countNonZero(mask) > 0;
}

/// Whether all cameras show what can be the same instrument.
bool all_see_one(const std::vector<std::vector<ImageInstrument>>& by_camera) {
  if (by_camera.size() < 2) return !by_camera.empty() && !by_camera[0].empty();
  for (const ImageInstrument& left : by_camera[0])
    for (const ImageInstrument& right : by_camera[1])
      if (can_be_one_tip(left.tip, right.tip)) return true;
  return false;
}

double overlap_of(const cv::Mat& a, const cv::Mat& b) {
  return static_cast<double>(cv::countNonZero(a & b)) / std::max(1, cv::countNonZero(a | b));
}

}  // namespace

bool WayChoice::suffices(const std::vector<FoundInstruments>& found) {
  ++frames_alone_;
  const bool sees_all = std::all_of(found.begin(), found.end(), [](const FoundInstruments& f) { return any(f.mask); });
  const bool missing = sees_any_ && !sees_all;
  sees_any_ = sees_all;
  return !missing;
}

void WayChoice::compare(const std::vector<BothWays>& cameras, const std::vector<cv::Mat>& picture_areas) {
  frames_alone_ = 0;
  double overlap = 0;
  int compared = 0;
  std::vector<std::vector<ImageInstrument>> in_colours, in_network;
  for (size_t i = 0; i < cameras.size(); ++i) {
    const cv::Mat &colours = cameras[i].by_colours.mask, &network = cameras[i].by_network.mask;
    in_colours.push_back(find_instruments(colours, picture_areas[i]));
    in_network.push_back(find_instruments(network, picture_areas[i]));
    if (!any(colours) || !any(network)) continue;
    ++compared;
    overlap += overlap_of(colours, network);
  }
  if (compared > 0) {
    overlap /= compared;
    agreement_ = known_ ? (1 - kAgreementRate) * agreement_ + kAgreementRate * overlap : overlap;
    known_ = true;
  }
  const bool with_colours = all_see_one(in_colours), with_network = all_see_one(in_network);
  sees_any_ = with_colours || with_network;
  if (is_kept_ && (by_colours_ ? with_colours : with_network)) return;
  if (with_colours != with_network)
    by_colours_ = with_colours;
  else if (with_colours)
    by_colours_ = agreement_ > kAgreed;
}

std::vector<FoundInstruments> find_instruments_in(const std::vector<cv::Mat>& bgr,
                                                  const std::vector<InstrumentFinder*>& finders, WayChoice& way) {
  std::vector<FoundInstruments> found(bgr.size());
  const auto each = [&bgr](const auto& look) { tbb::parallel_for(size_t{0}, bgr.size(), look); };
  if (finders.empty() || !finders.front()->has_both_ways()) {
    each([&](size_t i) { found[i] = finders[i]->find(bgr[i]); });
    return found;
  }
  std::vector<BothWays> both(bgr.size());
  const auto by_colours = [&](size_t i) { both[i].by_colours = finders[i]->find_by_colours(bgr[i]); };
  const auto by_network = [&](size_t i) { both[i].by_network = finders[i]->find_by_network(bgr[i]); };
  const auto chosen = [&](size_t i) { return way.by_colours() ? both[i].by_colours : both[i].by_network; };
  const bool one_first = !way.compares(), colours_first = way.by_colours();
  if (one_first) {
    each([&](size_t i) {
      colours_first ? by_colours(i) : by_network(i);
      found[i] = chosen(i);
    });
    if (way.suffices(found)) return found;
  }
  each([&](size_t i) {
    if (!one_first || !colours_first) by_colours(i);
    if (!one_first || colours_first) by_network(i);
  });
  std::vector<cv::Mat> areas;
  for (const InstrumentFinder* finder : finders) areas.push_back(finder->picture_area());
  way.compare(both, areas);
  for (size_t i = 0; i < bgr.size(); ++i) found[i] = chosen(i);
  return found;
}

}  // namespace palpate
