#pragma once

#include <string>

#include "palpate/core/settings.h"

namespace palpate {

/// `streams.force_loop`.
struct ForceLoopOptions {
  double rate_hz = 1000;
  std::string udp = "127.0.0.1:18945";  ///< where the records go
  double max_force_N = 5;               ///< no force of the loop is greater
  double max_rate_N_per_s = 100;        ///< nor changes faster, but for the ramp to zero
  bool fifo = false;                    ///< SCHED_FIFO, where the system allows it
};

/// `streams.openigtlink`.
struct OpenIgtLinkOptions {
  std::string host = "127.0.0.1";
  int port = 18944;
  double overlay_hz = 10, surface_hz = 5, force_hz = 100;
  double drop_after_s = 10;  ///< a client that takes nothing for so long is gone
};

/// `streams.ros2`.
struct Ros2Options {
  int domain = 0;  ///< ROS_DOMAIN_ID
  std::string interface = "127.0.0.1";
  std::string prefix = "palpate/PSM1";       ///< of measured_cf and measured_cp
  std::string prefix_2 = "palpate/PSM2";     ///< the same of a second instrument
  std::string camera_frame = "left_camera";  ///< frame_id
  double overlay_hz = 10;
};

/// `streams` of the scene file: all off unless they are named.
struct StreamOptions {
  ForceLoopOptions force_loop;
  OpenIgtLinkOptions openigtlink;
  Ros2Options ros2;
  bool has_force_loop = false, has_openigtlink = false, has_ros2 = false;

  bool any() const { return has_force_loop || has_openigtlink || has_ros2; }
};

void describe(Settings& settings, StreamOptions& options);

}  // namespace palpate
