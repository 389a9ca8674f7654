#pragma once

#include <netinet/in.h>

#include <string>

namespace palpate {

/// "127.0.0.1:18945", "[::1]:18945" or "name:18945".
struct Address {
  std::string host;
  int port = 0;

  std::string text() const { return host + ":" + std::to_string(port); }
};

/// Throws BadInput with a sentence that begins with `key`.
Address parse_address(const std::string& text, const std::string& key);

/// Where a socket is bound or sent to. Throws BadInput that names key and address where the name is not known.
struct SocketAddress {
  sockaddr_storage storage{};
  socklen_t size = 0;
};
SocketAddress resolve(const Address& address, int kind, const std::string& key);

/// A file descriptor that closes itself.
class Descriptor {
 public:
  explicit Descriptor(int fd = -1) : fd_(fd) {}
  ~Descriptor();
  Descriptor(Descriptor&& other) noexcept : fd_(other.release()) {}
  Descriptor& operator=(Descriptor&& other) noexcept;
  int get() const { return fd_; }
  explicit operator bool() const { return fd_ >= 0; }

 private:
  int release();
  int fd_;
};

}  // namespace palpate
