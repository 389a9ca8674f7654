#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "palpate/core/geometry.h"

namespace palpate {

/// Images of one camera (or of both in one picture), one after the other, with their times.
class FrameSource {
 public:
  struct Frame {
    cv::Mat image;      ///< 8-bit BGR
    double time_s = 0;  ///< presentation stamp; of an address, 0
  };

  virtual ~FrameSource() = default;
  virtual std::optional<Frame> next() = 0;
  virtual cv::Size size() const = 0;
  /// What the stamps count: "numbers" those of images, "stamps" and "file" from 0 or from 1970, else the name of a kind
  /// of stream that begins at any time ("mpegts").
  virtual std::string clock() const = 0;
  /// Of every frame, ascending; empty = not known (addresses).
  virtual const std::vector<double>& stamps_s() const = 0;
  /// Frames per second that the source states; 0 = none.
  virtual double stated_fps() const = 0;
  /// Frames that the header of a file states, where the file is cut and holds fewer; 0 = it is whole.
  virtual int frames_if_whole() const { return 0; }
  /// Its pictures are made of two moments, in every second row.
  virtual bool is_interlaced() const { return false; }
  /// A sentence on how it was read that a user ought to know.
  virtual std::string note() const { return {}; }
  /// A sentence on the frames that were found damaged so far; empty = none.
  virtual std::string damage() const { return {}; }
};

/// `key` names the source in sentences: "recording.left". `fps` numbers images whose times are not told by their names
/// or a file beside them; 0 = as usual. `strict` leaves damaged frames of videos out, instead of showing what can be
/// guessed of them, and finds more of them. Throws BadInput: missing, empty, not to be opened.
std::unique_ptr<FrameSource> open_frame_source(const std::filesystem::path& path, const std::string& key, double fps,
                                               bool strict = false);

/// A video file by FFmpeg: edit lists, empty chunks and a start other than zero are in the stamps.
std::unique_ptr<FrameSource> open_video_file(const std::filesystem::path& file, const std::string& key,
                                             bool strict = false);

/// Images of a pattern such as left_%04d.png or %04d/left.png, by rising number, gaps allowed; empty where the path
/// holds no placeholder. `%%` is a percent sign; so is a `%` that looks like a placeholder where images are found so
/// only.
struct NumberedFile {
  long long number = 0;
  std::filesystem::path file;
};
std::vector<NumberedFile> files_of_pattern(const std::filesystem::path& pattern);
bool has_placeholder(const std::filesystem::path& pattern);

}  // namespace palpate
