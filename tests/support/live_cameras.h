#pragma once

#include <sys/types.h>

#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace palpate::test {

/// Whether GStreamer's own program and the elements that the senders need are there.
bool has_gstreamer();

/// The number of a picture, painted into its upper left corner, and as it is read there.
void paint_number(cv::Mat& image, int number);
int painted_number(const cv::Mat& image);

/// NAME_0000.png ... of a camera, each with its number painted.
void write_numbered(const std::filesystem::path& folder, const std::string& name, const std::vector<cv::Mat>& images);

/// A TCP port of this computer that nobody listens on.
int free_port();

/// A camera as another program: pictures of `write_numbered` at 25 per second, over and over, over loopback.
struct Sender {
  std::string name;
  int port = 0;
  int late_ms = 0;  ///< its pictures come so much after the time in their stamps
};

/// gst-launch-1.0, all cameras in one pipeline and clock.
class Senders {
 public:
  Senders(const std::filesystem::path& folder, const std::vector<Sender>& cameras);
  ~Senders();
  Senders(const Senders&) = delete;
  Senders& operator=(const Senders&) = delete;

  /// It stands still, its connections open.
  void hold();
  void go_on();

 private:
  pid_t pid_ = -1;
};

/// The pipeline that receives from a port.
std::string receiver(int port);

}  // namespace palpate::test
