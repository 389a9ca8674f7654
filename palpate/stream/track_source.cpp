#include "palpate/stream/track_source.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <thread>

#include "palpate/core/clock.h"
#include "palpate/core/errors.h"

namespace palpate {

TrackSource parse_track_source(const std::string& track) {
  constexpr std::string_view kWord = "openigtlink:";
  const size_t slash = track.find('/');
  TrackSource source;
  if (track.starts_with(kWord) && slash != std::string::npos) {
    source.device = track.substr(slash + 1);
    const std::string server = track.substr(kWord.size(), slash - kWord.size());
    if (!server.empty()) source.server = parse_address(server, "instrument.track");
  }
  if (source.device.empty())
    throw BadInput(
        fmt::format("instrument.track is '{}', expected openigtlink:HOST:PORT/DEVICE or openigtlink:/DEVICE", track));
  return source;
}

struct TrackReceiver::State {
  SocketAddress server;
  std::function<void(const IgtlReceived&)> on_transform;
  std::atomic<bool> stop{false};
  std::thread thread;

  static constexpr int kLook_ms = 100;  ///< how often `stop` is looked at
  static constexpr int kAgain_ms = 1000;

  void pause(int ms) const {
    for (int64_t until_ns = steady_ns() + ms * 1'000'000LL; !stop && steady_ns() < until_ns;) poll(nullptr, 0, 10);
  }

  Descriptor connected() const {
    Descriptor socket(::socket(server.storage.ss_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
    const int answer =
        connect(socket.get(), reinterpret_cast<const sockaddr*>(&server.storage), server.size) == 0 ? 0 : errno;
    if (answer == 0) return socket;
    if (answer != EINPROGRESS) return Descriptor();
    pollfd polled{socket.get(), POLLOUT, 0};
    for (int waited_ms = 0; !stop && waited_ms < kAgain_ms && poll(&polled, 1, kLook_ms) == 0; waited_ms += kLook_ms) {
    }
    int error = 0;
    socklen_t size = sizeof error;
    getsockopt(socket.get(), SOL_SOCKET, SO_ERROR, &error, &size);
    return polled.revents != 0 && error == 0 ? std::move(socket) : Descriptor();
  }

  void read_all(const Descriptor& socket) const {
    IgtlReader reader;
    std::array<uint8_t, 16384> buffer;
    while (!stop) {
      pollfd polled{socket.get(), POLLIN, 0};
      if (poll(&polled, 1, kLook_ms) <= 0) continue;
      const ssize_t count = recv(socket.get(), buffer.data(), buffer.size(), MSG_DONTWAIT);
      if (count == 0 || (count < 0 && errno != EAGAIN && errno != EINTR)) return;
      const auto hand_on = [this](const IgtlReceived& message) {
        if (message.type == "TRANSFORM") on_transform(message);
      };
      if (count > 0 && !reader.read({buffer.data(), static_cast<size_t>(count)}, hand_on)) return;
    }
  }

  void run() const {
    while (!stop) {
      if (const Descriptor socket = connected()) read_all(socket);
      pause(kAgain_ms);
    }
  }
};

TrackReceiver::TrackReceiver(const Address& server, std::function<void(const IgtlReceived&)> on_transform)
    : state_(std::make_unique<State>()) {
  state_->server = resolve(server, SOCK_STREAM, "instrument.track");
  state_->on_transform = std::move(on_transform);
  state_->thread = std::thread([this] { state_->run(); });
}

TrackReceiver::~TrackReceiver() {
  state_->stop = true;
  state_->thread.join();
}

}  // namespace palpate
