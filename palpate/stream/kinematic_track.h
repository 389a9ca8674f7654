#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "palpate/instrument/hand_eye.h"
#include "palpate/stream/force_loop.h"
#include "palpate/stream/igtl_reader.h"

namespace palpate {

/// The newest tip of a live track (`instrument.track: openigtlink:...`), left camera frame.
class KinematicTrack {
 public:
  /// Throws BadInput where `track` names no source.
  KinematicTrack(const std::string& track, const CameraFromRobot& camera_from_robot);
  ~KinematicTrack();

  /// It is sent by a client of our own server.
  bool comes_from_a_client() const;
  /// Every tip from now on also goes here, from the thread that receives it.
  void pass_on(std::function<void(const KinematicTip&)> to);
  /// Begins to listen, where the source is a server.
  void start();
  /// A message that some client has sent; taken where it is the track's.
  void take(const IgtlReceived& message);

  /// The tip of the frame that is looked at now; nothing where none has come for a tenth of a second. From the frame
  /// loop.
  std::optional<TipTrack::Row> at_frame();
  /// What `at_frame` answered last.
  const KinematicTip& last_at_frame() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace palpate
