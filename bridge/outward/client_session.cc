#include "bridge/outward/client_session.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "compiler/base/base64.h"
#include "compiler/base/text.h"

namespace morphbus::bridge {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

/// Seconds between two messages on what was missed.
constexpr double kTellMissedEvery = 1.0;
/// How much of a client's words is told back to it, bytes.
constexpr size_t kMostQuoted = 80;

/// Little-endian, as the protocol has all its numbers.
template <class T>
void Put(T value, OutgoingFrame* frame) {
  for (size_t i = 0; i < sizeof(T); ++i) {
    frame->head[frame->head_size++] = static_cast<uint8_t>(value >> (8 * i));
  }
}

/// The little-endian number at a place; four bytes must be there.
uint32_t ReadU32(std::string_view bytes, size_t at) {
  uint32_t value = 0;
  for (size_t i = 0; i < 4; ++i) {
    value |= static_cast<uint32_t>(static_cast<uint8_t>(bytes[at + i])) << (8 * i);
  }
  return value;
}

/// The same of eight bytes.
uint64_t ReadU64(std::string_view bytes, size_t at) {
  return ReadU32(bytes, at) | static_cast<uint64_t>(ReadU32(bytes, at + 4)) << 32;
}

/// A time as the protocol writes it into JSON.
ordered_json TimeJson(int64_t time_ns) {
  return {{"sec", time_ns / 1'000'000'000}, {"nsec", time_ns % 1'000'000'000}};
}

/// A whole number of 32 bits; nothing if the JSON is anything else.
std::optional<uint32_t> ToU32(const json& value) {
  const uint64_t number = value.is_number_unsigned() ? value.get<uint64_t>() : UINT64_MAX;
  return number <= UINT32_MAX ? std::optional(static_cast<uint32_t>(number)) : std::nullopt;
}

/// The member of an object that is an array; an empty one if there is none.
const json& ArrayIn(const json& message, const char* name) {
  static const json kNone = json::array();
  const auto found = message.find(name);
  return found != message.end() && found->is_array() ? *found : kNone;
}

/// The member of an object that is a text; "" if there is none.
std::string TextIn(const json& message, const char* name) {
  const auto found = message.find(name);
  return found != message.end() && found->is_string() ? found->get<std::string>() : "";
}

/// The texts in an array; what is no text is passed over.
std::vector<std::string> TextsIn(const json& message, const char* name) {
  std::vector<std::string> texts;
  for (const json& entry : ArrayIn(message, name)) {
    if (entry.is_string()) texts.push_back(entry.get<std::string>());
  }
  return texts;
}

/// What a client wrote, cut and with nothing in it that could steer a terminal.
std::string Quote(const std::string& text) {
  return "'" + EscapeControl(text.substr(0, kMostQuoted)) + "'";
}

}  // namespace

ClientSession::ClientSession(uint64_t id, bool may_control, const Catalogue& catalogue,
                             bool knows_playback)
    : id_(id), may_control_(may_control), knows_playback_(knows_playback), catalogue_(catalogue) {
  // Channels are known by their place in the catalogue, as in all lists below.
  subscriptions_.resize(catalogue.channels.size());
  last_.resize(catalogue.channels.size());
  missed_.resize(catalogue.channels.size());
  // Who we are, and whether this client may control anything.
  ordered_json metadata = catalogue.metadata;
  metadata["control"] = may_control ? "yes" : "no";
  ordered_json info = {{"op", "serverInfo"},
                       {"name", catalogue.name},
                       {"capabilities", {"parameters", "parametersSubscribe", "services", "time"}},
                       {"supportedEncodings", {"json"}},
                       {"metadata", metadata},
                       {"sessionId", catalogue.session_id}};
  if (catalogue.playback_ns) {
    info["capabilities"].push_back("playbackControl");
    info["dataStartTime"] = TimeJson(catalogue.playback_ns->first);
    info["dataEndTime"] = TimeJson(catalogue.playback_ns->second);
  }
  Answer(info);
  // Each channel brings its whole schema, so that the client needs nothing else.
  ordered_json channels = ordered_json::array();
  for (size_t c = 0; c < catalogue.channels.size(); ++c) {
    const AdvertisedChannel& channel = catalogue.channels[c];
    channels.push_back({{"id", c + 1},
                        {"topic", channel.topic},
                        {"encoding", "protobuf"},
                        {"schemaName", channel.schema_name},
                        {"schema", Base64(channel.schema)},
                        {"schemaEncoding", "protobuf"}});
  }
  Answer({{"op", "advertise"}, {"channels", channels}});
  // Services take and give JSON objects; which members they have, the documentation says.
  const ordered_json schema = {{"encoding", "json"},
                               {"schemaName", "object"},
                               {"schemaEncoding", "jsonschema"},
                               {"schema", R"({"type":"object"})"}};
  ordered_json services = ordered_json::array();
  for (size_t s = 0; s < catalogue.services.size(); ++s) {
    services.push_back({{"id", s + 1},
                        {"name", catalogue.services[s]},
                        {"type", "json"},
                        {"request", schema},
                        {"response", schema}});
  }
  if (!services.empty()) Answer({{"op", "advertiseServices"}, {"services", services}});
}

// Whoever publishes never waits: where a client is slow, older messages make room for newer ones.
void ClientSession::Push(Waiting waiting) {
  // Answers always find a place here, since Answer() has its own limit.
  const size_t size = waiting.frame.head_size + waiting.frame.body->size();
  // What is left of other channels after this is at most one message each.
  if (waiting.channel >= 0 &&
      (waiting_.size() >= kMostWaiting || waiting_bytes_ + size > kMostWaitingBytes)) {
    Compact();
    // Even the one of this channel that was left goes, since a newer one comes.
    const auto older = std::ranges::find(waiting_, waiting.channel, &Waiting::channel);
    if (older != waiting_.end()) {
      waiting_bytes_ -= older->frame.head_size + older->frame.body->size();
      waiting_.erase(older);
      ++missed_[waiting.channel];
      ++missed_total_;
    }
  }
  waiting_bytes_ += size;
  waiting_.push_back(std::move(waiting));
}

void ClientSession::Compact() {
  // From the newest to the oldest: the first that is met of each channel stays.
  std::set<int> seen;
  std::deque<Waiting> kept;
  for (auto it = waiting_.rbegin(); it != waiting_.rend(); ++it) {
    if (it->channel == kAnswer || seen.insert(it->channel).second) {
      kept.push_front(std::move(*it));
      continue;
    }
    waiting_bytes_ -= it->frame.head_size + it->frame.body->size();
    if (it->channel < 0) continue;
    ++missed_[it->channel];
    ++missed_total_;
  }
  waiting_ = std::move(kept);
}

void ClientSession::Answer(OutgoingFrame frame) {
  // A client that asks and does not read is no client.
  if (answers_ >= kMostAnswers) overrun_ = true;
  if (overrun_) return;
  ++answers_;
  Push({kAnswer, std::move(frame)});
}

void ClientSession::Answer(const ordered_json& message) {
  OutgoingFrame frame;
  // What a client wrote may be told back to it, and need not be UTF-8.
  frame.body = std::make_shared<const std::string>(
      message.dump(-1, ' ', false, ordered_json::error_handler_t::replace));
  Answer(std::move(frame));
}

void ClientSession::Offer(size_t channel, int64_t time_ns,
                          std::shared_ptr<const std::string> bytes) {
  // The last state is kept for this client whether it has subscribed or not: it may do so later.
  if (catalogue_.channels[channel].is_state) last_[channel] = {time_ns, bytes};
  if (!subscriptions_[channel]) return;
  Waiting waiting;
  waiting.channel = static_cast<int>(channel);
  // Message data: kind 1, the client's subscription, time, and the message as it is.
  waiting.frame.binary = true;
  Put(uint8_t{1}, &waiting.frame);
  Put(*subscriptions_[channel], &waiting.frame);
  Put(static_cast<uint64_t>(time_ns), &waiting.frame);
  waiting.frame.body = std::move(bytes);
  Push(std::move(waiting));
}

void ClientSession::OfferTime(int64_t time_ns) {
  static const auto kEmpty = std::make_shared<const std::string>();
  Waiting waiting;
  waiting.channel = kTime;
  // Time: kind 2 and nanoseconds.
  waiting.frame.binary = true;
  Put(uint8_t{2}, &waiting.frame);
  Put(static_cast<uint64_t>(time_ns), &waiting.frame);
  waiting.frame.body = kEmpty;
  // An older time that has not gone out has become worthless, and its place is taken.
  const auto older = std::ranges::find(waiting_, kTime, &Waiting::channel);
  if (older != waiting_.end()) {
    older->frame = std::move(waiting.frame);
  } else {
    Push(std::move(waiting));
  }
}

bool ClientSession::HasRoom() const {
  // The other half is for what comes before this is asked again.
  return waiting_.size() < kMostWaiting / 2 && waiting_bytes_ < kMostWaitingBytes / 2;
}

std::optional<OutgoingFrame> ClientSession::Next(double now_s) {
  // What was missed is told before what comes after it.
  if (missed_total_ > 0 && now_s - told_missed_s_ >= kTellMissedEvery) {
    told_missed_s_ = now_s;
    std::string text = "missed " + Counted(missed_total_, "message") + ":";
    const char* separator = " ";
    // By channel, so that the client sees what it should subscribe less of.
    for (size_t c = 0; c < missed_.size(); ++c) {
      if (missed_[c] == 0) continue;
      text += separator + catalogue_.channels[c].topic + " " + std::to_string(missed_[c]);
      separator = ", ";
      missed_[c] = 0;
    }
    missed_total_ = 0;
    OutgoingFrame frame;
    frame.body = std::make_shared<const std::string>(
        ordered_json({{"op", "status"}, {"level", 1}, {"message", text}, {"id", "missed"}}).dump());
    return frame;
  }
  // Else frames go out in the order in which they came.
  if (waiting_.empty()) return std::nullopt;
  Waiting next = std::move(waiting_.front());
  waiting_.pop_front();
  waiting_bytes_ -= next.frame.head_size + next.frame.body->size();
  if (next.channel == kAnswer) --answers_;
  return std::move(next.frame);
}

void ClientSession::TakeText(std::string_view text, std::vector<ClientRequest>* requests) {
  // Any bytes may come; what is no JSON parses to no object.
  const json message = json::parse(text, nullptr, false);
  if (!message.is_object()) return SendStatus(2, "expected a JSON object");
  const std::string op = TextIn(message, "op");
  if (op == "subscribe") return Subscribe(message);
  if (op == "unsubscribe") return Unsubscribe(message);
  if (op == "getParameters") return GetParameters(message);
  if (op == "setParameters") return SetParameters(message, requests);
  if (op == "subscribeParameterUpdates") return SubscribeParameters(message, true);
  if (op == "unsubscribeParameterUpdates") return SubscribeParameters(message, false);
  SendStatus(2, "the operation " + Quote(op) + " is not one of this server");
}

void ClientSession::Subscribe(const json& message) {
  for (const json& entry : ArrayIn(message, "subscriptions")) {
    // Both ids are numbers: the channel's is ours, from 1 on, the subscription's the client chose.
    const auto id = entry.is_object() && entry.contains("id") ? ToU32(entry["id"]) : std::nullopt;
    const uint32_t channel = entry.is_object() && entry.contains("channelId")
                                 ? ToU32(entry["channelId"]).value_or(0)
                                 : 0;
    if (!id || channel < 1 || channel > subscriptions_.size()) {
      SendStatus(2, "subscribe: there is no such channel");
      return;  // One answer a message, whatever it lists.
    }
    // A subscription has one channel and a channel one subscription.
    const bool id_in_use =
        std::find(subscriptions_.begin(), subscriptions_.end(), *id) != subscriptions_.end();
    if (subscriptions_[channel - 1] || id_in_use) {
      SendStatus(1, "subscribe: channel " + std::to_string(channel) + " or id " +
                        std::to_string(*id) + " has a subscription already");
      return;
    }
    // It begins with what it would know had it been here earlier.
    subscriptions_[channel - 1] = *id;
    const Last last = last_[channel - 1];
    if (last.bytes != nullptr) Offer(channel - 1, last.time_ns, last.bytes);
  }
}

void ClientSession::Unsubscribe(const json& message) {
  for (const json& entry : ArrayIn(message, "subscriptionIds")) {
    const std::optional<uint32_t> id = ToU32(entry);
    const auto found =
        id ? std::find(subscriptions_.begin(), subscriptions_.end(), *id) : subscriptions_.end();
    if (found == subscriptions_.end()) {
      SendStatus(1, "unsubscribe: there is no such subscription");
      return;
    }
    found->reset();
  }
}

void ClientSession::SendParameters(const std::vector<std::string>& names, const std::string& id) {
  ordered_json list = ordered_json::array();
  for (const auto& [name, value] : parameters_) {
    // A request without names is for all of them.
    if (!names.empty() && std::find(names.begin(), names.end(), name) == names.end()) continue;
    ordered_json entry = {{"name", name}, {"value", value}};
    // JSON does not tell 1 from 1.0, so that the type is named.
    if (value.is_number()) entry["type"] = "float64";
    list.push_back(std::move(entry));
  }
  ordered_json message = {{"op", "parameterValues"}, {"parameters", std::move(list)}};
  if (!id.empty()) message["id"] = id;
  Answer(message);
}

void ClientSession::GetParameters(const json& message) {
  SendParameters(TextsIn(message, "parameterNames"), TextIn(message, "id"));
}

void ClientSession::SetParameters(const json& message, std::vector<ClientRequest>* requests) {
  for (const json& entry : ArrayIn(message, "parameters")) {
    const std::string name = entry.is_object() ? TextIn(entry, "name") : "";
    // Parameters are what the sources declared; a client makes none.
    if (!parameters_.contains(name) || !entry.contains("value")) {
      SendStatus(2, "setParameters: there is no parameter " + Quote(name) + " to be set");
      return;
    }
    // A set counts as a call until it is answered, so that a client cannot pile them up.
    if (++calls_ > kMostCalls) {
      --calls_;
      SendStatus(2, "setParameters: too many requests are under way");
      return;
    }
    ClientRequest request;
    // Whether the client may set it, the source decides when it takes the request.
    request.kind = ClientRequest::Kind::kSet;
    request.client = id_;
    request.may_control = may_control_;
    request.name = name;
    request.value = entry["value"];
    request.set_id = TextIn(message, "id");
    requests->push_back(std::move(request));
  }
}

void ClientSession::SubscribeParameters(const json& message, bool subscribe) {
  const std::vector<std::string> names = TextsIn(message, "parameterNames");
  // No names stand for all parameters, those to come included.
  if (names.empty()) {
    all_parameters_ = subscribe;
    subscribed_parameters_.clear();
  }
  for (const std::string& name : names) {
    // Unknown names are passed over, so that a client cannot make the set grow.
    if (!parameters_.contains(name)) continue;
    if (subscribe) {
      subscribed_parameters_.insert(name);
    } else {
      subscribed_parameters_.erase(name);
    }
  }
}

void ClientSession::SetParameter(const std::string& name, const json& value) {
  json& current = parameters_[name];
  // Sources set their parameters again and again; clients hear of changes only.
  if (current == value) return;
  current = value;
  if (all_parameters_ || subscribed_parameters_.contains(name)) SendParameters({name}, "");
}

void ClientSession::AnswerSet(const std::string& name, const std::string& set_id) {
  if (calls_ > 0) --calls_;
  // Only a request that has an id is answered (the protocol's rule).
  if (!set_id.empty()) SendParameters({name}, set_id);
}

void ClientSession::TakeBinary(std::string_view bytes, std::vector<ClientRequest>* requests) {
  constexpr char kServiceCall = 2, kPlaybackControl = 3;
  if (bytes.starts_with(kServiceCall)) return Call(bytes, requests);
  if (bytes.starts_with(kPlaybackControl)) return RequestPlayback(bytes, requests);
  SendStatus(2, "the binary message is none that this server takes");
}

// The layout is that of PlaybackControlRequest in Foxglove's SDK (rust/foxglove/src/protocol).
void ClientSession::RequestPlayback(std::string_view bytes, std::vector<ClientRequest>* requests) {
  constexpr size_t kHead = 19;  // Kind, command, speed, whether to seek, time, size of the id.
  constexpr size_t kMostIdBytes = 256;
  if (!catalogue_.playback_ns) return SendStatus(2, "only logs can be played");
  const uint32_t id_size = bytes.size() < kHead ? UINT32_MAX : ReadU32(bytes, 15);
  if (id_size > kMostIdBytes || id_size > bytes.size() - kHead) {
    return SendStatus(2, "the request for playback is cut, or its id has more than 256 bytes");
  }
  const auto command = static_cast<uint8_t>(bytes[1]);
  ClientRequest request;
  request.speed = std::bit_cast<float>(ReadU32(bytes, 2));
  if (command > 1 || !std::isfinite(request.speed) || request.speed <= 0) {
    return SendStatus(2, "playback takes the commands 0 (play) and 1 (pause), and a speed above 0");
  }
  request.kind = ClientRequest::Kind::kPlayback;
  request.client = id_;
  request.may_control = may_control_;
  request.playing = command == 0;
  if (bytes[6] != 0) {
    request.seek_ns = static_cast<int64_t>(std::min<uint64_t>(ReadU64(bytes, 7), INT64_MAX));
  }
  request.playback_id = bytes.substr(kHead, id_size);
  knows_playback_ = true;
  if (++calls_ > kMostCalls) {
    --calls_;
    return SendStatus(2, "too many requests are under way");
  }
  requests->push_back(std::move(request));
}

// The layout is that of PlaybackState in Foxglove's SDK.
void ClientSession::SendPlayback(const PlaybackState& state) {
  if (!state.request.empty() && calls_ > 0) --calls_;
  if (!knows_playback_) return;
  OutgoingFrame head;
  head.binary = true;
  Put(uint8_t{5}, &head);
  Put(static_cast<uint8_t>(state.status), &head);
  Put(static_cast<uint64_t>(state.time_ns), &head);
  std::string body;
  const auto add = [&](uint32_t value) {
    for (int i = 0; i < 4; ++i) body += static_cast<char>(value >> (8 * i));
  };
  add(std::bit_cast<uint32_t>(state.speed));
  body += static_cast<char>(state.did_seek ? 1 : 0);
  add(static_cast<uint32_t>(state.request.size()));
  head.body = std::make_shared<const std::string>(body + state.request);
  Answer(std::move(head));
}

void ClientSession::Call(std::string_view bytes, std::vector<ClientRequest>* requests) {
  constexpr size_t kHead = 13;  // Kind, service, call, size of the encoding's name.
  if (bytes.size() < kHead) return SendStatus(2, "the call of a service is cut");
  const uint32_t service = ReadU32(bytes, 1), call = ReadU32(bytes, 5);
  const uint32_t encoding_size = ReadU32(bytes, 9);
  ++calls_;  // Undone by the answer or the refusal, of which every call gets one.
  if (service < 1 || service > catalogue_.services.size()) {
    return RefuseCall(service, call, "there is no such service");
  }
  // The length is the client's word, and must fit what came.
  if (encoding_size > bytes.size() - kHead ||
      bytes.substr(kHead, encoding_size) != std::string_view("json")) {
    return RefuseCall(service, call, "the encoding of requests is json");
  }
  if (calls_ > kMostCalls) return RefuseCall(service, call, "too many requests are under way");
  const std::string_view payload = bytes.substr(kHead + encoding_size);
  // No request at all is an empty one.
  json value = payload.empty() ? json::object() : json::parse(payload, nullptr, false);
  if (!value.is_object()) return RefuseCall(service, call, "expected a JSON object");
  ClientRequest request;
  // The source that the service belongs to answers, perhaps from another thread.
  request.kind = ClientRequest::Kind::kCall;
  request.client = id_;
  request.may_control = may_control_;
  request.service = service;
  request.call = call;
  request.name = catalogue_.services[service - 1];
  request.value = std::move(value);
  requests->push_back(std::move(request));
}

void ClientSession::AnswerCall(uint32_t service, uint32_t call, const json& answer) {
  if (calls_ > 0) --calls_;
  OutgoingFrame frame;
  // A service's response: kind 3, service, call, and the encoding with its length.
  frame.binary = true;
  Put(uint8_t{3}, &frame);
  Put(service, &frame);
  Put(call, &frame);
  Put(uint32_t{4}, &frame);
  frame.body = std::make_shared<const std::string>(
      "json" + answer.dump(-1, ' ', false, json::error_handler_t::replace));
  Answer(std::move(frame));
}

void ClientSession::RefuseCall(uint32_t service, uint32_t call, const std::string& reason) {
  if (calls_ > 0) --calls_;
  Answer({{"op", "serviceCallFailure"},
          {"serviceId", service},
          {"callId", call},
          {"message", reason}});
}

void ClientSession::SendStatus(int level, const std::string& text) {
  Answer({{"op", "status"}, {"level", level}, {"message", text}});
}

}  // namespace morphbus::bridge
