// One client of the monitor, and who is let in at all; without sockets.

#include <gtest/gtest.h>

#include "bridge/outward/client_session.h"
#include "bridge/outward/request_gate.h"

namespace morphbus::bridge {
namespace {

using nlohmann::json;

Catalogue TwoChannels() {
  Catalogue catalogue;
  catalogue.name = "test";
  catalogue.session_id = "1";
  catalogue.channels = {{"/a/state", "S", "schema", true}, {"/a/event", "E", "schema", false}};
  catalogue.services = {"/a/pause"};
  return catalogue;
}

std::shared_ptr<const std::string> Bytes(size_t size, char fill = 'x') {
  return std::make_shared<const std::string>(size, fill);
}

/// Everything that waits, texts parsed.
struct Drained {
  std::vector<json> texts;
  std::vector<OutgoingFrame> binary;
};
Drained Drain(ClientSession* session, double now_s = 0.0) {
  Drained drained;
  while (std::optional<OutgoingFrame> frame = session->Next(now_s)) {
    if (frame->binary) {
      drained.binary.push_back(*frame);
    } else {
      drained.texts.push_back(json::parse(*frame->body));
    }
  }
  return drained;
}

uint32_t U32(const OutgoingFrame& frame, size_t at) {
  uint32_t value = 0;
  for (size_t i = 0; i < 4; ++i) value |= static_cast<uint32_t>(frame.head[at + i]) << (8 * i);
  return value;
}

constexpr const char* kSubscribeBoth =
    R"({"op":"subscribe","subscriptions":[{"id":7,"channelId":1},{"id":9,"channelId":2}]})";

TEST(ClientSession, GreetsWithServerInfoChannelsAndServices) {
  const Catalogue catalogue = TwoChannels();
  ClientSession session(1, true, catalogue);
  const Drained greeting = Drain(&session);
  ASSERT_EQ(greeting.texts.size(), 3u);
  EXPECT_EQ(greeting.texts[0]["op"], "serverInfo");
  EXPECT_EQ(greeting.texts[0]["metadata"]["control"], "yes");
  EXPECT_EQ(greeting.texts[1]["channels"][0]["topic"], "/a/state");
  EXPECT_EQ(greeting.texts[1]["channels"][0]["schema"], "c2NoZW1h");
  EXPECT_EQ(greeting.texts[2]["services"][0]["name"], "/a/pause");
}

TEST(ClientSession, WhoSubscribesGetsTheLastStateButNoOldEvent) {
  const Catalogue catalogue = TwoChannels();
  ClientSession session(1, false, catalogue);
  session.Offer(0, 5, Bytes(3));
  session.Offer(1, 5, Bytes(3));
  std::vector<ClientRequest> requests;
  Drain(&session);
  session.TakeText(kSubscribeBoth, &requests);
  const Drained first = Drain(&session);
  ASSERT_EQ(first.binary.size(), 1u);
  EXPECT_EQ(first.binary[0].head[0], 1);
  EXPECT_EQ(U32(first.binary[0], 1), 7u);
  EXPECT_EQ(U32(first.binary[0], 5), 5u);
  session.Offer(1, 6, Bytes(3));
  EXPECT_EQ(Drain(&session).binary.size(), 1u);
  session.TakeText(R"({"op":"unsubscribe","subscriptionIds":[9]})", &requests);
  session.Offer(1, 7, Bytes(3));
  EXPECT_TRUE(Drain(&session).binary.empty());
}

TEST(ClientSession, ASlowClientGetsTheNewestAndACountOfTheRest) {
  const Catalogue catalogue = TwoChannels();
  ClientSession session(1, false, catalogue);
  std::vector<ClientRequest> requests;
  session.TakeText(kSubscribeBoth, &requests);
  Drain(&session);
  constexpr int64_t kSent = 100'000;
  for (int64_t i = 0; i < kSent; ++i) session.Offer(0, i, Bytes(100));
  session.Offer(1, 1, Bytes(1));
  const Drained drained = Drain(&session);
  // What is left out and what is sent make up everything; the newest is among what is sent.
  const std::string missed = std::to_string(kSent + 1 - std::ssize(drained.binary));
  EXPECT_LE(drained.binary.size(), ClientSession::kMostWaiting + 1);
  ASSERT_GE(drained.binary.size(), 2u);
  EXPECT_EQ(U32(drained.binary[drained.binary.size() - 2], 5), kSent - 1);
  ASSERT_EQ(drained.texts.size(), 1u);
  EXPECT_EQ(drained.texts[0]["op"], "status");
  EXPECT_EQ(drained.texts[0]["message"], "missed " + missed + " messages: /a/state " + missed);
}

TEST(ClientSession, WhatWaitsIsBoundedWhateverTheMessagesSize) {
  const Catalogue catalogue = TwoChannels();
  ClientSession session(1, false, catalogue);
  std::vector<ClientRequest> requests;
  session.TakeText(kSubscribeBoth, &requests);
  Drain(&session);
  for (int i = 0; i < 1000; ++i) session.Offer(0, i, Bytes(size_t{1} << 20));
  size_t bytes = 0;
  for (const OutgoingFrame& frame : Drain(&session).binary) bytes += frame.body->size();
  EXPECT_LE(bytes, ClientSession::kMostWaitingBytes);
  EXPECT_GE(bytes, size_t{1} << 20);
}

TEST(ClientSession, WhoAsksAndDoesNotReadIsGivenUp) {
  const Catalogue catalogue = TwoChannels();
  ClientSession session(1, false, catalogue);
  std::vector<ClientRequest> requests;
  for (int i = 0; i < 10'000; ++i) session.TakeText(R"({"op":"getParameters"})", &requests);
  EXPECT_TRUE(session.overrun());
  EXPECT_LE(Drain(&session).texts.size(), ClientSession::kMostAnswers);
}

TEST(ClientSession, ParametersAreGivenSetAndFollowed) {
  const Catalogue catalogue = TwoChannels();
  ClientSession session(1, true, catalogue);
  session.SetParameter("/a/paused", false);
  session.SetParameter("/a/speed", 2.0);
  Drain(&session);
  std::vector<ClientRequest> requests;
  session.TakeText(R"({"op":"getParameters","parameterNames":[],"id":"q"})", &requests);
  json values = Drain(&session).texts.at(0);
  EXPECT_EQ(values["id"], "q");
  EXPECT_EQ(values["parameters"].size(), 2u);
  session.TakeText(R"({"op":"subscribeParameterUpdates","parameterNames":["/a/paused"]})",
                   &requests);
  session.SetParameter("/a/speed", 3.0);
  session.SetParameter("/a/paused", true);
  session.SetParameter("/a/paused", true);
  const Drained updates = Drain(&session);
  ASSERT_EQ(updates.texts.size(), 1u);
  EXPECT_EQ(updates.texts[0]["parameters"][0]["value"], true);
  // Setting is somebody else's business, who is told of it once.
  session.TakeText(
      R"({"op":"setParameters","parameters":[{"name":"/a/paused","value":false}],"id":"s"})",
      &requests);
  ASSERT_EQ(requests.size(), 1u);
  EXPECT_EQ(requests[0].kind, ClientRequest::Kind::kSet);
  EXPECT_EQ(requests[0].value, false);
  EXPECT_TRUE(requests[0].may_control);
  session.AnswerSet("/a/paused", "s");
  EXPECT_EQ(Drain(&session).texts.at(0)["id"], "s");
  session.TakeText(R"({"op":"setParameters","parameters":[{"name":"/b/new","value":1}]})",
                   &requests);
  EXPECT_EQ(requests.size(), 1u);
  EXPECT_EQ(Drain(&session).texts.at(0)["op"], "status");
}

std::string Call(uint32_t service, const std::string& encoding, const std::string& payload) {
  std::string bytes = {2, static_cast<char>(service),         0, 0, 0, 5, 0, 0,
                       0, static_cast<char>(encoding.size()), 0, 0, 0};
  return bytes + encoding + payload;
}

TEST(ClientSession, ACallIsHandedOnAndAnswered) {
  const Catalogue catalogue = TwoChannels();
  ClientSession session(1, true, catalogue);
  Drain(&session);
  std::vector<ClientRequest> requests;
  session.TakeBinary(Call(1, "json", R"({"x":1})"), &requests);
  ASSERT_EQ(requests.size(), 1u);
  EXPECT_EQ(requests[0].name, "/a/pause");
  EXPECT_EQ(requests[0].call, 5u);
  EXPECT_EQ(requests[0].value["x"], 1);
  session.AnswerCall(1, 5, {{"tick", 3}});
  const Drained answer = Drain(&session);
  ASSERT_EQ(answer.binary.size(), 1u);
  EXPECT_EQ(answer.binary[0].head[0], 3);
  EXPECT_EQ(*answer.binary[0].body, R"(json{"tick":3})");
}

TEST(ClientSession, CallsThatCannotBeServedFailWithAReason) {
  const Catalogue catalogue = TwoChannels();
  ClientSession session(1, true, catalogue);
  Drain(&session);
  std::vector<ClientRequest> requests;
  session.TakeBinary(Call(2, "json", "{}"), &requests);
  session.TakeBinary(Call(1, "ros1", "{}"), &requests);
  session.TakeBinary(Call(1, "json", "[1]"), &requests);
  session.TakeBinary(Call(1, "json", "{"), &requests);
  std::string lying = Call(1, "json", "{}");
  lying[12] = static_cast<char>(0xFF);
  session.TakeBinary(lying, &requests);
  EXPECT_TRUE(requests.empty());
  const Drained refusals = Drain(&session);
  ASSERT_EQ(refusals.texts.size(), 5u);
  for (const json& refusal : refusals.texts) EXPECT_EQ(refusal["op"], "serviceCallFailure");
  // Of many calls at once only some are taken on.
  for (int i = 0; i < 100; ++i) session.TakeBinary(Call(1, "json", ""), &requests);
  EXPECT_EQ(requests.size(), ClientSession::kMostCalls);
}

/// Bytes that are written as hexadecimal digits.
std::string FromHex(const std::string& digits) {
  std::string bytes;
  for (size_t i = 0; i < digits.size(); i += 2) {
    bytes += static_cast<char>(std::stoi(digits.substr(i, 2), nullptr, 16));
  }
  return bytes;
}

/// A request for playback as Foxglove's SDK encodes it, from the snapshots of its tests
/// (rust/foxglove/src/protocol/v1/snapshots): the command, the speed 1, a seek, "some-id".
std::string PlaybackRequest(const std::string& command, const std::string& seek) {
  return FromHex("03" + command + "0000803f" + seek + "07000000736f6d652d6964");
}
constexpr const char* kNoSeek = "000000000000000000";

/// A catalogue of a log of 60 s.
Catalogue OfALog() {
  Catalogue catalogue = TwoChannels();
  catalogue.playback_ns = {0, 60'000'000'500};
  return catalogue;
}

TEST(ClientSession, PlaybackIsOfferedForLogsAndAskedForAsFoxgloveDoes) {
  const Catalogue catalogue = OfALog();
  ClientSession session(1, false, catalogue);
  const json info = Drain(&session).texts[0];
  EXPECT_EQ(info["capabilities"].back(), "playbackControl");
  EXPECT_EQ(info["dataStartTime"], json({{"sec", 0}, {"nsec", 0}}));
  EXPECT_EQ(info["dataEndTime"], json({{"sec", 60}, {"nsec", 500}}));
  std::vector<ClientRequest> requests;
  session.TakeBinary(PlaybackRequest("00", kNoSeek), &requests);
  session.TakeBinary(PlaybackRequest("01", "0115cd5b0700000000"), &requests);
  ASSERT_EQ(requests.size(), 2u);
  EXPECT_EQ(requests[0].kind, ClientRequest::Kind::kPlayback);
  EXPECT_TRUE(requests[0].playing);
  EXPECT_EQ(requests[0].speed, 1);
  EXPECT_EQ(requests[0].seek_ns, std::nullopt);
  EXPECT_EQ(requests[0].playback_id, "some-id");
  EXPECT_FALSE(requests[1].playing);
  EXPECT_EQ(requests[1].seek_ns, 123'456'789);
}

TEST(ClientSession, PlaybackStatesAreThoseOfFoxgloveAndGoToWhoKnowsThem) {
  using Status = PlaybackState::Status;
  const Catalogue catalogue = OfALog();
  ClientSession session(1, false, catalogue);
  Drain(&session);
  // Whoever speaks the older protocol alone hears nothing before it asks.
  session.SendPlayback({Status::kPlaying, 12345, 1, true, ""});
  EXPECT_TRUE(Drain(&session).binary.empty());
  std::vector<ClientRequest> requests;
  session.TakeBinary(PlaybackRequest("00", kNoSeek), &requests);
  session.SendPlayback({Status::kPlaying, 12345, 1, false, "i-am-a-request"});
  session.SendPlayback({Status::kPlaying, 12345, 1, true, ""});
  const Drained drained = Drain(&session);
  ASSERT_EQ(drained.binary.size(), 2u);
  const auto bytes = [&](size_t i) {
    const OutgoingFrame& frame = drained.binary[i];
    return std::string(frame.head.begin(), frame.head.begin() + frame.head_size) + *frame.body;
  };
  EXPECT_EQ(bytes(0), FromHex("0500"
                              "3930000000000000"
                              "0000803f"
                              "00"
                              "0e000000"
                              "692d616d2d612d72657175657374"));
  EXPECT_EQ(bytes(1), FromHex("050039300000000000000000803f0100000000"));
  ClientSession newer(2, false, catalogue, true);
  Drain(&newer);
  newer.SendPlayback({Status::kEnded, 1, 1, false, ""});
  EXPECT_EQ(Drain(&newer).binary.size(), 1u);
}

TEST(ClientSession, PlaybackThatCannotBeIsRefused) {
  const Catalogue log = OfALog(), run = TwoChannels();
  ClientSession session(1, true, log), live(2, true, run);
  Drain(&session);
  Drain(&live);
  std::vector<ClientRequest> requests;
  live.TakeBinary(PlaybackRequest("00", kNoSeek), &requests);
  EXPECT_EQ(Drain(&live).texts.at(0)["op"], "status");
  const std::string sound = PlaybackRequest("00", kNoSeek);
  for (const std::string& wrong :
       {PlaybackRequest("02", kNoSeek),                          // no such command
        FromHex("03000000000000") + sound.substr(7),             // speed 0
        FromHex("03000000c07f00") + sound.substr(7),             // speed not a number
        sound.substr(0, 12), sound.substr(0, sound.size() - 1),  // cut
        sound.substr(0, 15) + FromHex("ffffffff") + "some-id",   // an id longer than all of it
        sound.substr(0, 15) + FromHex("01010000") + std::string(257, 'x')}) {
    session.TakeBinary(wrong, &requests);
    const Drained drained = Drain(&session);
    ASSERT_EQ(drained.texts.size(), 1u);
    EXPECT_EQ(drained.texts[0]["op"], "status");
  }
  EXPECT_TRUE(requests.empty());
  // Of many at once only some are taken on.
  for (int i = 0; i < 100; ++i) session.TakeBinary(sound, &requests);
  EXPECT_EQ(requests.size(), ClientSession::kMostCalls);
}

TEST(ClientSession, WhatIsNoMessageIsAnsweredAndChangesNothing) {
  const Catalogue catalogue = TwoChannels();
  ClientSession session(1, true, catalogue);
  Drain(&session);
  std::vector<ClientRequest> requests;
  for (const char* text : {"", "{", "[]", "7", R"({"op":7})", R"({"op":"advertise"})",
                           R"({"op":"subscribe","subscriptions":[{"id":-1,"channelId":1}]})",
                           R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":99}]})",
                           R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":1e300}]})",
                           R"({"op":"subscribe","subscriptions":["x"]})",
                           R"({"op":"unsubscribe","subscriptionIds":[3]})", "\xff\xfe"}) {
    session.TakeText(text, &requests);
    const Drained drained = Drain(&session);
    ASSERT_EQ(drained.texts.size(), 1u) << text;
    EXPECT_EQ(drained.texts[0]["op"], "status") << text;
  }
  session.TakeBinary("", &requests);
  session.TakeBinary(std::string(100, '\1'), &requests);
  EXPECT_EQ(Drain(&session).texts.size(), 2u);
  EXPECT_TRUE(requests.empty());
  session.Offer(0, 1, Bytes(1));
  EXPECT_TRUE(Drain(&session).binary.empty());
}

/// A policy with one page and a token.
GatePolicy Policy(bool token_to_read) {
  GatePolicy policy;
  policy.token = "secret-token";
  policy.token_to_read = token_to_read;
  policy.hosts = {"box"};
  policy.origins = {"https://viewer.example"};
  policy.files = {{"/", {"text/html", "page"}}, {"/app.js", {"text/javascript", "code"}}};
  return policy;
}

RequestHead Get(const std::string& target, const std::string& host = "localhost:8765") {
  RequestHead head;
  head.method = "GET";
  head.target = target;
  head.hosts = {host};
  return head;
}

RequestHead Upgrade(const std::string& target, const std::vector<std::string>& origins) {
  RequestHead head = Get(target);
  head.upgrade = true;
  head.origins = origins;
  head.protocols = {"unknown", "foxglove.sdk.v1", "foxglove.websocket.v1"};
  return head;
}

TEST(RequestGate, OnlyNamesThatNobodyCanPointHereAreServed) {
  const GatePolicy policy = Policy(false);
  for (const char* host :
       {"localhost", "LOCALHOST:1", "127.0.0.1:8765", "[::1]:8765", "10.0.0.7", "box:8765"}) {
    EXPECT_EQ(JudgeRequest(Get("/", host), policy).status, 200) << host;
  }
  for (const char* host : {"evil.example", "evil.example:8765", "localhost.evil.example", "", "[",
                           "127.0.0.1.evil.example", "1", "[::1", "localhost@evil"}) {
    EXPECT_EQ(JudgeRequest(Get("/", host), policy).refused, "host") << host;
  }
  RequestHead two = Get("/");
  two.hosts.emplace_back("evil.example");
  EXPECT_EQ(JudgeRequest(two, policy).refused, "malformed");
  two.hosts.clear();
  EXPECT_EQ(JudgeRequest(two, policy).refused, "malformed");
}

TEST(RequestGate, PagesOfOtherSitesMayNotConnect) {
  const GatePolicy policy = Policy(false);
  for (const std::vector<std::string>& origins : std::vector<std::vector<std::string>>{
           {}, {"http://localhost:8765"}, {"https://viewer.example"}}) {
    EXPECT_EQ(JudgeRequest(Upgrade("/", origins), policy).status, 101);
  }
  for (const char* origin : {"http://evil.example", "null", "", "file://", "http://localhost",
                             "http://localhost:8766", "http://localhost:8765.evil.example"}) {
    EXPECT_EQ(JudgeRequest(Upgrade("/", {origin}), policy).refused, "origin") << origin;
  }
  const std::vector<std::string> both = {"http://localhost:8765", "http://evil.example"};
  EXPECT_EQ(JudgeRequest(Upgrade("/", both), policy).refused, "malformed");
}

TEST(RequestGate, TheFirstKnownSubprotocolThatWasOfferedIsTaken) {
  const GatePolicy policy = Policy(false);
  EXPECT_EQ(JudgeRequest(Upgrade("/ws", {}), policy).protocol, "foxglove.sdk.v1");
  RequestHead head = Upgrade("/", {});
  head.protocols = {"chat"};
  EXPECT_EQ(JudgeRequest(head, policy).refused, "protocol");
}

TEST(RequestGate, TheTokenDecidesWhatOneMay) {
  const GatePolicy open = Policy(false), closed = Policy(true);
  EXPECT_FALSE(JudgeRequest(Upgrade("/", {}), open).has_token);
  EXPECT_TRUE(JudgeRequest(Upgrade("/?token=secret-token", {}), open).has_token);
  EXPECT_TRUE(JudgeRequest(Upgrade("/?a=b&token=secret-token&c", {}), open).has_token);
  EXPECT_EQ(JudgeRequest(Upgrade("/?token=secret-tokem", {}), open).refused, "token");
  EXPECT_EQ(JudgeRequest(Upgrade("/", {}), closed).refused, "token");
  EXPECT_EQ(JudgeRequest(Upgrade("/?token=", {}), closed).refused, "token");
  EXPECT_EQ(JudgeRequest(Upgrade("/?token=secret-token", {}), closed).status, 101);
  EXPECT_EQ(JudgeRequest(Get("/"), closed).refused, "token");
  EXPECT_EQ(JudgeRequest(Get("/?token=secret-token"), closed).status, 200);
  EXPECT_EQ(JudgeRequest(Get("/app.js"), closed).status, 200);
  // Without a token in the policy nothing has it.
  GatePolicy none = closed;
  none.token.clear();
  EXPECT_EQ(JudgeRequest(Upgrade("/?token=", {}), none).refused, "token");
}

TEST(RequestGate, OnlyThePagesOwnFilesAreServed) {
  const GatePolicy policy = Policy(false);
  EXPECT_EQ(JudgeRequest(Get("/index.html"), policy).file->bytes, "page");
  EXPECT_EQ(JudgeRequest(Get("/app.js?x"), policy).file->bytes, "code");
  for (const char* target : {"/../../etc/passwd", "/%2e%2e/etc/passwd", "//etc/passwd", "", "*",
                             "/app.js/", "/app.js%00", "\\app.js", "app.js", "/./app.js"}) {
    EXPECT_EQ(JudgeRequest(Get(target), policy).refused, "path") << target;
  }
  RequestHead post = Get("/");
  post.method = "POST";
  EXPECT_EQ(JudgeRequest(post, policy).refused, "method");
  EXPECT_EQ(JudgeRequest(Upgrade("/app.js", {}), policy).refused, "path");
}

}  // namespace
}  // namespace morphbus::bridge
