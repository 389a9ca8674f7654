#include "tests/support/live_cameras.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <stdexcept>

namespace palpate::test {

namespace {

constexpr int kBits = 12, kSide_px = 8;

cv::Rect square(int bit) {
  return {kSide_px * bit, 0, kSide_px, kSide_px};
}

}  // namespace

bool has_gstreamer() {
  static const bool kHas = std::system(
                               "gst-inspect-1.0 --exists gdppay && gst-inspect-1.0 --exists tcpserversink && "
                               "gst-inspect-1.0 --exists pngdec") == 0;
  return kHas;
}

void paint_number(cv::Mat& image, int number) {
  for (int bit = 0; bit < kBits; ++bit) image(square(bit)) = cv::Scalar::all((number >> bit) & 1 ? 235 : 20);
}

int painted_number(const cv::Mat& image) {
  int number = 0;
  for (int bit = 0; bit < kBits; ++bit)
    if (cv::mean(image(square(bit)))[1] > 128) number |= 1 << bit;
  return number;
}

void write_numbered(const std::filesystem::path& folder, const std::string& name, const std::vector<cv::Mat>& images) {
  for (size_t i = 0; i < images.size(); ++i) {
    cv::Mat image = images[i].clone();
    paint_number(image, static_cast<int>(i));
    cv::imwrite((folder / fmt::format("{}_{:04d}.png", name, i)).string(), image, {cv::IMWRITE_PNG_COMPRESSION, 1});
  }
}

int free_port() {
  const int listener = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t length = sizeof address;
  bind(listener, reinterpret_cast<sockaddr*>(&address), length);
  getsockname(listener, reinterpret_cast<sockaddr*>(&address), &length);
  close(listener);
  return ntohs(address.sin_port);
}

Senders::Senders(const std::filesystem::path& folder, const std::vector<Sender>& cameras) {
  std::string words = "gst-launch-1.0 -q";
  for (const Sender& camera : cameras) {
    words += fmt::format(" multifilesrc location={}/{}_%04d.png loop=true caps=image/png,framerate=25/1 ! pngdec",
                         folder.string(), camera.name);
    words += " ! videoconvert ! video/x-raw,format=I420 ! identity sync=true";
    if (camera.late_ms > 0)
      words += fmt::format(" ! queue max-size-buffers=0 max-size-bytes=0 max-size-time=0 min-threshold-time={}",
                           camera.late_ms * 1'000'000LL);
    words += fmt::format(" ! gdppay ! tcpserversink host=127.0.0.1 port={} sync=false", camera.port);
  }
  std::vector<std::string> parts;
  std::istringstream split(words);
  for (std::string part; split >> part;) parts.push_back(part);
  std::vector<char*> arguments;
  for (std::string& part : parts) arguments.push_back(part.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t quiet;
  posix_spawn_file_actions_init(&quiet);
  posix_spawn_file_actions_addopen(&quiet, 1, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addopen(&quiet, 2, "/dev/null", O_WRONLY, 0);
  const int failed = posix_spawnp(&pid_, arguments[0], &quiet, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&quiet);
  if (failed != 0) throw std::runtime_error("gst-launch-1.0 cannot be started");
  // Until it listens, a receiver that comes is refused.
  for (const Sender& camera : cameras) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<uint16_t>(camera.port));
    while (true) {
      const int probe = socket(AF_INET, SOCK_STREAM, 0);
      const int refused = connect(probe, reinterpret_cast<sockaddr*>(&address), sizeof address);
      close(probe);
      if (refused == 0) break;
      if (waitpid(pid_, nullptr, WNOHANG) != 0) throw std::runtime_error("gst-launch-1.0 ended: " + words);
      usleep(20'000);
    }
  }
}

Senders::~Senders() {
  kill(pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
}

void Senders::hold() {
  kill(pid_, SIGSTOP);
}

void Senders::go_on() {
  kill(pid_, SIGCONT);
}

std::string receiver(int port) {
  return fmt::format("tcpclientsrc host=127.0.0.1 port={} ! gdpdepay", port);
}

}  // namespace palpate::test
