#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

namespace palpate::bench {

/// A real picture with its instruments outlined by eye.
struct OutlinedPicture {
  std::string set;
  cv::Mat bgr;
  cv::Mat truth;                  ///< 255 = instrument
  cv::Mat judged;                 ///< 255 = where the outline is sure
  std::vector<cv::Point2d> tips;  ///< px of the picture
};

/// Those of bench/accuracy/instrument_outlines.json that lie under `folder` (docs/instruments.md says what to put
/// there).
std::vector<OutlinedPicture> read_outlined_pictures(const std::filesystem::path& folder);

/// The left halves of the videos of consecutive real frames under `folder`.
struct RealVideo {
  std::string name;
  std::vector<cv::Mat> frames;
};
std::vector<RealVideo> read_real_videos(const std::filesystem::path& folder);

/// A pair whose tip was clicked in both pictures.
struct ClickedPair {
  cv::Mat left, right;
  cv::Point2d left_px, right_px;
};
std::vector<ClickedPair> read_clicked_pairs(const std::filesystem::path& folder);

}  // namespace palpate::bench
