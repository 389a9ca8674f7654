#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace palpate::test {

/// Everything the console at `port` of the loopback answers to these bytes before it closes or falls silent.
std::string answer_to(int port, const std::string& bytes);
/// The answer to GET with these header lines ("Host: a\r\n").
std::string get(int port, const std::string& target, const std::string& headers);
std::string get(int port, const std::string& target);
int status_of(const std::string& answer);

/// A WebSocket of RFC 6455 that shares no code with what it speaks to.
class RawViewer {
 public:
  /// `headers`: further lines of the request.
  explicit RawViewer(int port, const std::string& headers = "");
  ~RawViewer();
  RawViewer(const RawViewer&) = delete;
  RawViewer& operator=(const RawViewer&) = delete;

  const std::string& handshake() const { return handshake_; }
  void send(const std::string& text, uint8_t opcode = 1);
  void send_raw(const std::string& bytes);

  struct Message {
    uint8_t opcode = 0;  ///< 1 text, 2 bytes, 8 close
    std::string content;
  };
  /// Pings are answered; nothing where the other side has closed.
  std::optional<Message> receive();

 private:
  bool read_exactly(char* bytes, size_t count);
  int fd_;
  std::string handshake_;
};

}  // namespace palpate::test
