#include "palpate/stereo/recording.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "palpate/core/errors.h"
#include "palpate/stereo/frame_source.h"
#include "palpate/stereo/interlacing.h"
#include "palpate/stereo/live_stereo.h"
#include "palpate/stereo/quiet_opencv.h"
#include "palpate/stereo/stamp_pairing.h"

namespace palpate {
namespace {

constexpr double kFallbackFps = 25;

void check_options(const RecordingOptions& options) {
  const bool two = !options.left.empty() && !options.right.empty();
  const bool any = !options.left.empty() || !options.right.empty();
  if (any && !options.stereo.empty())
    throw BadInput("recording: left/right and stereo are both given, expected either left and right or stereo");
  if (any && !two)
    throw BadInput(
        fmt::format("recording.{} is missing, expected both left and right", options.left.empty() ? "left" : "right"));
  if (!any && options.stereo.empty()) throw BadInput("recording: expected left and right, or stereo with its layout");
  std::error_code ignored;
  if (two && (options.left == options.right || std::filesystem::equivalent(options.left, options.right, ignored)))
    throw BadInput(fmt::format(
        "recording.left and recording.right are the same, {}, expected one for each camera (or stereo with its layout)",
        options.left.string()));
  if (!options.crop_px.empty() || options.crop_px == cv::Rect2d()) return;
  throw BadInput("recording.crop has no area, expected [x, y, width, height] in pixels of the calibrated images");
}

cv::Size camera_size_of(const RecordingOptions& options, cv::Size both) {
  const bool beside = options.layout == StereoLayout::side_by_side;
  const int length = beside ? both.width : both.height;
  if (length % 2 != 0)
    throw BadInput(fmt::format("recording.stereo: {} is {}x{} px, expected an even {} for layout {}",
                               options.stereo.string(), both.width, both.height, beside ? "width" : "height",
                               beside ? "side-by-side" : "top-bottom"));
  return beside ? cv::Size(both.width / 2, both.height) : cv::Size(both.width, both.height / 2);
}

}  // namespace

void describe(Settings& settings, RecordingOptions& options) {
  settings.path(
      "left", options.left,
      "video of the left camera: file or image pattern (left_%04d.png); live: device (0, /dev/video0), GStreamer "
      "pipeline (a ! b), rtsp:// address");
  settings.path("right", options.right, "video of the right camera");
  settings.path("stereo", options.stereo, "one video that holds both cameras, instead of left and right");
  settings.choice<StereoLayout>(
      "layout", options.layout,
      {{"side-by-side", StereoLayout::side_by_side}, {"top-bottom", StereoLayout::top_bottom}},
      "where the cameras stand in the stereo video; the left one is left or on top");
  settings.flag("swap", options.swap, "exchange left and right");
  settings.flag("deinterlace", options.deinterlace,
                "replace every second row by what its neighbours show, where they are of another moment");
  settings.path("calibration", options.calibration,
                "stereo calibration: OpenCV's (M1 D1 M2 D2 R T), Kalibr's, MATLAB's ..., or the left file of a ROS "
                "camera_info pair; docs/inputs.md names them all");
  settings.require("calibration");
  settings.choice<TranslationUnit>(
      "translation_unit", options.translation_unit,
      {{"detect", TranslationUnit::detect}, {"mm", TranslationUnit::mm}, {"m", TranslationUnit::m}},
      "unit of T in the calibration");
  settings.rectangle("crop", options.crop_px,
                     "part of the calibrated images that the recording shows, px of those images; of no size = all");
  settings.number("scale", options.scale, {0, 100, true, false},
                  "size of the recorded images over that of the part that they show");
  settings.number("fps", options.fps, {0, 1000, false, false}, "frames per second; 0 = as the video's time stamps say");
  settings.after_reading([&options] { check_options(options); });
}

StereoRig read_rig(const RecordingOptions& options) {
  const StereoRig rig = read_rig(options.calibration, options.translation_unit);
  if (options.crop_px.empty() && options.scale == 1) return rig;
  return cut_and_scaled(rig, options.crop_px, options.scale);
}

struct Recording::Sources {
  RecordingOptions options;
  std::unique_ptr<FrameSource> first;   // left, or both cameras in one image
  std::unique_ptr<FrameSource> second;  // right, or none
  cv::Size camera_size;
  double fps = 0;
  int frame_count = -1;
  int index = 0;
  StampPairing pairing;
  std::optional<FrameSource::Frame> right;  // read and not used yet
  size_t right_images_read = 0;
  double first_stamp_s = 0;
  std::vector<std::string> notes;
  int64_t taken_ns = 0;
  int dropped_before = 0;
  std::optional<int64_t> first_stamp_ns;
  std::unique_ptr<LiveStereo> live;  // instead of first and second

  StereoFrame split(const cv::Mat& both) const {
    StereoFrame frame;
    const cv::Point second_camera = options.layout == StereoLayout::side_by_side ? cv::Point(camera_size.width, 0)
                                                                                 : cv::Point(0, camera_size.height);
    frame.left = both(cv::Rect({0, 0}, camera_size)).clone();
    frame.right = both(cv::Rect(second_camera, camera_size)).clone();
    return frame;
  }

  /// As the options say what the cameras show.
  void arrange(StereoFrame& frame) const {
    if (options.deinterlace)
      for (cv::Mat* image : {&frame.left, &frame.right})
        if (!image->empty()) *image = deinterlaced(*image);
    if (options.swap) std::swap(frame.left, frame.right);
  }

  StereoFrame arranged(const LivePair& pair) const {
    const bool is_both = !options.stereo.empty() && !pair.left.empty();
    StereoFrame frame = is_both ? split(pair.left) : StereoFrame{0, 0, pair.left, pair.right};
    arrange(frame);
    return frame;
  }

  std::optional<StereoFrame> next_live() {
    const std::optional<LivePair> pair = live->next();
    if (!pair) return std::nullopt;
    StereoFrame frame = arranged(*pair);
    taken_ns = pair->taken_ns;
    if (!first_stamp_ns) first_stamp_ns = pair->stamp_ns;
    frame.index = index++;
    frame.time_s = static_cast<double>(pair->stamp_ns - *first_stamp_ns) * 1e-9;
    return frame;
  }

  /// Frames come without stamps, from an address.
  bool has_no_stamps() const { return first->stamps_s().empty() || (second && second->stamps_s().empty()); }

  void read_right() {
    right = second->next();
    right_images_read = right ? right_images_read + 1 : second->stamps_s().size();
  }
  /// Every image of the right source was read.
  bool right_has_ended() const { return right_images_read >= second->stamps_s().size(); }

  /// The right image of the moment of a left one; empty where there is none.
  cv::Mat right_image_at(double left_stamp_s) {
    const std::vector<double>&lefts = first->stamps_s(), &rights = second->stamps_s();
    const auto after = std::lower_bound(lefts.begin(), lefts.end(), left_stamp_s - kSameStamp_s);
    if (after == lefts.end()) return {};
    const int partner = pairing.right_of_left[static_cast<size_t>(after - lefts.begin())];
    if (partner < 0) return {};
    const double wanted_s = rights[static_cast<size_t>(partner)];
    // Not read ahead: a right image that does not open ends the recording only when it is its turn.
    while (!right_has_ended() && (!right || right->time_s < wanted_s - kSameStamp_s)) read_right();
    if (!right || std::abs(right->time_s - wanted_s) > kSameStamp_s) return {};
    const cv::Mat image = right->image;
    right.reset();
    return image;
  }

  /// Stamps of packets and of what is decoded from them differ by rounding only.
  static constexpr double kSameStamp_s = 1e-6;
};

namespace {

void check_alike(const RecordingOptions& options, const FrameSource& left, const FrameSource& right) {
  if (left.size() != right.size())
    throw BadInput(fmt::format("recording: {} is {}x{} px but {} is {}x{} px, expected the same size",
                               options.left.string(), left.size().width, left.size().height, options.right.string(),
                               right.size().width, right.size().height));
  const bool numbered = left.clock() == "numbers" && right.clock() == "numbers";
  const std::vector<double>&a = left.stamps_s(), &b = right.stamps_s();
  if (numbered && a.size() > 1 && a.size() == b.size() && a.front() != b.front())
    throw BadInput(fmt::format(
        "recording: the images of {} and of {} are as many, but begin with different numbers ({:.0f} and {:.0f}); "
        "expected images of the same moment to have the same number",
        options.left.string(), options.right.string(), a.front() * left.stated_fps(), b.front() * right.stated_fps()));
}

/// Files count from 0, and so do numbers of images, unless the first is 1; stamps may. Streams begin at any time.
bool counts_from_zero(const FrameSource& source) {
  if (source.clock() == "numbers") return std::lround(source.stamps_s().front() * source.stated_fps()) != 1;
  return source.clock() == "file" || source.clock() == "stamps";
}

/// Where steps vary, a stated rate is that of no frame.
double mean_fps(const FrameSource& source, const RecordingTiming& timing) {
  const std::vector<double>& stamps = source.stamps_s();
  const double stated = source.stated_fps();
  if (stamps.size() < 2) return stated;
  const double mean = static_cast<double>(stamps.size() - 1) / (stamps.back() - stamps.front());
  const bool is_usual = stated > 0 && std::abs(stated / timing.rate_Hz - 1) < 0.02;
  return is_usual && std::abs(mean / stated - 1) < 0.25 ? stated : mean;
}

std::vector<std::string> notes_of(const RecordingTiming& timing, double frames, double shift_s) {
  std::vector<std::string> notes;
  if (timing.gaps > 0)
    notes.push_back(
        fmt::format("the frame rate varies: {} of {:.0f} steps are longer than the usual {:.1f} ms, up to {:.1f} ms",
                    timing.gaps, frames - 1, 1000 / timing.rate_Hz, 1000 * timing.longest_gap_s));
  if (std::abs(shift_s) > 0)
    notes.push_back(fmt::format(
        "the clocks of left and right differ by {:+.3f} s: both are counted from their first frame", shift_s));
  if (timing.left_without_right + timing.right_without_left > 0)
    notes.push_back(fmt::format("{} left frames have no right one of their time, {} right frames no left one",
                                timing.left_without_right, timing.right_without_left));
  return notes;
}

/// Empty where the recording lies in files.
std::vector<LiveCameras::Camera> live_cameras(const RecordingOptions& options) {
  std::vector<LiveCameras::Camera> cameras, files;
  const auto sort = [&](const std::filesystem::path& name, const char* key) {
    (pipeline_of(name.string()).empty() ? files : cameras).push_back({name.string(), key});
  };
  if (options.stereo.empty()) {
    sort(options.left, "recording.left");
    sort(options.right, "recording.right");
  } else {
    sort(options.stereo, "recording.stereo");
  }
  if (!cameras.empty() && !files.empty())
    throw BadInput(fmt::format("{} is live and {} is not, expected both to be", cameras[0].key, files[0].key));
  return cameras;
}

}  // namespace

Recording::Recording(const RecordingOptions& options) : sources_(std::make_unique<Sources>()) {
  check_options(options);
  const QuietOpenCv quiet;
  Sources& s = *sources_;
  s.options = options;
  if (const std::vector<LiveCameras::Camera> cameras = live_cameras(options); !cameras.empty()) {
    s.live = std::make_unique<LiveStereo>(cameras);
    s.camera_size = options.stereo.empty() ? s.live->size() : camera_size_of(options, s.live->size());
    s.fps = options.fps > 0 ? options.fps : s.live->stated_fps();
    if (!(s.fps > 0)) s.fps = kFallbackFps;
    s.pairing.timing.is_live = true;
    s.pairing.timing.rate_Hz = s.fps;
    return;
  }
  if (options.stereo.empty()) {
    s.first = open_frame_source(options.left, "recording.left", options.fps);
    s.second = open_frame_source(options.right, "recording.right", options.fps);
    check_alike(options, *s.first, *s.second);
    s.camera_size = s.first->size();
  } else {
    s.first = open_frame_source(options.stereo, "recording.stereo", options.fps);
    s.camera_size = camera_size_of(options, s.first->size());
  }
  const std::vector<double>& stamps = s.first->stamps_s();
  if (!stamps.empty()) s.first_stamp_s = stamps.front();
  s.pairing.timing = timing_of(stamps);
  if (s.second && !s.has_no_stamps()) {
    const bool one_clock =
        s.first->clock() == s.second->clock() || (counts_from_zero(*s.first) && counts_from_zero(*s.second));
    s.pairing = pair_by_stamp(stamps, s.second->stamps_s(), one_clock);
    if (s.pairing.timing.left_without_right == static_cast<int>(stamps.size()))
      throw BadInput(
          fmt::format("recording: no frame of {} is of the time of one of {}, expected both to show the same "
                      "moments",
                      options.left.string(), options.right.string()));
    s.read_right();
  }
  const int held = static_cast<int>(stamps.size()), whole = s.first->frames_if_whole();
  s.frame_count = stamps.empty() ? -1 : std::max(held, whole);
  s.fps = options.fps > 0 ? options.fps : mean_fps(*s.first, s.pairing.timing);
  if (!(s.fps > 0)) s.fps = kFallbackFps;
  s.notes = notes_of(s.pairing.timing, held, s.pairing.right_shift_s);
  for (const FrameSource* source : {s.first.get(), s.second.get()})
    if (source && !source->note().empty() && (s.notes.empty() || s.notes.back() != source->note()))
      s.notes.push_back(source->note());
  if (s.first->is_interlaced() && !options.deinterlace)
    s.notes.push_back("the pictures are interlaced, every second row is of another moment: set recording.deinterlace");
}

Recording::~Recording() = default;
Recording::Recording(Recording&&) noexcept = default;

std::optional<StereoFrame> Recording::next() {
  Sources& s = *sources_;
  if (s.live) return s.next_live();
  const QuietOpenCv quiet;
  std::optional<FrameSource::Frame> first = s.first->next();
  std::optional<FrameSource::Frame> second;
  if (s.second && s.has_no_stamps()) second = s.second->next();
  const bool ended = !first || (s.second && s.has_no_stamps() && !second);
  const bool right_is_cut =
      s.second && !s.has_no_stamps() && !s.right && s.right_has_ended() && s.second->frames_if_whole() > 0;
  if (ended || right_is_cut) {
    const FrameSource& source = ended ? *s.first : *s.second;
    if (const int whole = source.frames_if_whole(); whole > 0)
      throw Unfinished(fmt::format("recording: {} ends after {} frames, its header states {}",
                                   (!s.second ? s.options.stereo
                                    : ended   ? s.options.left
                                              : s.options.right)
                                       .string(),
                                   s.index, whole));
    return std::nullopt;
  }
  StereoFrame frame;
  if (!s.second)
    frame = s.split(first->image);
  else
    frame = {0, 0, first->image, s.has_no_stamps() ? second->image : s.right_image_at(first->time_s)};
  s.arrange(frame);
  frame.index = s.index++;
  const bool by_stamp = !s.first->stamps_s().empty() && s.options.fps <= 0;
  frame.time_s = by_stamp ? first->time_s - s.first_stamp_s : frame.index / s.fps;
  return frame;
}

cv::Size Recording::size() const {
  return sources_->camera_size;
}
double Recording::fps() const {
  return sources_->fps;
}
int Recording::frame_count() const {
  return sources_->frame_count;
}
const RecordingTiming& Recording::timing() const {
  return sources_->pairing.timing;
}
bool Recording::is_live() const {
  return sources_->live != nullptr;
}
int64_t Recording::taken_ns() const {
  return sources_->taken_ns;
}
int Recording::dropped() const {
  return sources_->live ? sources_->live->dropped() - sources_->dropped_before : 0;
}
void Recording::count_anew() {
  if (!sources_->live) return;
  sources_->index = 0;
  sources_->first_stamp_ns.reset();
  sources_->dropped_before = sources_->live->dropped();
}
void Recording::listen(std::function<void(const StereoFrame&)> listener) {
  if (!sources_->live) return;
  if (!listener) return sources_->live->listen({});
  sources_->live->listen([sources = sources_.get(), listener = std::move(listener)](const LivePair& pair) {
    StereoFrame frame = sources->arranged(pair);
    frame.time_s = static_cast<double>(pair.stamp_ns) * 1e-9;
    listener(frame);
  });
}
const std::vector<std::string>& Recording::notes() const {
  return sources_->notes;
}
std::vector<std::string> Recording::damages() const {
  std::vector<std::string> sentences;
  for (const FrameSource* source : {sources_->first.get(), sources_->second.get()})
    if (source && !source->damage().empty()) sentences.push_back(source->damage());
  return sentences;
}

}  // namespace palpate
