#include "palpate/stereo/recording.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <regex>

#include "palpate/core/errors.h"
#include "palpate/stereo/quiet_opencv.h"

namespace palpate {
namespace {

constexpr double kFallbackFps = 25;

/// Images of one eye (or of both in one picture), one after the other.
class Source {
 public:
  virtual ~Source() = default;
  virtual bool read(cv::Mat& image) = 0;
  virtual cv::Size size() const = 0;
  virtual double fps() const = 0;       // 0 = unknown
  virtual int frame_count() const = 0;  // -1 = unknown
};

/// Numbered images, or a single one.
class ImageFiles : public Source {
 public:
  ImageFiles(std::vector<std::filesystem::path> files, const std::string& key) : files_(std::move(files)), key_(key) {
    size_ = load(files_.front()).size();
  }
  bool read(cv::Mat& image) override {
    if (next_ >= files_.size()) return false;
    image = load(files_[next_]);
    if (image.size() != size_)
      throw BadInput(fmt::format("recording.{}: {} is {}x{} px, expected {}x{} px like the first image", key_,
                                 files_[next_].string(), image.cols, image.rows, size_.width, size_.height));
    ++next_;
    return true;
  }
  cv::Size size() const override { return size_; }
  double fps() const override { return 0; }
  int frame_count() const override { return static_cast<int>(files_.size()); }

 private:
  cv::Mat load(const std::filesystem::path& file) const {
    cv::Mat image = cv::imread(file.string(), cv::IMREAD_COLOR);
    if (image.empty()) throw BadInput(fmt::format("recording.{}: {} is not an image that opens", key_, file.string()));
    return image;
  }

  std::vector<std::filesystem::path> files_;
  std::string key_;
  cv::Size size_;
  size_t next_ = 0;
};

/// Whatever cv::VideoCapture opens: video file, device, GStreamer pipeline, address.
class Video : public Source {
 public:
  Video(const cv::VideoCapture& capture, bool is_file, const std::string& name, const std::string& key)
      : capture_(capture) {
    size_ = {static_cast<int>(capture_.get(cv::CAP_PROP_FRAME_WIDTH)),
             static_cast<int>(capture_.get(cv::CAP_PROP_FRAME_HEIGHT))};
    const double count = capture_.get(cv::CAP_PROP_FRAME_COUNT);
    frame_count_ = is_file && count > 0 && count < 1e9 ? static_cast<int>(count) : -1;
    // Some headers lie about the first frame only; a video whose first frame does not decode is of no use at all.
    if (!capture_.read(first_) || first_.empty())
      throw BadInput(fmt::format("recording.{}: {} holds no frame that can be decoded", key, name));
    size_ = first_.size();
  }
  bool read(cv::Mat& image) override {
    if (!first_.empty()) {
      image = first_;
      first_.release();
      return true;
    }
    cv::Mat decoded;  // a fresh one each time: frames are handed on without copying
    if (!capture_.read(decoded) || decoded.empty()) return false;
    image = decoded;
    return true;
  }
  cv::Size size() const override { return size_; }
  double fps() const override {
    const double rate = capture_.get(cv::CAP_PROP_FPS);
    return std::isfinite(rate) && rate > 0 && rate < 1000 ? rate : 0;
  }
  int frame_count() const override { return frame_count_; }

 private:
  cv::VideoCapture capture_;
  cv::Mat first_;
  cv::Size size_;
  int frame_count_ = -1;
};

bool is_image_name(const std::filesystem::path& file) {
  std::string ending = file.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  for (const char* known : {".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".ppm", ".pgm", ".webp", ".jp2"})
    if (ending == known) return true;
  return false;
}

/// Files that a pattern such as left_%04d.png names, by rising number; their numbers in `numbers`.
std::vector<std::filesystem::path> files_of_pattern(const std::filesystem::path& pattern, std::vector<long>& numbers) {
  static const std::regex kPlaceholder("%(0?)([0-9]*)d");
  const std::string name = pattern.filename().string();
  std::smatch found;
  if (!std::regex_search(name, found, kPlaceholder)) return {};
  const std::string before = found.prefix(), after = found.suffix();
  const size_t width = found[2].length() ? std::stoul(found[2]) : 1;
  std::vector<std::pair<long, std::filesystem::path>> matches;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(pattern.parent_path(), ignored)) {
    const std::string file = entry.path().filename().string();
    if (file.size() <= before.size() + after.size() || !file.starts_with(before) || !file.ends_with(after)) continue;
    const std::string digits = file.substr(before.size(), file.size() - before.size() - after.size());
    if (digits.size() < width || digits.size() > 9 || digits.find_first_not_of("0123456789") != std::string::npos)
      continue;
    matches.emplace_back(std::stol(digits), entry.path());
  }
  std::sort(matches.begin(), matches.end());
  std::vector<std::filesystem::path> files;
  for (const auto& [number, file] : matches) {
    numbers.push_back(number);
    files.push_back(file);
  }
  return files;
}

std::unique_ptr<Source> open_pattern(const std::filesystem::path& path, const std::string& key,
                                     std::vector<long>& numbers) {
  std::vector<std::filesystem::path> files = files_of_pattern(path, numbers);
  if (files.empty()) throw BadInput(fmt::format("recording.{}: no image is named like {}", key, path.string()));
  for (size_t i = 1; i < numbers.size(); ++i)
    if (numbers[i] != numbers[i - 1] + 1)
      throw BadInput(fmt::format("recording.{}: image {} of {} is missing", key, numbers[i - 1] + 1, path.string()));
  return std::make_unique<ImageFiles>(std::move(files), key);
}

std::unique_ptr<Source> open_source(const std::filesystem::path& path, const std::string& key,
                                    std::vector<long>& numbers) {
  const std::string name = path.string();
  const bool is_device = name.find_first_not_of("0123456789") == std::string::npos;
  const bool is_pipeline = name.find(" ! ") != std::string::npos;
  const bool is_address = name.find("://") != std::string::npos;
  cv::VideoCapture capture;
  if (is_device) {
    capture.open(std::stoi(name));
  } else if (is_pipeline) {
    capture.open(name, cv::CAP_GSTREAMER);
  } else if (is_address) {
    capture.open(name);
  } else if (name.find('%') != std::string::npos) {
    return open_pattern(path, key, numbers);
  } else {
    if (const std::string obstacle = obstacle_to_reading(path); !obstacle.empty())
      throw BadInput(fmt::format("recording.{}: {} {}, expected a video", key, name, obstacle));
    if (is_image_name(path)) return std::make_unique<ImageFiles>(std::vector{path}, key);
    capture.open(name, cv::CAP_FFMPEG);
  }
  if (!capture.isOpened())
    throw BadInput(fmt::format("recording.{}: {} cannot be opened as a {}", key, name,
                               is_device     ? "camera device"
                               : is_pipeline ? "GStreamer pipeline"
                                             : "video"));
  return std::make_unique<Video>(capture, !is_device && !is_pipeline && !is_address, name, key);
}

/// Matroska, MPEG streams and the like hold no frame count: OpenCV works it out from the duration.
int slack_of(const std::filesystem::path& file) {
  std::string ending = file.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  for (const char* counted : {".mp4", ".m4v", ".mov", ".avi"})
    if (ending == counted) return 0;
  return file.string().find('%') != std::string::npos || is_image_name(file) ? 0 : 2;
}

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
        "recording.left and recording.right are the same, {}, expected one for each eye (or stereo with its layout)",
        options.left.string()));
}

}  // namespace

void describe(Settings& settings, RecordingOptions& options) {
  settings.path("left", options.left, "video of the left eye: file, image pattern, device number, GStreamer pipeline");
  settings.path("right", options.right, "video of the right eye");
  settings.path("stereo", options.stereo, "one video that holds both eyes, instead of left and right");
  settings.choice<StereoLayout>(
      "layout", options.layout,
      {{"side-by-side", StereoLayout::side_by_side}, {"top-bottom", StereoLayout::top_bottom}},
      "where the eyes stand in the stereo video; the left one is left or on top");
  settings.flag("swap", options.swap, "exchange left and right");
  settings.path("calibration", options.calibration,
                "OpenCV stereo calibration (M1 D1 M2 D2 R T or K1 ...), or the left file of a ROS camera_info pair");
  settings.require("calibration");
  settings.choice<TranslationUnit>(
      "translation_unit", options.translation_unit,
      {{"detect", TranslationUnit::detect}, {"mm", TranslationUnit::mm}, {"m", TranslationUnit::m}},
      "unit of T in the calibration");
  settings.number("fps", options.fps, {0, 1000, false, false}, "frames per second; 0 = as the video says");
  settings.after_reading([&options] { check_options(options); });
}

struct Recording::Sources {
  RecordingOptions options;
  std::unique_ptr<Source> first;   // left, or both eyes in one image
  std::unique_ptr<Source> second;  // right, or none
  cv::Size eye_size;
  double fps = 0;
  int frame_count = -1;
  int slack = 0;
  int index = 0;

  StereoFrame split(const cv::Mat& both) const {
    StereoFrame frame;
    const cv::Point second_eye =
        options.layout == StereoLayout::side_by_side ? cv::Point(eye_size.width, 0) : cv::Point(0, eye_size.height);
    frame.left = both(cv::Rect({0, 0}, eye_size)).clone();
    frame.right = both(cv::Rect(second_eye, eye_size)).clone();
    return frame;
  }
};

namespace {

cv::Size eye_size_of(const RecordingOptions& options, cv::Size both) {
  const bool beside = options.layout == StereoLayout::side_by_side;
  const int length = beside ? both.width : both.height;
  if (length % 2 != 0)
    throw BadInput(fmt::format("recording.stereo: {} is {}x{} px, expected an even {} for layout {}",
                               options.stereo.string(), both.width, both.height, beside ? "width" : "height",
                               beside ? "side-by-side" : "top-bottom"));
  return beside ? cv::Size(both.width / 2, both.height) : cv::Size(both.width, both.height / 2);
}

void check_alike(const RecordingOptions& options, const Source& left, const Source& right, int slack) {
  if (left.size() != right.size())
    throw BadInput(fmt::format("recording: {} is {}x{} px but {} is {}x{} px, expected the same size",
                               options.left.string(), left.size().width, left.size().height, options.right.string(),
                               right.size().width, right.size().height));
  const int n = left.frame_count(), m = right.frame_count();
  if (n >= 0 && m >= 0 && std::abs(n - m) > slack)
    throw BadInput(fmt::format("recording: {} has {} frames but {} has {}, expected the same number",
                               options.left.string(), n, options.right.string(), m));
}

}  // namespace

Recording::Recording(const RecordingOptions& options) : sources_(std::make_unique<Sources>()) {
  check_options(options);
  const QuietOpenCv quiet;
  Sources& s = *sources_;
  s.options = options;
  std::vector<long> numbers, right_numbers;
  if (options.stereo.empty()) {
    s.first = open_source(options.left, "left", numbers);
    s.second = open_source(options.right, "right", right_numbers);
    s.slack = std::max(slack_of(options.left), slack_of(options.right));
    check_alike(options, *s.first, *s.second, s.slack);
    if (!numbers.empty() && !right_numbers.empty() && numbers.front() != right_numbers.front())
      throw BadInput(fmt::format("recording: the images of {} begin with number {} but those of {} with {}",
                                 options.left.string(), numbers.front(), options.right.string(),
                                 right_numbers.front()));
    s.eye_size = s.first->size();
  } else {
    s.first = open_source(options.stereo, "stereo", numbers);
    s.slack = slack_of(options.stereo);
    s.eye_size = eye_size_of(options, s.first->size());
  }
  s.frame_count = s.second ? std::min(s.first->frame_count(), s.second->frame_count()) : s.first->frame_count();
  s.fps = options.fps > 0 ? options.fps : s.first->fps() > 0 ? s.first->fps() : kFallbackFps;
}

Recording::~Recording() = default;
Recording::Recording(Recording&&) noexcept = default;

std::optional<StereoFrame> Recording::next() {
  Sources& s = *sources_;
  const QuietOpenCv quiet;
  cv::Mat first, second;
  const bool has_first = s.first->read(first);
  const bool has_second = !s.second || s.second->read(second);
  if (!has_first || !has_second) {
    if (s.frame_count >= 0 && s.index < s.frame_count - s.slack) {
      const std::filesystem::path& file = !s.second ? s.options.stereo : has_first ? s.options.right : s.options.left;
      throw Unfinished(fmt::format("recording: {} ends after {} frames, its header states {}", file.string(), s.index,
                                   s.frame_count));
    }
    return std::nullopt;
  }
  StereoFrame frame = s.second ? StereoFrame{0, 0, first, second} : s.split(first);
  if (s.options.swap) std::swap(frame.left, frame.right);
  frame.index = s.index++;
  frame.time_s = frame.index / s.fps;
  return frame;
}

cv::Size Recording::size() const {
  return sources_->eye_size;
}
double Recording::fps() const {
  return sources_->fps;
}
int Recording::frame_count() const {
  return sources_->frame_count;
}

}  // namespace palpate
