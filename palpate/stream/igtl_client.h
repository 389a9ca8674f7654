#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "palpate/stream/address.h"
#include "palpate/stream/igtl_messages.h"
#include "palpate/stream/igtl_reader.h"

namespace palpate {

enum class IgtlKind { status, tip, force, state, tip_2, force_2, state_2, surface, overlay };
inline constexpr size_t kIgtlKinds = 9;

/// One client of the server: its socket and what waits for it. Never blocks.
class IgtlClient {
 public:
  IgtlClient(Descriptor socket, int64_t now_ns);

  /// Takes the place of what waits of the same kind; true where something was replaced.
  bool offer(IgtlKind kind, IgtlBytes bytes, int64_t decoded_ns);
  /// Nothing that waits is sent any more.
  void forget_waiting();
  bool wants_to_write() const;

  struct Written {
    uint64_t bytes = 0, messages = 0;
    std::vector<int64_t> tips_decoded_ns;  ///< of each PalpateTip that was written in full
  };
  /// Writes what the system takes now; false when the connection is gone.
  bool write(int64_t now_ns, Written& written);
  /// Reads what has come; false when the connection is gone or speaks something else.
  bool read(const std::function<void(const IgtlReceived&)>& on_message);

  int fd() const { return socket_.get(); }
  int64_t connected_ns() const { return connected_ns_; }
  /// Since when it has taken nothing though something waits; 0 = it takes.
  int64_t stuck_since_ns() const { return stuck_since_ns_; }
  bool asks = false;  ///< gets answers only

 private:
  struct Waiting {
    IgtlBytes bytes;
    int64_t decoded_ns = 0;
  };
  bool begin_next();

  Descriptor socket_;
  int64_t connected_ns_;
  int64_t stuck_since_ns_ = 0;
  std::array<Waiting, kIgtlKinds> waiting_;
  size_t next_kind_ = 0;  ///< in turn, so that no kind starves another
  size_t current_kind_ = 0;
  Waiting current_;
  size_t current_done_ = 0;
  IgtlReader reader_;
};

}  // namespace palpate
