#include "palpate/instrument/instrument_tracker.h"

#include <fmt/format.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "palpate/core/errors.h"
#include "palpate/instrument/find_tip.h"
#include "palpate/instrument/instrument_finder.h"
#include "palpate/instrument/still_parts.h"
#include "palpate/instrument/tip_tracker.h"
#include "palpate/instrument/way_choice.h"

namespace palpate {

namespace {

constexpr int kKeepsItsEntryAfter = 10;  // frames seen
constexpr int kBeforeASecondIsBelieved = 3;
constexpr double kSameDirection = 0.5;  // cosine between shafts of one instrument that left and came back
constexpr double kFarthest_px = 120;    // between where a tip is expected and where it is, if its shaft has turned
constexpr double kTurnedShaft = 0.7;    // cosine
constexpr double kNotSeen_px = 1000;    // what it costs that an camera does not show an instrument
constexpr double kNotOneTip_px = 600;   // and that the cameras show what cannot be one tip
constexpr double kNever_px = 1e6;
constexpr double kTouchingFraction = 0.5;  // of the expected end of the shaft that lies on another's mask

/// One camera in one frame.
struct SeenByCamera {
  FoundInstruments found;
  std::vector<ImageInstrument> instruments;
  std::array<int, kMaxInstruments> of_tracker;  ///< which of `instruments`, or -1
};

/// An outline as it is; around a point, a small square.
std::vector<cv::Point2d> around(const std::vector<cv::Point2d>& example_px) {
  if (example_px.size() >= 3) return example_px;
  constexpr double kAround_px = 8;
  const cv::Point2d p = example_px.front(), x(kAround_px, 0), y(0, kAround_px);
  return {p - x - y, p + x - y, p + x + y, p - x + y};
}

/// Which instrument of each camera, or -1.
using Assigned = std::array<int, 2>;

/// Between where a tip is expected and where one is.
double away_from(const ImageTip& expected, const ImageTip& tip) {
  const double distance_px = cv::norm(tip.tip_px - expected.tip_px), cosine = tip.axis.dot(expected.axis);
  if (distance_px > kFarthest_px && cosine < kTurnedShaft) return kNever_px;
  return distance_px + kFarthest_px * (1 - cosine);
}

/// How badly the tips of two cameras go together, though they can be one.
double misfit(const ImageTip& left, const ImageTip& right) {
  const double rows = std::abs(left.tip_px.y - right.tip_px.y) / (4 + 0.15 * left.width_px);
  return rows + 4 * (1 - left.axis.dot(right.axis)) + std::abs(std::log(left.width_px / right.width_px));
}

/// Share of the end of a shaft, where it is expected, that lies on a mask whose corner is at `origin`.
double fraction_on(const cv::Mat& mask, const cv::Point& origin, const ImageTip& expected) {
  int on = 0;
  constexpr int kSteps = 8;
  for (int i = 1; i <= kSteps; ++i) {
    const cv::Point at(expected.tip_px - 0.2 * i * expected.width_px * expected.axis - cv::Point2d(origin));
    on += cv::Rect({}, mask.size()).contains(at) && mask.at<uchar>(at) != 0;
  }
  return static_cast<double>(on) / kSteps;
}

}  // namespace

struct InstrumentTracker::State {
  Rectification rectification;
  cv::Mat example;  ///< 255 in the rectified left image of the example's frame; may be empty
  int example_frame = 0;
  RowOffset rows;
  std::vector<InstrumentFinder> finders;  ///< one for each camera
  WayChoice way;
  std::vector<TipTrack> tracks;
  std::function<std::optional<TipTrack::Row>()> live_tip;
  double time_offset_s = 0;
  std::vector<TipTracker> trackers;
  std::array<int, kMaxInstruments> frames_seen{};
  int second_seen = 0;  ///< frames, one after the other, in which a further instrument asked for an entry
  std::optional<double> last_time_s;

  std::optional<TipTrack::Row> row_of(const TipTrack& track, const RectifiedPair& pair) const;
  std::array<FoundInstruments, 2> find(const RectifiedPair& pair);
  std::optional<ImageTip> expected(size_t tracker, size_t camera, double seconds) const;
  void follow_visible(std::array<SeenByCamera, 2>& seen, double seconds) const;
  std::array<bool, kMaxInstruments> part_touching(std::array<SeenByCamera, 2>& seen, double seconds) const;
  void begin_further(std::array<SeenByCamera, 2>& seen);
  std::optional<size_t> entry_for(const ImageTip& left, const SeenByCamera& seen_left) const;
  CameraView view(const cv::Mat& bgr, const SeenByCamera& seen, size_t tracker, size_t camera, double seconds) const;
  bool keeps_its_entry(size_t tracker) const {
    return trackers[tracker].marked() || frames_seen[tracker] >= kKeepsItsEntryAfter;
  }
};

std::optional<TipTrack::Row> InstrumentTracker::State::row_of(const TipTrack& track, const RectifiedPair& pair) const {
  return row_of_frame(track, pair.index, pair.time_s, time_offset_s);
}

std::array<FoundInstruments, 2> InstrumentTracker::State::find(const RectifiedPair& pair) {
  std::array<FoundInstruments, 2> found;
  std::vector<cv::Mat> images;
  std::vector<InstrumentFinder*> looking;
  if (!pair.left.empty()) images.push_back(pair.left), looking.push_back(&finders[0]);
  if (!pair.right.empty()) images.push_back(pair.right), looking.push_back(&finders[1]);
  const std::vector<FoundInstruments> shown = find_instruments_in(images, looking, way);
  for (size_t i = 0; i < shown.size(); ++i) found[looking[i] == &finders[0] ? 0 : 1] = shown[i];
  return found;
}

std::optional<ImageTip> InstrumentTracker::State::expected(size_t tracker, size_t camera, double seconds) const {
  std::optional<ImageTip> tip = trackers[tracker].last_tip(camera);
  if (tip && trackers[tracker].visible()) tip->tip_px = trackers[tracker].expected_px(camera, seconds);
  return tip;
}

/// Gives every visible instrument one of each camera's, all at once: near to where it is expected, and the same one in
/// both cameras.
void InstrumentTracker::State::follow_visible(std::array<SeenByCamera, 2>& seen, double seconds) const {
  std::array<Assigned, kMaxInstruments> best;
  std::array<std::array<std::vector<double>, 2>, kMaxInstruments> away_px;  // by tracker, camera, instrument
  for (size_t t = 0; t < kMaxInstruments; ++t)
    for (size_t camera = 0; camera < 2; ++camera) {
      const auto tip = trackers[t].visible() ? expected(t, camera, seconds) : std::nullopt;
      for (const ImageInstrument& candidate : seen[camera].instruments)
        away_px[t][camera].push_back(tip ? away_from(*tip, candidate.tip) : kNever_px);
    }
  const auto cost_px = [&](size_t t, const Assigned& given) {
    double cost = 0;
    for (size_t camera = 0; camera < 2; ++camera)
      cost += given[camera] < 0 ? kNotSeen_px : away_px[t][camera][static_cast<size_t>(given[camera])];
    if (given[0] >= 0 && given[1] >= 0 &&
        !can_be_one_tip(seen[0].instruments[static_cast<size_t>(given[0])].tip,
                        seen[1].instruments[static_cast<size_t>(given[1])].tip))
      cost += kNotOneTip_px;
    return cost;
  };
  const auto choices = [&](size_t camera) { return static_cast<int>(seen[camera].instruments.size()); };
  const auto differ = [](int a, int b) { return a < 0 || a != b; };
  double min = std::numeric_limits<double>::max();
  static_assert(kMaxInstruments == 2);
  Assigned first, second;
  for (first[0] = -1; first[0] < choices(0); ++first[0])
    for (first[1] = -1; first[1] < choices(1); ++first[1])
      for (second[0] = -1; second[0] < choices(0); ++second[0])
        for (second[1] = -1; second[1] < choices(1); ++second[1]) {
          if (!differ(first[0], second[0]) || !differ(first[1], second[1])) continue;
          const double cost = cost_px(0, first) + cost_px(1, second);
          if (cost < min) min = cost, best = {first, second};
        }
  for (size_t t = 0; t < kMaxInstruments; ++t)
    for (size_t camera = 0; camera < 2; ++camera) seen[camera].of_tracker[t] = best[t][camera];
}

/// Which instruments touch another one in either image, so that the outline of their common mask is neither's. They
/// lose what they were given there.
std::array<bool, kMaxInstruments> InstrumentTracker::State::part_touching(std::array<SeenByCamera, 2>& seen,
                                                                          double seconds) const {
  std::array<bool, kMaxInstruments> touching{};
  if (!std::all_of(trackers.begin(), trackers.end(), [](const TipTracker& t) { return t.visible(); })) return touching;
  for (size_t camera = 0; camera < 2; ++camera) {
    std::array<int, kMaxInstruments>& given = seen[camera].of_tracker;
    std::array<bool, kMaxInstruments> here{};
    for (size_t t = 0; t < kMaxInstruments; ++t) {
      if (given[t] >= 0) continue;
      const auto tip = expected(t, camera, seconds);
      if (!tip || fraction_on(seen[camera].found.mask, {0, 0}, *tip) < kTouchingFraction) continue;
      here[t] = true;
      for (size_t other = 0; other < kMaxInstruments; ++other) {
        if (given[other] < 0) continue;
        const ImageInstrument& its = seen[camera].instruments[static_cast<size_t>(given[other])];
        if (fraction_on(its.mask, its.box.tl(), *tip) >= kTouchingFraction) here[other] = true;
      }
    }
    for (size_t t = 0; t < kMaxInstruments; ++t) {
      if (!here[t]) continue;
      given[t] = -1;
      touching[t] = true;
    }
  }
  return touching;
}

/// The entry for an instrument that comes into view: its own if it was here before, else a free one.
std::optional<size_t> InstrumentTracker::State::entry_for(const ImageTip& left, const SeenByCamera& seen_left) const {
  std::optional<size_t> own, free, any;
  double best = kSameDirection, best_of_any = -2;
  for (size_t t = 0; t < kMaxInstruments; ++t) {
    if (trackers[t].visible() || seen_left.of_tracker[t] >= 0) continue;
    if (!keeps_its_entry(t)) {
      if (!free) free = t;
      continue;
    }
    const double cosine = left.axis.dot(trackers[t].last_tip(0)->axis);
    if (cosine > best) best = cosine, own = t;
    if (cosine > best_of_any) best_of_any = cosine, any = t;
  }
  return own ? own : free ? free : any;
}

/// Gives what no instrument was given to those that are not visible.
void InstrumentTracker::State::begin_further(std::array<SeenByCamera, 2>& seen) {
  const auto is_given = [](const SeenByCamera& camera, size_t i) {
    return std::find(camera.of_tracker.begin(), camera.of_tracker.end(), static_cast<int>(i)) !=
           camera.of_tracker.end();
  };
  bool beside_another = std::any_of(trackers.begin(), trackers.end(), [](const TipTracker& t) { return t.visible(); });
  bool asks = false;
  for (size_t l = 0; l < seen[0].instruments.size(); ++l) {
    if (is_given(seen[0], l) || rests(seen[0].instruments[l], seen[0].found.mask.size(), seen[0].found.still)) continue;
    const ImageTip& left = seen[0].instruments[l].tip;
    std::optional<size_t> partner;
    double min = std::numeric_limits<double>::max();
    for (size_t r = 0; r < seen[1].instruments.size(); ++r) {
      const ImageTip& right = seen[1].instruments[r].tip;
      if (is_given(seen[1], r) || !can_be_one_tip(left, right) || misfit(left, right) >= min) continue;
      min = misfit(left, right), partner = r;
    }
    if (!partner) continue;
    const auto entry = entry_for(left, seen[0]);
    if (!entry) return;
    if (beside_another && !keeps_its_entry(*entry)) {
      asks = true;
      if (second_seen + 1 < kBeforeASecondIsBelieved) continue;
    }
    if (!keeps_its_entry(*entry)) {
      trackers[*entry] = TipTracker(rectification, rows);
      frames_seen[*entry] = 0;
    }
    seen[0].of_tracker[*entry] = static_cast<int>(l);
    seen[1].of_tracker[*entry] = static_cast<int>(*partner);
    beside_another = true;
  }
  second_seen = asks ? second_seen + 1 : 0;
}

CameraView InstrumentTracker::State::view(const cv::Mat& bgr, const SeenByCamera& seen, size_t tracker, size_t camera,
                                          double seconds) const {
  CameraView result;
  result.mask = seen.found.mask;
  for (size_t other = 0; other < kMaxInstruments; ++other) {
    if (other == tracker || seen.of_tracker[other] < 0) continue;
    const ImageInstrument& its = seen.instruments[static_cast<size_t>(seen.of_tracker[other])];
    result.mask = result.mask.clone();
    result.mask(its.box).setTo(0, its.mask);
  }
  if (seen.of_tracker[tracker] >= 0) result.tip = seen.instruments[static_cast<size_t>(seen.of_tracker[tracker])].tip;
  const std::optional<ImageTip> look_at = result.tip ? result.tip : expected(tracker, camera, seconds);
  if (look_at) result.layers = finders[camera].layers(bgr, region_around(*look_at), seen.found);
  return result;
}

void describe(Settings& settings, InstrumentOptions& options) {
  settings.path("segmentation", options.segmentation,
                "how instruments are found in the images: learned (the project's network), colour, none (they are not "
                "looked for), or a network of yours as model.onnx (docs/instruments.md)");
  settings.integer("class", options.network.instrument_class, {0, 1000},
                   "the instrument's channel, from 0, where a network has several");
  settings.vector3("mean_rgb", options.network.mean_rgb, {-255, 255},
                   "subtracted from the RGB, 0 to 1, that a network of yours is given");
  settings.vector3("deviation_rgb", options.network.deviation_rgb, {0, 255, true}, "by which what is left is divided");
  settings.points("example_px", options.example_px,
                  "an outline of the shaft (or one point on it, [x, y]) in the left image as recorded, at at_frame: "
                  "from there on its colours count "
                  "too");
  settings.integer("at_frame", options.at_frame, {0, 1e9}, "the frame of example_px");
  settings.path(
      "track", options.track,
      "tip.csv (frame,time_s,x_mm,y_mm,z_mm[,closed]) instead of the images; or openigtlink:HOST:PORT/DEVICE, "
      "a live TRANSFORM (docs/streams.md)");
  settings.path("track_2", options.track_2, "the same for a second instrument, with track");
  settings.group("camera_from_robot", "how the axes of the tracks lie; palpate check finds it",
                 [&options](Settings& group) { describe(group, options.camera_from_robot); });
  settings.number(
      "time_offset_s", options.time_offset_s, {},
      "time of the tracks minus time of the video; other than 0, or where a track has no column frame, rows are "
      "found by time, not by frame");
  settings.after_reading([&options] {
    // A source is no file, and does not lie in the scene file's folder.
    if (const std::string source = options.track.parent_path().filename().string(); source.starts_with("openigtlink:"))
      options.track = source + "/" + options.track.filename().string();
    if (options.has_live_track() && !options.track_2.empty())
      throw BadInput("instrument.track is live, expected no instrument.track_2 beside it");
    if (!options.track_2.empty() && options.track.empty())
      throw BadInput("instrument.track_2 is given without instrument.track, expected both or only track");
    if (options.segmentation.extension() == ".onnx") return;
    const std::string word = options.segmentation.filename().string();
    if (word != "learned" && word != "colour" && word != "none")
      throw BadInput(fmt::format(
          "instrument.segmentation is '{}', expected learned, colour, none or a network as model.onnx", word));
    options.segmentation = word;
  });
}

namespace {

/// A robot's clock since 1970 finds no row for any frame.
void require_clock_of_video(const TipTrack& track, const std::filesystem::path& file, double video_s, double offset_s) {
  constexpr double kLongestVideo_s = 86400;
  const double begins_s = track.rows.begin()->second.time_s;
  if (track.has_frames || std::abs(begins_s - offset_s - video_s) < kLongestVideo_s) return;
  throw BadInput(fmt::format(
      "{}: the track has no column frame and its time begins at {:.3f} s, the video's is {:.3f} s; expected "
      "instrument.time_offset_s, the track's time minus the video's, which palpate check finds",
      file.string(), begins_s, video_s));
}

}  // namespace

InstrumentTracker::InstrumentTracker(const InstrumentOptions& options, const Rectification& rectification,
                                     const RectifiedPair& static_frame, const cv::Mat& organ_mask)
    : state_(std::make_unique<State>()) {
  state_->rectification = rectification;
  if (!options.example_px.empty()) state_->example = rectified_polygon_mask(rectification, around(options.example_px));
  state_->example_frame = options.at_frame;
  state_->live_tip = options.live_tip;
  if (options.has_live_track() && !options.live_tip)
    throw BadInput("instrument.track is live, expected a run that streams (palpate estimate --realtime)");
  for (const std::filesystem::path& track : {options.track, options.track_2})
    if (!track.empty() && !options.has_live_track()) {
      const TipTrack read = read_tip_track(track);
      require_clock_of_video(read, track, static_frame.time_s, options.time_offset_s);
      state_->tracks.push_back(in_camera(read, options.camera_from_robot));
    }
  state_->time_offset_s = options.time_offset_s;
  std::array<std::optional<InstrumentFinder>, 2> finders;
  tbb::parallel_invoke([&] { finders[0].emplace(options, static_frame.left, organ_mask); },
                       [&] { finders[1].emplace(options, static_frame.right, organ_mask); },
                       [&] { state_->rows = measure_row_offset(static_frame.left, static_frame.right); });
  for (auto& finder : finders) state_->finders.push_back(std::move(*finder));
  state_->trackers.assign(kMaxInstruments, TipTracker(rectification, state_->rows));
}

InstrumentTracker::~InstrumentTracker() = default;
InstrumentTracker::InstrumentTracker(InstrumentTracker&&) noexcept = default;

InstrumentObservations InstrumentTracker::update(const RectifiedPair& pair) {
  State& s = *state_;
  InstrumentObservations observations;
  observations.tips.resize(kMaxInstruments);
  const std::array<const cv::Mat*, 2> images = {&pair.left, &pair.right};
  if (!s.example.empty() && pair.index == s.example_frame && !pair.left.empty()) {
    const ExampleColours colours = s.finders[0].learn(pair.left, s.example);
    for (InstrumentFinder& finder : s.finders) finder.use(colours);
  }
  s.way.keep(std::any_of(s.trackers.begin(), s.trackers.end(), [](const TipTracker& t) { return t.marked(); }));
  std::array<FoundInstruments, 2> found = s.find(pair);
  std::array<SeenByCamera, 2> seen;
  const auto see = [&](size_t camera) {
    seen[camera].of_tracker.fill(-1);
    seen[camera].found = found[camera];
    if (!found[camera].mask.empty())
      seen[camera].instruments = find_instruments(found[camera].mask, s.finders[camera].picture_area());
  };
  tbb::parallel_invoke([&] { see(0); }, [&] { see(1); });
  observations.left_mask = seen[0].found.mask;
  observations.right_mask = seen[1].found.mask;
  for (size_t t = 0; t < s.tracks.size(); ++t) observations.tips[t] = s.trackers[t].update(s.row_of(s.tracks[t], pair));
  if (s.live_tip) observations.tips[0] = s.trackers[0].update(s.live_tip());
  if (!s.tracks.empty() || s.live_tip) return observations;

  const double seconds = s.last_time_s ? std::max(pair.time_s - *s.last_time_s, 1e-3) : 0.04;
  s.last_time_s = pair.time_s;
  s.follow_visible(seen, seconds);
  const auto touching = s.part_touching(seen, seconds);
  s.begin_further(seen);
  for (size_t t = 0; t < kMaxInstruments; ++t) {
    TipTracker& tracker = s.trackers[t];
    if (!tracker.visible() && seen[0].of_tracker[t] < 0) continue;
    std::array<CameraView, 2> views;
    const auto view = [&](size_t camera) { views[camera] = s.view(*images[camera], seen[camera], t, camera, seconds); };
    tbb::parallel_invoke([&] { view(0); }, [&] { view(1); });
    observations.tips[t] = tracker.update(views[0], views[1], pair.index, seconds, touching[t]);
    observations.tips[t].in_image = {views[0].tip, views[1].tip};
    if (tracker.visible()) ++s.frames_seen[t];
    if (tracker.visible() && tracker.eyes_out_of_step()) observations.eyes_out_of_step = true;
  }
  return observations;
}

void InstrumentTracker::mark(size_t instrument) {
  state_->trackers.at(instrument).mark();
}

void InstrumentTracker::unmark(size_t instrument) {
  state_->trackers.at(instrument).unmark();
}

}  // namespace palpate
