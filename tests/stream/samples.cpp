#include "tests/stream/samples.h"

#include <sys/socket.h>

#include <chrono>
#include <thread>

#include "palpate/core/clock.h"
#include "palpate/stream/address.h"

namespace palpate::test {

StreamScene small_scene() {
  StreamScene scene;
  scene.tissue.young_modulus_kPa = 27;
  scene.rest_nodes_mm = {{0, 0, 90}, {10, 0, 90}, {0, 10, 90}, {0, 0, 100}};
  scene.rest_boundary = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  scene.left.K = {70, 0, 47.5, 0, 70, 26.5, 0, 0, 1};
  scene.depth_mm = 90;
  return scene;
}

ForceEstimate touching(int frame) {
  ForceEstimate estimate;
  estimate.frame = frame;
  estimate.time_s = 0.04 * frame;
  estimate.status = FrameStatus::ok;
  estimate.in_contact = true;
  estimate.grip = Hold::grasp;
  estimate.force_N = {0.1, -0.2, 0.3};
  estimate.tip_mm = {10, 20, 90};
  estimate.band = {0.3, 0.45};
  estimate.tangent.stiffness_N_per_mm = 0.2 * Mat3::Identity();
  estimate.tangent.displacement_mm = {0.5, -1, 1.5};
  return estimate;
}

ForceEstimate both_touching() {
  ForceEstimate estimate = touching();
  estimate.further = {touching()};
  estimate.further[0].force_N = {0, 0, -0.5};
  estimate.further[0].tip_mm = {-5, 0, 80};
  return estimate;
}

ForceEstimate lost(int frame) {
  ForceEstimate estimate;
  estimate.frame = frame;
  estimate.status = FrameStatus::tool_lost;
  return estimate;
}

std::shared_ptr<StreamFrame> frame_of(const ForceEstimate& estimate) {
  auto frame = std::make_shared<StreamFrame>();
  frame->estimate = estimate;
  frame->instruments = 1 + static_cast<int>(estimate.further.size());
  frame->overlay = cv::Mat(54, 96, CV_8UC3, cv::Scalar(255, 0, 0));  // blue
  frame->decoded_ns = steady_ns();
  frame->wall_ns = wall_ns();
  return frame;
}

OpenIgtLinkOptions on_free_port() {
  const Descriptor socket(::socket(AF_INET, SOCK_STREAM, 0));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  bind(socket.get(), reinterpret_cast<sockaddr*>(&address), size);
  getsockname(socket.get(), reinterpret_cast<sockaddr*>(&address), &size);
  OpenIgtLinkOptions options;
  options.port = ntohs(address.sin_port);
  return options;
}

bool soon(const std::function<bool()>& holds) {
  for (int i = 0; i < 1000; ++i) {
    if (holds()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return holds();
}

}  // namespace palpate::test
