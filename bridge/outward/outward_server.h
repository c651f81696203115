#pragma once
// The monitor's server: files of a page over HTTP, and runs over Foxglove's WebSocket protocol,
// both on one port (docs/monitor-protocol.md). Boost.Beast stands behind it and is compiled in one
// file.

#include <cstddef>
#include <memory>
#include <string>

#include "bridge/outward/request_gate.h"
#include "bridge/outward/session_hub.h"
#include "compiler/base/result.h"

namespace morphbus::bridge {

/// Where the server listens, and whom it lets in.
struct ServerOptions {
  std::string address = "127.0.0.1";  ///< Of an interface, as a number.
  int port = 0;                       ///< 0: any that is free.
  GatePolicy gate;
  // What may be there at one time: connections of any kind, and WebSockets without the token.
  int most_connections = 64;
  int most_guests = 16;
  int head_timeout_ms = 5000;           ///< For a request's head to arrive, and for a handshake.
  size_t most_head_bytes = 8192;        ///< Of a request.
  size_t most_message_bytes = 1 << 20;  ///< Of a client's message.
};

/// Serves in a thread of its own.
class OutwardServer {
 public:
  /// Opens the port, and nothing more: connections wait until Start(). Fails, in one sentence, if
  /// the address is none or the port is taken.
  static Result<std::unique_ptr<OutwardServer>> Open(ServerOptions options);
  /// Closes all connections.
  ~OutwardServer();
  OutwardServer(const OutwardServer&) = delete;
  OutwardServer& operator=(const OutwardServer&) = delete;

  /// The port that it listens on.
  [[nodiscard]] int port() const;
  /// Begins to serve. Call once, when the process will enter no other namespace any more.
  void Start(Catalogue catalogue);
  /// Its clients: where sources publish, and learn what clients want. From Start() on.
  [[nodiscard]] SessionHub& hub();

 private:
  class Impl;
  explicit OutwardServer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace morphbus::bridge
