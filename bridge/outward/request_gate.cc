#include "bridge/outward/request_gate.h"

#include <arpa/inet.h>

#include <algorithm>

namespace morphbus::bridge {
namespace {

/// In small letters, ASCII only: names of hosts have no others.
std::string Lower(std::string text) {
  for (char& c : text) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return text;
}

/// Whether what follows the name in a Host header is nothing, or a colon and a port.
bool IsPort(std::string_view rest) {
  if (rest.empty()) return true;
  return rest.front() == ':' && rest.find_first_not_of("0123456789", 1) == std::string_view::npos;
}

/// The name in a Host header, without its port and without the brackets of an IPv6 address; empty
/// if the header is neither a name nor a name and a port.
std::string HostName(const std::string& host) {
  const bool brackets = host.starts_with('[');
  const size_t end = host.find(brackets ? ']' : ':');
  if (brackets && end == std::string::npos) return "";
  const std::string name = brackets ? host.substr(1, end - 1) : Lower(host.substr(0, end));
  const size_t rest = end == std::string::npos ? host.size() : end + (brackets ? 1 : 0);
  return IsPort(std::string_view(host).substr(rest)) ? name : "";
}

/// An address as a number leads where it says, so no name server can have made it point here.
bool IsAddress(const std::string& name) {
  in6_addr ignored;
  return inet_pton(AF_INET, name.c_str(), &ignored) == 1 ||
         inet_pton(AF_INET6, name.c_str(), &ignored) == 1;
}

bool Contains(const std::vector<std::string>& list, const std::string& text) {
  return std::find(list.begin(), list.end(), text) != list.end();
}

/// Compares in a time that does not tell how much of a guess is right.
bool SameSecret(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  unsigned difference = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    difference |= static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i]);
  }
  return difference == 0;
}

/// The value of `token` in a query; empty without one.
std::string_view TokenOf(std::string_view query) {
  constexpr std::string_view kName = "token=";
  while (!query.empty()) {
    const std::string_view part = query.substr(0, query.find('&'));
    if (part.starts_with(kName)) return part.substr(kName.size());
    query.remove_prefix(std::min(query.size(), part.size() + 1));
  }
  return {};
}

/// A refusal: the HTTP status, the kind that is counted, and the reason for people.
GateAnswer Refuse(int status, const char* kind, std::string reason) {
  GateAnswer answer;
  answer.status = status;
  answer.refused = kind;
  answer.reason = std::move(reason);
  return answer;
}

/// A WebSocket's part of the decision, once Host and token have been looked at.
GateAnswer JudgeWebSocket(const RequestHead& head, const GatePolicy& policy,
                          const std::string& path, bool has_token) {
  // A browser says from which site a page comes: only our own, and those that the user allowed.
  if (head.origins.size() > 1) return Refuse(400, "malformed", "several Origin headers");
  if (!head.origins.empty()) {
    const std::string origin = Lower(head.origins.front());
    const std::string host = Lower(head.hosts.front());
    if (origin != "http://" + host && origin != "https://" + host &&
        !Contains(policy.origins, head.origins.front())) {
      return Refuse(403, "origin",
                    "pages of another site may not connect; morphbus monitor --allow-origin "
                    "allows one");
    }
  }
  if (path != "/" && path != "/ws") {
    return Refuse(404, "path", "the WebSocket is at / and at /ws");
  }
  // Whether guests may look at all is the policy's.
  if (policy.token_to_read && !has_token) {
    return Refuse(403, "token", "the URL needs the token that morphbus monitor printed");
  }
  // The first of the client's subprotocols that we speak, as RFC 6455 has it.
  for (const std::string& offered : head.protocols) {
    for (const std::string_view known : kSubprotocols) {
      if (offered != known) continue;
      GateAnswer answer;
      answer.status = 101;
      answer.protocol = offered;
      answer.has_token = has_token;
      return answer;
    }
  }
  return Refuse(400, "protocol", "the subprotocol is foxglove.websocket.v1 or foxglove.sdk.v1");
}

}  // namespace

GateAnswer JudgeRequest(const RequestHead& head, const GatePolicy& policy) {
  // A page of another site whose name was made to point here sends that name.
  if (head.hosts.size() != 1) return Refuse(400, "malformed", "expected one Host header");
  const std::string name = HostName(head.hosts.front());
  if (name != "localhost" && !IsAddress(name) && !Contains(policy.hosts, name)) {
    return Refuse(403, "host", "this server is not called so; use its address as a number");
  }
  if (head.method != "GET") return Refuse(405, "method", "only GET is served");
  // The path is only looked up: there is no folder that one could leave.
  const size_t end = head.target.find_first_of("?#");
  const std::string path = head.target.substr(0, end);
  const std::string_view query =
      end == std::string::npos ? std::string_view() : std::string_view(head.target).substr(end + 1);
  const std::string_view given = TokenOf(query);
  const bool has_token = !policy.token.empty() && SameSecret(given, policy.token);
  // A wrong token is a mistake or an attack, and no way to come in as a guest.
  if (!given.empty() && !has_token) {
    return Refuse(403, "token", "this is not the token that morphbus monitor printed");
  }
  if (head.upgrade) return JudgeWebSocket(head, policy, path, has_token);
  const auto file = policy.files.find(path == "/index.html" ? "/" : path);
  if (file == policy.files.end()) return Refuse(404, "path", "there is no such file");
  if (policy.token_to_read && !has_token && file->first == "/") {
    return Refuse(403, "token", "the URL needs the token that morphbus monitor printed");
  }
  GateAnswer answer;
  answer.file = &file->second;
  answer.has_token = has_token;
  return answer;
}

}  // namespace morphbus::bridge
