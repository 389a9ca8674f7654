#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "palpate/feedback/forces_file.h"
#include "palpate/feedback/overlay.h"
#include "palpate/feedback/report.h"
#include "palpate/feedback/video_writer.h"
#include "palpate/session/built_map.h"
#include "palpate/session/losses.h"
#include "palpate/session/playback.h"
#include "palpate/session/scene_file.h"
#include "palpate/stream/stream_hub.h"

namespace palpate {

/// True forces of both instruments, each empty where there are none.
struct Truths {
  std::vector<ForceRow> first;
  std::vector<ForceRow> second;
};

/// An empty name has none; that of a second instrument is truth_2.csv beside truth.csv. Throws BadInput.
Truths read_truths(const std::filesystem::path& truth);

/// Of the frame with the greatest force: force over E with its band, N per kPa: value, low, high.
Vec3 peak_per_modulus(const std::vector<ForceRow>& rows, const TissueOptions& tissue);

/// The frames worth a picture in the report: spread over the contact, or over the run where there is none.
class PictureChoice {
 public:
  /// `frames` of the run; -1 = nobody knows.
  PictureChoice(int frames, std::string unit);

  void offer(const cv::Mat& overlay, const ForceEstimate& estimate);
  std::vector<ReportPicture> chosen() const;

 private:
  struct Offered {
    double force_N;
    ReportPicture picture;
  };
  int every_;
  std::string unit_;
  std::vector<Offered> pictures_;
};

/// A frame with its answer, as it was written and sent.
struct RunFrame {
  ForceEstimate estimate;
  cv::Mat overlay;         ///< 8-bit BGR, the left image as recorded with stress, force and readings; shared
  int64_t taken_ns = 0;    ///< steady clock: of a live source by its stamp, else as decoded_ns
  int64_t decoded_ns = 0;  ///< when both pictures were there
};

/// Everything that grows frame by frame, and the page that is made of it at the end, whatever the end is.
struct RunFiles {
  /// Begins forces.csv, run.yaml and overlay.mp4. Throws Unfinished when there cannot even be a forces.csv.
  RunFiles(const SceneFile& scene_file, const std::filesystem::path& folder, const BuiltMap& built,
           const Recording& recording, Truths truths, StreamHub& streams);

  /// A row, what is sent live, and a picture where the disk still takes one. Throws Unfinished when it does not take
  /// the row.
  RunFrame add(const PlayedFrame& played, ForceEstimate estimate);

  /// Ends the video, writes run.yaml and report.html; what fails is among the losses.
  void close();

  const SceneFile& scene_file;
  std::filesystem::path folder;
  const BuiltMap& built;
  Truths truths;
  Losses losses;
  ForcesWriter forces;
  SecondForcesWriter forces_2;
  std::optional<VideoWriter> overlay;
  OverlayPainter painter;
  PictureChoice pictures;
  StreamHub& streams;
  std::vector<ForceRow> rows;
  std::vector<FrameTimes> times;          ///< of the frames that were looked at
  std::vector<FrameTimes> contact_times;  ///< of those in contact
  int dropped = 0;  ///< frames of a live source that were not looked at; to be told before the end
};

}  // namespace palpate
