#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/playback.h"
#include "app/run.h"
#include "app/scene_file.h"
#include "palpate/core/errors.h"
#include "palpate/feedback/forces_file.h"
#include "palpate/feedback/overlay.h"
#include "palpate/feedback/report.h"
#include "palpate/feedback/video_writer.h"
#include "palpate/stream/stream_hub.h"

namespace palpate::app {

/// What could not be done, in sentences: work goes on without, and tells of it at its end.
class Losses {
 public:
  /// False where `work` throws Unfinished, whose sentence is kept.
  template <class Work>
  bool attempt(const Work& work) {
    try {
      work();
      return true;
    } catch (const Unfinished& reason) {
      add(reason.what());
      return false;
    }
  }
  void add(const std::string& sentence) { sentences_.push_back(sentence); }
  bool any() const { return !sentences_.empty(); }
  std::string text() const;

 private:
  std::vector<std::string> sentences_;
};

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

/// Everything that grows frame by frame, and the page that is made of it at the end, whatever the end is.
struct RunFiles {
  /// Begins forces.csv, run.yaml and overlay.mp4. Throws Unfinished when there cannot even be a forces.csv.
  RunFiles(const SceneFile& scene_file, const std::filesystem::path& folder, const BuiltMap& built,
           const Recording& recording, Truths truths, StreamHub& streams);

  /// A row, what is sent live, and a picture where the disk still takes one. Throws Unfinished when it does not take
  /// the row.
  void add(const PlayedFrame& played, ForceEstimate estimate);

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
  std::vector<FrameTimes> times;
};

}  // namespace palpate::app
