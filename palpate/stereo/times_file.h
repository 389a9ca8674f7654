#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "palpate/stereo/frame_source.h"

namespace palpate {

/// When numbered images were taken, where a file says so.
struct ImageTimes {
  std::vector<double> times_s;  ///< one per image; empty = not known
  std::string note;             ///< a sentence for the user: from where, or why not; "" = there is no such file
};

/// One time per line (KITTI's times.txt, timestamps.txt), or a time and the image's name (TUM, EuRoC's data.csv): a
/// number of s, ms, us or ns, or a time of day with or without its date. As many as there are images, or one for every
/// number, or one for every name. Throws BadInput that says what does not fit.
std::vector<double> read_image_times(const std::filesystem::path& file, const std::vector<NumberedFile>& images);

/// The same from a file that stands beside the images or one folder above, as the tools that write them call it; what
/// does not fit is told, not used.
ImageTimes times_beside(const std::vector<NumberedFile>& images);

}  // namespace palpate
