#include "palpate/stream/igtl_client.h"

#include <netinet/tcp.h>
#include <sys/socket.h>

#include <cerrno>
#include <utility>

namespace palpate {

namespace {

void set(int fd, int level, int option, int value) {
  setsockopt(fd, level, option, &value, sizeof value);
}

}  // namespace

IgtlClient::IgtlClient(Descriptor socket, int64_t now_ns) : socket_(std::move(socket)), connected_ns_(now_ns) {
  // A client whose machine is gone without a word is noticed within about twelve seconds.
  set(fd(), SOL_SOCKET, SO_KEEPALIVE, 1);
  set(fd(), IPPROTO_TCP, TCP_KEEPIDLE, 5);
  set(fd(), IPPROTO_TCP, TCP_KEEPINTVL, 2);
  set(fd(), IPPROTO_TCP, TCP_KEEPCNT, 3);
  set(fd(), IPPROTO_TCP, TCP_USER_TIMEOUT, 12000);
  set(fd(), IPPROTO_TCP, TCP_NODELAY, 1);
  // What waits in the system is old by the time that it is read.
  set(fd(), SOL_SOCKET, SO_SNDBUF, 256 * 1024);
}

bool IgtlClient::offer(IgtlKind kind, IgtlBytes bytes, int64_t decoded_ns) {
  Waiting& place = waiting_[static_cast<size_t>(kind)];
  const bool replaces = place.bytes != nullptr;
  place = {std::move(bytes), decoded_ns};
  return replaces;
}

void IgtlClient::forget_waiting() {
  waiting_ = {};
}

bool IgtlClient::wants_to_write() const {
  if (current_.bytes) return true;
  for (const Waiting& waiting : waiting_)
    if (waiting.bytes) return true;
  return false;
}

bool IgtlClient::begin_next() {
  for (size_t i = 0; i < kIgtlKinds; ++i) {
    const size_t kind = (next_kind_ + i) % kIgtlKinds;
    if (!waiting_[kind].bytes) continue;
    current_ = std::exchange(waiting_[kind], {});
    current_kind_ = kind;
    current_done_ = 0;
    next_kind_ = (kind + 1) % kIgtlKinds;
    return true;
  }
  return false;
}

bool IgtlClient::write(int64_t now_ns, Written& written) {
  while (current_.bytes || begin_next()) {
    const std::vector<uint8_t>& bytes = *current_.bytes;
    const ssize_t sent =
        send(fd(), bytes.data() + current_done_, bytes.size() - current_done_, MSG_DONTWAIT | MSG_NOSIGNAL);
    if (sent < 0) {
      if (errno == EINTR) continue;
      if (errno != EAGAIN && errno != EWOULDBLOCK && errno != ENOBUFS) return false;
      if (stuck_since_ns_ == 0) stuck_since_ns_ = now_ns;
      return true;
    }
    stuck_since_ns_ = 0;
    current_done_ += static_cast<size_t>(sent);
    written.bytes += static_cast<uint64_t>(sent);
    if (current_done_ < bytes.size()) continue;
    ++written.messages;
    if (current_kind_ == static_cast<size_t>(IgtlKind::tip)) written.tips_decoded_ns.push_back(current_.decoded_ns);
    current_ = {};
  }
  stuck_since_ns_ = 0;
  return true;
}

bool IgtlClient::read(const std::function<void(const IgtlReceived&)>& on_message) {
  std::array<uint8_t, 16384> buffer;
  constexpr int kAtOnce = 16;  // one talkative client does not keep the others waiting
  for (int i = 0; i < kAtOnce; ++i) {
    const ssize_t count = recv(fd(), buffer.data(), buffer.size(), MSG_DONTWAIT);
    if (count == 0) return false;
    if (count < 0) return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR;
    if (!reader_.read({buffer.data(), static_cast<size_t>(count)}, on_message)) return false;
  }
  return true;
}

}  // namespace palpate
