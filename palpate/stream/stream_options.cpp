#include "palpate/stream/stream_options.h"

namespace palpate {

namespace {

void describe(Settings& settings, ForceLoopOptions& options) {
  settings.number("rate_hz", options.rate_hz, {100, 4000}, "answers per second");
  settings.text("udp", options.udp, "HOST:PORT that the 64-byte records are sent to");
  settings.number("max_force_N", options.max_force_N, {0, 100, true}, "no force of the loop is greater");
  settings.number("max_rate_N_per_s", options.max_rate_N_per_s, {0, 1e5, true},
                  "nor changes faster, but for the ramp to zero when frames stay away");
  settings.flag("fifo", options.fifo, "run under SCHED_FIFO, where the system allows it");
}

void describe(Settings& settings, OpenIgtLinkOptions& options) {
  settings.text("host", options.host, "address to listen on; 0.0.0.0 for all networks, which anybody there can read");
  settings.integer("port", options.port, {1, 65535}, "port to listen on");
  settings.number("overlay_hz", options.overlay_hz, {0, 60}, "PalpateOverlay, at most so often; 0 = never");
  settings.number("surface_hz", options.surface_hz, {0, 60}, "PalpateSurface, at most so often; 0 = never");
  settings.number("force_hz", options.force_hz, {1, 1000}, "PalpateForce from the force loop, where that runs");
  settings.number("drop_after_s", options.drop_after_s, {1, 3600}, "a client that takes nothing for so long is gone");
}

void describe(Settings& settings, Ros2Options& options) {
  settings.integer("domain", options.domain, {0, 232}, "ROS_DOMAIN_ID");
  settings.text("interface", options.interface,
                "network address (or name, as eth0) that topics are sent on; 127.0.0.1: this machine only");
  settings.text("prefix", options.prefix, "before measured_cf and measured_cp");
  settings.text("prefix_2", options.prefix_2, "the same of a second instrument");
  settings.text("camera_frame", options.camera_frame, "frame_id of the left camera's optical frame");
  settings.number("overlay_hz", options.overlay_hz, {0, 60},
                  "/palpate/overlay/compressed, at most so often; 0 = never");
}

}  // namespace

void describe(Settings& settings, StreamOptions& options) {
  settings.group(
      "force_loop", "the force at 1 kHz for a haptic device, over UDP; on where it is named",
      [&options](Settings& group) { describe(group, options.force_loop); }, &options.has_force_loop);
  settings.group(
      "openigtlink", "a server for 3D Slicer and others; on where it is named",
      [&options](Settings& group) { describe(group, options.openigtlink); }, &options.has_openigtlink);
  settings.group(
      "ros2", "topics of ROS 2 (DDS); on where it is named",
      [&options](Settings& group) { describe(group, options.ros2); }, &options.has_ros2);
}

}  // namespace palpate
