#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "palpate/stereo/live_pairing.h"

namespace palpate {

/// The name of a source as a GStreamer pipeline: itself, or one around a device or an rtsp:// address; empty for
/// others.
std::string pipeline_of(const std::string& name);

/// One or two cameras in one GStreamer pipeline and clock. A camera that stops is started again until it comes back.
class LiveCameras {
 public:
  struct Camera {
    std::string name;  ///< of the source
    std::string key;   ///< of the scene file, in sentences: "recording.left"
  };
  /// What is told, from threads of GStreamer and of this class; it must not wait.
  struct Listener {
    std::function<void(size_t camera, StampedPicture picture)> on_picture;  ///< 8-bit BGR
    std::function<void()> on_end;  ///< a source of known length has come to its end
  };

  /// Waits for the first picture of each. Throws BadInput: no such pipeline, no camera, no picture.
  LiveCameras(const std::vector<Camera>& cameras, Listener listener);
  ~LiveCameras();

  cv::Size size(size_t camera) const;
  double stated_fps() const;  ///< of the first camera; 0 = none

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace palpate
