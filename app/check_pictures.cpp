#include "app/check_pictures.h"

#include <fmt/format.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "app/progress.h"
#include "app/runtime.h"
#include "palpate/core/errors.h"
#include "palpate/instrument/instrument_tracker.h"
#include "palpate/stereo/recording.h"

namespace palpate::app {
namespace {

constexpr int kFrames = 10;
constexpr int kFramesInRow = 2;
constexpr int kWidth_px = 400;  // of one camera's picture
constexpr int kRowLines_px = 40;
const cv::Scalar kMaskColour(60, 220, 60), kRowColour(0, 220, 255);
const cv::Scalar kTipColours[] = {{0, 220, 255}, {255, 120, 255}};

cv::Mat shrunk(const cv::Mat& picture) {
  cv::Mat result;
  const double scale = 1.0 * kWidth_px / picture.cols;
  cv::resize(picture, result, {kWidth_px, std::max(1, cvRound(scale * picture.rows))}, 0, 0, cv::INTER_AREA);
  return result;
}

/// One camera's picture with the outline of the mask, and axis and tip of each instrument.
cv::Mat drawn(const cv::Mat& bgr, const cv::Mat& mask, const InstrumentObservations& seen, size_t camera) {
  cv::Mat picture = bgr.clone();
  const int thick = std::max(1, bgr.cols / 320);
  std::vector<std::vector<cv::Point>> outlines;
  if (!mask.empty()) cv::findContours(mask, outlines, cv::RETR_CCOMP, cv::CHAIN_APPROX_NONE);
  cv::drawContours(picture, outlines, -1, kMaskColour, thick);
  for (size_t i = 0; i < seen.tips.size(); ++i) {
    const std::optional<ImageTip>& tip = seen.tips[i].in_image[camera];
    if (!seen.tips[i].visible || !tip) continue;
    const cv::Scalar& colour = kTipColours[i % std::size(kTipColours)];
    cv::line(picture, tip->tip_px, tip->tip_px - 4 * tip->width_px * tip->axis, colour, thick, cv::LINE_AA);
    cv::circle(picture, tip->tip_px, 4 * thick, colour, thick, cv::LINE_AA);
  }
  return shrunk(picture);
}

cv::Mat both_cameras(const RectifiedPair& pair, const InstrumentObservations& seen) {
  cv::Mat picture;
  cv::hconcat(drawn(pair.left, seen.left_mask, seen, 0), drawn(pair.right, seen.right_mask, seen, 1), picture);
  int visible = 0;
  for (const TipObservation& tip : seen.tips) visible += tip.visible;
  const std::string text = fmt::format("frame {}: {} of {} followed", pair.index, visible, seen.tips.size());
  cv::putText(picture, text, {6, 16}, cv::FONT_HERSHEY_SIMPLEX, 0.45, cv::Scalar::all(0), 3, cv::LINE_AA);
  cv::putText(picture, text, {6, 16}, cv::FONT_HERSHEY_SIMPLEX, 0.45, cv::Scalar::all(255), 1, cv::LINE_AA);
  return picture;
}

void write(const std::filesystem::path& file, const cv::Mat& picture) {
  if (!cv::imwrite(file.string(), picture)) throw Unfinished(fmt::format("{} cannot be written", file.string()));
}

cv::Mat with_row_lines(const RectifiedPair& pair) {
  cv::Mat picture;
  cv::hconcat(pair.left, pair.right, picture);
  for (int y = kRowLines_px / 2; y < picture.rows; y += kRowLines_px)
    cv::line(picture, {0, y}, {picture.cols - 1, y}, kRowColour, 1);
  return picture;
}

/// Pictures of equal size, in rows.
cv::Mat tiled(std::vector<cv::Mat> pictures) {
  while (pictures.size() % kFramesInRow != 0) pictures.push_back(cv::Mat::zeros(pictures[0].size(), CV_8UC3));
  cv::Mat result;
  for (size_t i = 0; i < pictures.size(); i += kFramesInRow) {
    cv::Mat row;
    cv::hconcat(&pictures[i], kFramesInRow, row);
    result.push_back(row);
  }
  return result;
}

}  // namespace

void write_check_pictures(const SceneFile& scene_file, const BuiltMap& built, const std::filesystem::path& folder,
                          bool quiet) {
  const Rectification& rectification = built.rectification;
  const RectifiedPair static_pair = rectify(rectification, built.frame);
  InstrumentOptions from_images = scene_file.scene.instrument;
  from_images.track.clear();
  from_images.track_2.clear();
  InstrumentTracker tracker(from_images, rectification, static_pair, built.map.organ_mask);
  Recording recording(scene_file.scene.recording);
  Progress progress("look", quiet);
  const int frames = recording.frame_count();
  std::vector<cv::Mat> pictures;
  while (auto frame = recording.next()) {
    if (frame->left.empty() || frame->right.empty()) continue;
    const RectifiedPair pair = rectify(rectification, *frame);
    const InstrumentObservations seen = tracker.update(pair);
    // Evenly spread; the first ten where nobody knows how many there are.
    const int next =
        frames < 0 ? static_cast<int>(pictures.size()) : static_cast<int>((pictures.size() + 0.5) * frames / kFrames);
    if (pair.index >= next && pictures.size() < kFrames) pictures.push_back(both_cameras(pair, seen));
    if (frames < 0 && pictures.size() == kFrames) break;
    progress.show(pair.index + 1, frames, "");
    if (interrupted()) throw Unfinished(fmt::format("interrupted after frame {}", frame->index));
  }
  std::filesystem::create_directories(folder);
  write(folder / "rectified.png", with_row_lines(static_pair));
  if (!pictures.empty()) write(folder / "instruments.png", tiled(std::move(pictures)));
}

}  // namespace palpate::app
