// Whatever a client of the monitor sends, its session keeps a bounded amount and answers in JSON.
// The input is a row of messages: a byte that says text or binary, two of length, and the message.

#include <string_view>

#include "bridge/outward/client_session.h"
#include "bridge/outward/request_gate.h"
#include "compiler/base/check.h"

using morphbus::bridge::Catalogue;
using morphbus::bridge::ClientRequest;
using morphbus::bridge::ClientSession;
using morphbus::bridge::GatePolicy;
using morphbus::bridge::JudgeRequest;
using morphbus::bridge::OutgoingFrame;
using morphbus::bridge::RequestHead;

namespace {

/// Judges the input as a request's head: no target, host or origin may be anything but let in or
/// counted.
void Judge(std::string_view text) {
  GatePolicy policy;
  policy.token = "secret-token";
  policy.files = {{"/", {"text/html", "page"}}};
  RequestHead head;
  head.method = "GET";
  head.target = text;
  head.hosts = {std::string(text.substr(0, text.find('\n')))};
  head.upgrade = text.size() % 2 == 0;
  if (text.size() % 3 == 0) head.origins = {std::string(text)};
  head.protocols = {"foxglove.sdk.v1"};
  const auto verdict = JudgeRequest(head, policy);
  MORPHBUS_CHECK(verdict.refused.empty() == (verdict.status == 200 || verdict.status == 101));
  // Nobody guesses the token who does not have it.
  MORPHBUS_CHECK(!verdict.has_token || text.find("secret-token") != std::string_view::npos);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  std::string_view rest(reinterpret_cast<const char*>(data), size);
  Judge(rest);
  Catalogue catalogue;
  catalogue.channels = {{"/a/tf", "S", "x", true}, {"/a/log", "L", "x", false}};
  catalogue.services = {"/a/pause", "/a/step"};
  ClientSession session(1, true, catalogue);
  session.SetParameter("/a/paused", false);
  session.SetParameter("/a/speed", 1.0);
  const auto body = std::make_shared<const std::string>(1000, 'x');
  std::vector<ClientRequest> requests;
  double now_s = 0;
  while (rest.size() >= 3) {
    const bool text = rest[0] % 2 == 0;
    const size_t length = std::min<size_t>(
        rest.size() - 3, static_cast<uint8_t>(rest[1]) * 256U + static_cast<uint8_t>(rest[2]));
    const std::string_view message = rest.substr(3, length);
    rest.remove_prefix(3 + length);
    if (text) {
      session.TakeText(message, &requests);
    } else {
      session.TakeBinary(message, &requests);
    }
    session.Offer(0, 1, body);
    session.Offer(1, 1, body);
    MORPHBUS_CHECK(requests.size() <= ClientSession::kMostCalls);
    // Every other client reads; what it reads is JSON, or a frame with its head.
    for (int i = 0; size % 2 == 0 && i < 4; ++i) {
      const std::optional<OutgoingFrame> frame = session.Next(now_s += 0.1);
      if (!frame) break;
      MORPHBUS_CHECK(frame->binary || nlohmann::json::accept(*frame->body));
      MORPHBUS_CHECK(frame->binary == (frame->head_size > 0));
    }
  }
  size_t waiting = 0;
  while (session.Next(now_s)) ++waiting;
  MORPHBUS_CHECK(waiting <= ClientSession::kMostWaiting + ClientSession::kMostAnswers + 3);
  return 0;
}
