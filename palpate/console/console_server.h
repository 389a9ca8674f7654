#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "palpate/session/session.h"

namespace palpate {

struct ConsoleOptions {
  std::string address = "127.0.0.1";
  int port = 8090;              ///< 0 = any that is free
  bool asks_for_token = false;  ///< of every viewer
  bool may_open_live = false;   ///< viewers may open devices, pipelines and addresses
  std::filesystem::path page;   ///< folder of the built page
};

struct ConsoleCounts {
  int viewers = 0;
  uint64_t pictures_sent = 0;
  uint64_t pictures_replaced = 0;  ///< a newer one came before they were sent
};

/// Serves the operator's page and, over one WebSocket per viewer, a session: its state as JSON, pictures and shapes as
/// bytes. At most one write waits on each socket; the newest wins, so a viewer that stalls costs nobody anything.
///
/// Bytes sent: kind (uint32: 1 = picture, 2 = shape), frame (int32), age (double, ms: since both pictures of the frame
/// were there, of a live source since its stamp), then a JPEG or a shape (palpate/session/shape.h).
class ConsoleServer {
 public:
  /// Throws BadInput: an address or port that cannot be listened on.
  ConsoleServer(const ConsoleOptions& options, RootFolder root);
  ~ConsoleServer();

  Session& session();
  int port() const;
  const std::string& token() const;  ///< empty where none is asked for
  bool has_page() const;
  ConsoleCounts counts() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace palpate
