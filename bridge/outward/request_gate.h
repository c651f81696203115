#pragma once
// Who may ask the monitor's server for what: decided by a request's head alone, before anything is
// done for it (docs/monitor-protocol.md, Safety).

#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace morphbus::bridge {

/// What a request's head says. Names of headers are not case-sensitive, so they are fields here.
struct RequestHead {
  std::string method;                  ///< "GET"
  std::string target;                  ///< "/?token=…"
  std::vector<std::string> hosts;      ///< Every Host header; a sound request has one.
  std::vector<std::string> origins;    ///< Every Origin header; browsers send one, programs none.
  bool upgrade = false;                ///< Whether it asks for a WebSocket.
  std::vector<std::string> protocols;  ///< The subprotocols that it offers, in its order.
};

/// A file of the page.
struct PageFile {
  std::string type;  ///< MIME type.
  std::string bytes;
};

/// What the server allows.
struct GatePolicy {
  std::string token;           ///< Never empty.
  bool token_to_read = false;  ///< Whether even reading needs the token.
  /// Names by which the server may be called besides "localhost" and addresses as numbers.
  std::vector<std::string> hosts;
  /// Origins whose pages may connect besides the server's own.
  std::vector<std::string> origins;
  std::map<std::string, PageFile> files;  ///< By path: "/", "/app.js".
};

/// What a request gets.
struct GateAnswer {
  int status = 200;  ///< HTTP status; 101: a WebSocket.
  /// By what kind a refused request is counted: "host", "origin", "token", "path", "method",
  /// "malformed" or "protocol"; empty if it is not refused.
  std::string refused;
  std::string reason;              ///< Of a refusal, for people.
  const PageFile* file = nullptr;  ///< What is served; null without one.
  std::string protocol;            ///< The subprotocol of a WebSocket.
  bool has_token = false;          ///< Whether the request gave the token.
};

/// The subprotocols that the server speaks.
inline constexpr std::string_view kSdkProtocol = "foxglove.sdk.v1";
inline constexpr std::string_view kSubprotocols[] = {"foxglove.websocket.v1", kSdkProtocol};

/// Decides on a request. `policy` outlives the answer, which points into it.
GateAnswer JudgeRequest(const RequestHead& head, const GatePolicy& policy);

}  // namespace morphbus::bridge
