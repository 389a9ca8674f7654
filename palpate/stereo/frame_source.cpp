#include "palpate/stereo/frame_source.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>

#include "palpate/core/clock.h"
#include "palpate/core/errors.h"
#include "palpate/core/quantile.h"
#include "palpate/core/source_kind.h"
#include "palpate/stereo/image_ends.h"
#include "palpate/stereo/times_file.h"

namespace palpate {
namespace {

constexpr double kUsualFps = 25;
/// With an address, for each picture.
constexpr int kPatience_ms = 5000;

std::string small_extension(const std::filesystem::path& file) {
  std::string ending = file.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  return ending;
}

bool is_image_name(const std::filesystem::path& file) {
  const std::string ending = small_extension(file);
  for (const char* known : {".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".ppm", ".pgm", ".webp", ".jp2"})
    if (ending == known) return true;
  return false;
}

/// Names that count frames, or that are stamps in ns, us or ms since 1970, one credible step apart.
double seconds_per_number(const std::vector<NumberedFile>& files, double fps) {
  const double counted = 1 / (fps > 0 ? fps : kUsualFps);
  if (files.size() < 2 || fps > 0) return counted;
  std::vector<long long> steps;
  for (size_t i = 1; i < files.size(); ++i) steps.push_back(files[i].number - files[i - 1].number);
  const auto step = static_cast<double>(median_of(steps)), first = static_cast<double>(files.front().number);
  constexpr double kYear2001_s = 1e9, kYear2100_s = 4.1e9, kLongestStep_s = 2, kShortestStep_s = 1e-3;
  for (const double unit : {1e-3, 1e-6, 1e-9})
    if (first * unit > kYear2001_s && first * unit < kYear2100_s && step * unit >= kShortestStep_s &&
        step * unit <= kLongestStep_s)
      return unit;
  return counted;
}

/// Numbered images, or a single one.
class ImageFiles : public FrameSource {
 public:
  ImageFiles(std::vector<NumberedFile> files, const std::string& key, double fps)
      : files_(std::move(files)), key_(key), fps_(fps) {
    if (fps_ <= 0 && files_.size() > 1) {
      ImageTimes beside = times_beside(files_);
      stamps_s_ = std::move(beside.times_s);
      note_ = std::move(beside.note);
    }
    counts_frames_ = stamps_s_.empty() && take_stamps_of_names();
    size_ = load(files_.front().file).size();
  }
  std::optional<Frame> next() override {
    if (next_ >= files_.size()) return std::nullopt;
    Frame frame{load(files_[next_].file), stamps_s_[next_]};
    if (frame.image.size() != size_)
      throw BadInput(fmt::format("{}: {} is {}x{} px, expected {}x{} px like the first image", key_,
                                 files_[next_].file.string(), frame.image.cols, frame.image.rows, size_.width,
                                 size_.height));
    ++next_;
    return frame;
  }
  cv::Size size() const override { return size_; }
  std::string clock() const override { return counts_frames_ ? "numbers" : "stamps"; }
  const std::vector<double>& stamps_s() const override { return stamps_s_; }
  double stated_fps() const override { return counts_frames_ ? (fps_ > 0 ? fps_ : kUsualFps) : 0; }
  std::string note() const override { return note_; }

 private:
  /// Whether the names only count.
  bool take_stamps_of_names() {
    const double unit = seconds_per_number(files_, fps_);
    const bool counts = unit == 1 / (fps_ > 0 ? fps_ : kUsualFps);
    // Stamps since 1970 are too long for a double to add up; they are counted from a whole second near the first.
    const long long origin = counts ? 0 : files_.front().number / std::llround(1 / unit) * std::llround(1 / unit);
    const double origin_s = static_cast<double>(origin) * unit;
    for (const NumberedFile& file : files_)
      stamps_s_.push_back(origin_s + static_cast<double>(file.number - origin) * unit);
    return counts;
  }

  cv::Mat load(const std::filesystem::path& file) {
    if (const std::string obstacle = obstacle_to_reading(file); !obstacle.empty())
      throw BadInput(fmt::format("{}: {} {}, expected an image", key_, file.string(), obstacle));
    if (is_cut_short(file))
      throw BadInput(fmt::format("{}: {} is cut short, expected a whole image", key_, file.string()));
    const cv::Mat image = cv::imread(file.string(), cv::IMREAD_COLOR | cv::IMREAD_ANYDEPTH);
    if (image.empty()) throw BadInput(fmt::format("{}: {} is not an image that opens", key_, file.string()));
    if (image.depth() == CV_8U) return image;
    if (white_ == 0) white_ = white_of(image);
    cv::Mat shown;
    image.convertTo(shown, CV_8U, 255 / white_);
    return shown;
  }

  /// 10, 12 or 14 bits in 16, told from the first image; floating point ends at 1.
  static double white_of(const cv::Mat& image) {
    if (image.depth() != CV_16U) return 1;
    double max = 0;
    cv::minMaxLoc(image.reshape(1), nullptr, &max);
    for (const int bits : {10, 12, 14})
      if (max < (1 << bits)) return (1 << bits) - 1;
    return 65535;
  }

  std::vector<NumberedFile> files_;
  std::string key_;
  double fps_;
  bool counts_frames_ = true;
  std::vector<double> stamps_s_;
  std::string note_;
  cv::Size size_;
  double white_ = 0;
  size_t next_ = 0;
};

/// What OpenCV finds behind an address.
class AddressSource : public FrameSource {
 public:
  AddressSource(const std::string& address, const std::string& key) : address_(address), key_(key) {
    const int64_t begun_ns = steady_ns();
    // Other backends wait for ever where nobody sends.
    capture_.open(address, cv::CAP_FFMPEG,
                  {cv::CAP_PROP_OPEN_TIMEOUT_MSEC, kPatience_ms, cv::CAP_PROP_READ_TIMEOUT_MSEC, kPatience_ms});
    const bool opened = capture_.isOpened(), shows = opened && capture_.read(first_) && !first_.empty();
    if (!shows && steady_ns() - begun_ns >= kPatience_ms * 1'000'000LL)
      throw BadInput(fmt::format("{}: {} gives no picture within {} s; does anything send there?", key, address,
                                 kPatience_ms / 1000));
    if (!opened) throw BadInput(fmt::format("{}: {} cannot be opened as a video", key, address));
    if (!shows) throw BadInput(fmt::format("{}: {} holds no frame that can be decoded", key, address));
    size_ = first_.size();
    has_end_ = capture_.get(cv::CAP_PROP_FRAME_COUNT) > 0;
  }
  std::optional<Frame> next() override {
    Frame frame;  // a fresh image each time: frames are handed on without copying
    if (!first_.empty()) {
      frame.image = first_;
      first_.release();
      return frame;
    }
    if (capture_.read(frame.image) && !frame.image.empty()) return frame;
    if (!has_end_) throw Unfinished(fmt::format("{}: {} gives no more pictures", key_, address_));
    return std::nullopt;
  }
  cv::Size size() const override { return size_; }
  std::string clock() const override { return "address"; }
  const std::vector<double>& stamps_s() const override { return none_; }
  double stated_fps() const override {
    const double rate = capture_.get(cv::CAP_PROP_FPS);
    return std::isfinite(rate) && rate > 0 && rate < 1000 ? rate : 0;
  }

 private:
  cv::VideoCapture capture_;
  std::string address_, key_;
  bool has_end_ = false;
  cv::Mat first_;
  cv::Size size_;
  std::vector<double> none_;
};

}  // namespace

std::unique_ptr<FrameSource> open_frame_source(const std::filesystem::path& path, const std::string& key, double fps,
                                               bool strict) {
  const std::string name = path.string();
  if (kind_of_source(name) == SourceKind::address) return std::make_unique<AddressSource>(name, key);
  std::error_code ignored;
  if (has_placeholder(path) && !std::filesystem::exists(path, ignored)) {
    std::vector<NumberedFile> files = files_of_pattern(path);
    if (files.empty())
      throw BadInput(fmt::format(
          "{}: no image is named like {}{}", key, name,
          std::count(name.begin(), name.end(), '%') > 1 ? "; a percent sign that begins no number is written %%" : ""));
    return std::make_unique<ImageFiles>(std::move(files), key, fps);
  }
  if (const std::string obstacle = obstacle_to_reading(path); !obstacle.empty())
    throw BadInput(fmt::format("{}: {} {}, expected a video", key, name, obstacle));
  if (is_image_name(path)) return std::make_unique<ImageFiles>(std::vector{NumberedFile{0, path}}, key, fps);
  return open_video_file(path, key, strict);
}

}  // namespace palpate
