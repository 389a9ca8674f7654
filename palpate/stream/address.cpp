#include "palpate/stream/address.h"

#include <fmt/format.h>
#include <netdb.h>
#include <unistd.h>

#include <charconv>
#include <cstring>
#include <utility>

#include "palpate/core/errors.h"

namespace palpate {

Address parse_address(const std::string& text, const std::string& key) {
  Address address;
  const size_t colon = text.rfind(':');
  const char* const end = text.data() + text.size();
  bool good = colon != std::string::npos && colon > 0;
  if (good) {
    const auto [last, error] = std::from_chars(text.data() + colon + 1, end, address.port);
    good = error == std::errc() && last == end && address.port > 0 && address.port < 65536;
    address.host = text.substr(0, colon);
    if (address.host.starts_with('[') && address.host.ends_with(']'))
      address.host = address.host.substr(1, address.host.size() - 2);
  }
  if (!good) throw BadInput(fmt::format("{} is '{}', expected HOST:PORT, as 127.0.0.1:18945", key, text));
  return address;
}

SocketAddress resolve(const Address& address, int kind, const std::string& key) {
  addrinfo wanted{}, *found = nullptr;
  wanted.ai_family = AF_UNSPEC;
  wanted.ai_socktype = kind;
  const int error = getaddrinfo(address.host.c_str(), std::to_string(address.port).c_str(), &wanted, &found);
  if (error != 0)
    throw BadInput(
        fmt::format("{} is '{}', which no name server knows ({})", key, address.text(), gai_strerror(error)));
  SocketAddress result;
  std::memcpy(&result.storage, found->ai_addr, found->ai_addrlen);
  result.size = found->ai_addrlen;
  freeaddrinfo(found);
  return result;
}

Descriptor::~Descriptor() {
  if (fd_ >= 0) close(fd_);
}

Descriptor& Descriptor::operator=(Descriptor&& other) noexcept {
  std::swap(fd_, other.fd_);
  return *this;
}

int Descriptor::release() {
  return std::exchange(fd_, -1);
}

}  // namespace palpate
