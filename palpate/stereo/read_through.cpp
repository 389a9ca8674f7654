#include "palpate/stereo/read_through.h"

#include <fmt/core.h>

#include "palpate/core/errors.h"
#include "palpate/core/source_kind.h"
#include "palpate/core/stopwatch.h"
#include "palpate/stereo/frame_source.h"
#include "palpate/stereo/quiet_opencv.h"

namespace palpate {

namespace {

std::vector<std::string> read_source(const std::filesystem::path& path, const std::string& key, double fps,
                                     double patience_s) {
  Stopwatch watch;
  std::unique_ptr<FrameSource> source;
  try {
    source = open_frame_source(path, key, fps, true);
  } catch (const BadInput&) {
    return {fmt::format("{}: no frame of it is without damage", path.string())};
  }
  const size_t stated = source->stamps_s().size();
  size_t frames = 0;
  bool ended = false;
  for (double spent_ms = 0; spent_ms < 1000 * patience_s; spent_ms += watch.lap_ms()) {
    try {
      ended = !source->next();
    } catch (const BadInput& reason) {
      throw Unfinished(reason.what());
    }
    if (ended) break;
    ++frames;
  }
  if (const int whole = source->frames_if_whole(); ended && whole > 0)
    throw Unfinished(
        fmt::format("{}: {} ends after {} frames, its header states {}", key, path.string(), frames, whole));
  std::vector<std::string> sentences;
  if (!source->damage().empty()) sentences.push_back(source->damage());
  if (!ended && frames < stated)
    sentences.push_back(
        fmt::format("{}: of {} frames the first {} were looked at for damage", path.string(), stated, frames));
  return sentences;
}

}  // namespace

std::vector<std::string> read_through(const RecordingOptions& options, double patience_s) {
  const QuietOpenCv quiet;
  std::vector<std::string> sentences;
  for (const auto& [path, key] :
       {std::pair{options.left, "recording.left"}, std::pair{options.right, "recording.right"},
        std::pair{options.stereo, "recording.stereo"}}) {
    if (path.empty() || kind_of_source(path.string()) != SourceKind::file) continue;
    const double share_s = options.stereo.empty() ? 0.5 * patience_s : patience_s;
    for (std::string& sentence : read_source(path, key, options.fps, share_s)) sentences.push_back(std::move(sentence));
  }
  return sentences;
}

}  // namespace palpate
