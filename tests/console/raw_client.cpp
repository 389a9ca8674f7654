#include "tests/console/raw_client.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <stdexcept>

namespace palpate::test {

namespace {

int connected_to(int port) {
  const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0)
    throw std::runtime_error("nobody listens there");
  return fd;
}

void send_all(int fd, const std::string& bytes) {
  for (size_t sent = 0; sent < bytes.size();) {
    const ssize_t count = ::send(fd, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
    if (count <= 0) return;
    sent += static_cast<size_t>(count);
  }
}

}  // namespace

std::string answer_to(int port, const std::string& bytes) {
  const int fd = connected_to(port);
  send_all(fd, bytes);
  std::string answer;
  char part[4096];
  for (ssize_t count; (count = recv(fd, part, sizeof part, 0)) > 0;) answer.append(part, static_cast<size_t>(count));
  close(fd);
  return answer;
}

std::string get(int port, const std::string& target, const std::string& headers) {
  return answer_to(port, fmt::format("GET {} HTTP/1.1\r\n{}Connection: close\r\n\r\n", target, headers));
}

std::string get(int port, const std::string& target) {
  return get(port, target, fmt::format("Host: localhost:{}\r\n", port));
}

int status_of(const std::string& answer) {
  return answer.size() > 12 ? std::stoi(answer.substr(9, 3)) : 0;
}

RawViewer::RawViewer(int port, const std::string& headers) : fd_(connected_to(port)) {
  send_raw(
      fmt::format("GET /live HTTP/1.1\r\nHost: localhost:{}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                  "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n{}\r\n",
                  port, headers));
  for (char c; !handshake_.ends_with("\r\n\r\n") && read_exactly(&c, 1);) handshake_ += c;
}

RawViewer::~RawViewer() {
  close(fd_);
}

void RawViewer::send(const std::string& text, uint8_t opcode) {
  std::string frame(1, static_cast<char>(0x80 | opcode));
  const char mask[4] = {1, 2, 3, 4};
  if (text.size() < 126) {
    frame += static_cast<char>(0x80 | text.size());
  } else {
    const bool is_short = text.size() < 65536;
    frame += static_cast<char>(0x80 | (is_short ? 126 : 127));
    for (int shift = is_short ? 8 : 56; shift >= 0; shift -= 8) frame += static_cast<char>(text.size() >> shift);
  }
  frame.append(mask, 4);
  for (size_t i = 0; i < text.size(); ++i) frame += static_cast<char>(text[i] ^ mask[i % 4]);
  send_raw(frame);
}

void RawViewer::send_raw(const std::string& bytes) {
  send_all(fd_, bytes);
}

std::optional<RawViewer::Message> RawViewer::receive() {
  while (true) {
    unsigned char head[2];
    if (!read_exactly(reinterpret_cast<char*>(head), 2)) return std::nullopt;
    size_t size = head[1] & 0x7F;
    if (size > 125) {
      const size_t bytes = size == 126 ? 2 : 8;
      unsigned char longer[8];
      if (!read_exactly(reinterpret_cast<char*>(longer), bytes)) return std::nullopt;
      size = 0;
      for (size_t i = 0; i < bytes; ++i) size = size << 8 | longer[i];
    }
    Message message{static_cast<uint8_t>(head[0] & 0x0F), std::string(size, '\0')};
    if (!read_exactly(message.content.data(), size)) return std::nullopt;
    if (message.opcode == 9)
      send(message.content, 10);
    else if (message.opcode != 10)
      return message;
  }
}

bool RawViewer::read_exactly(char* bytes, size_t count) {
  for (size_t got = 0; got < count;) {
    const ssize_t part = recv(fd_, bytes + got, count - got, 0);
    if (part <= 0) return false;
    got += static_cast<size_t>(part);
  }
  return true;
}

}  // namespace palpate::test
