#pragma once
// One client of Foxglove's WebSocket protocol, as the server sees it: what it subscribed, what it
// asked for, and what waits to be sent to it. Knows no socket and no thread.

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace morphbus::bridge {

/// A channel that the server advertises; its id is its place in the catalogue, from 1.
struct AdvertisedChannel {
  std::string topic;
  std::string schema_name;
  std::string schema;     ///< Serialized FileDescriptorSet.
  bool is_state = false;  ///< Whether who subscribes gets the last message at once.
};

/// What the server offers to all clients alike. It does not change while there are clients.
struct Catalogue {
  std::string name;                             ///< Of the server.
  std::string session_id;                       ///< New for every server.
  std::map<std::string, std::string> metadata;  ///< For serverInfo.
  std::vector<AdvertisedChannel> channels;
  std::vector<std::string> services;  ///< Names; ids are places, from 1. Requests are JSON.
  /// Begin and end of what is played, ns of sim time; nothing where that goes on and cannot be.
  std::optional<std::pair<int64_t, int64_t>> playback_ns;
};

/// How far the server's playback is, as clients are told (PlaybackState of the protocol).
struct PlaybackState {
  enum class Status : uint8_t { kPlaying = 0, kPaused = 1, kBuffering = 2, kEnded = 3 };
  Status status = Status::kPaused;
  int64_t time_ns = 0;    ///< Sim time.
  float speed = 1;        ///< Times real time.
  bool did_seek = false;  ///< Whether it leapt to this time.
  std::string request;    ///< The id of the request that it answers; empty without one.
};

/// Something that a client wants and that somebody else must do.
struct ClientRequest {
  enum class Kind : uint8_t {
    kConnected,     ///< A client is there.
    kDisconnected,  ///< It is gone.
    kCall,          ///< It calls a service.
    kSet,           ///< It sets a parameter.
    kPlayback,      ///< It asks for another playback; SendPlayback answers.
  };
  Kind kind = Kind::kConnected;
  uint64_t client = 0;
  bool may_control = false;  ///< Whether the client gave the token.
  /// kCall: ids of the service and of the call, by which it is answered.
  uint32_t service = 0, call = 0;
  std::string name;      ///< kCall: of the service; kSet: of the parameter.
  nlohmann::json value;  ///< kCall: the request, an object; kSet: the value.
  std::string set_id;    ///< kSet: by which the client knows the answer; often empty.
  // kPlayback: what shall be.
  bool playing = false;
  double speed = 1;                ///< Times real time; finite, above 0.
  std::optional<int64_t> seek_ns;  ///< Sim time to go to first.
  std::string playback_id;         ///< By which the client knows the answer.
};

/// What is to be sent next: a frame of one or two parts.
struct OutgoingFrame {
  bool binary = false;
  std::array<uint8_t, 13> head = {};  ///< Before the body.
  size_t head_size = 0;
  std::shared_ptr<const std::string> body;
};

/// See the file's comment. Whatever the client sends, the session keeps a bounded amount of memory.
class ClientSession {
 public:
  // Messages and bytes that may wait; answers that may, before the client is given up; calls that
  // may be under way.
  static constexpr size_t kMostWaiting = 512;
  static constexpr size_t kMostWaitingBytes = size_t{4} << 20;
  static constexpr size_t kMostAnswers = 256;
  static constexpr size_t kMostCalls = 16;

  /// `catalogue` outlives the session. Greets the client: serverInfo, channels, services.
  /// `knows_playback`: it understands playback states before it has asked for any.
  ClientSession(uint64_t id, bool may_control, const Catalogue& catalogue,
                bool knows_playback = false);

  /// A text or binary message of the client, any bytes. What others must do about it is added to
  /// `requests`.
  void TakeText(std::string_view text, std::vector<ClientRequest>* requests);
  void TakeBinary(std::string_view bytes, std::vector<ClientRequest>* requests);

  /// A message on a channel (index in the catalogue), which is sent if the client has subscribed
  /// it. Where too much waits, only the newest of each channel is kept.
  void Offer(size_t channel, int64_t time_ns, std::shared_ptr<const std::string> bytes);
  /// Whether there is room for much more before anything would be left out.
  [[nodiscard]] bool HasRoom() const;
  /// The server's time. Only the newest waits.
  void OfferTime(int64_t time_ns);

  /// Sets a parameter; the client hears of it if it subscribed to it and it is new.
  void SetParameter(const std::string& name, const nlohmann::json& value);
  /// Answers a setParameters that had an id, with what the parameter now is.
  void AnswerSet(const std::string& name, const std::string& set_id);
  /// Answers a call, or says why not.
  void AnswerCall(uint32_t service, uint32_t call, const nlohmann::json& answer);
  void RefuseCall(uint32_t service, uint32_t call, const std::string& reason);
  /// Tells the client how far its playback is, if it answers a request or the client knows such
  /// messages.
  void SendPlayback(const PlaybackState& state);
  /// Tells the client something: level 0 information, 1 warning, 2 error.
  void SendStatus(int level, const std::string& text);

  /// The next frame, if there is one. `now_s` is any clock that does not go back.
  std::optional<OutgoingFrame> Next(double now_s);
  /// Whether the client does not read what it asks for, and is to be given up.
  [[nodiscard]] bool overrun() const { return overrun_; }
  /// Whether it gave the token.
  [[nodiscard]] bool may_control() const { return may_control_; }

 private:
  /// In place of a channel's index: what answers the client, and the server's time.
  static constexpr int kAnswer = -1, kTime = -2;
  /// A frame that waits.
  struct Waiting {
    int channel = kAnswer;  ///< Index, or kAnswer or kTime.
    OutgoingFrame frame;
  };

  // What each operation of the protocol does.
  void Subscribe(const nlohmann::json& message);
  void Unsubscribe(const nlohmann::json& message);
  void GetParameters(const nlohmann::json& message);
  void SetParameters(const nlohmann::json& message, std::vector<ClientRequest>* requests);
  void SubscribeParameters(const nlohmann::json& message, bool subscribe);
  void RequestPlayback(std::string_view bytes, std::vector<ClientRequest>* requests);
  /// Calls a service.
  void Call(std::string_view bytes, std::vector<ClientRequest>* requests);
  /// Sends parameters by name; all if there is no name.
  void SendParameters(const std::vector<std::string>& names, const std::string& id);
  /// Puts what answers the client into the queue: a frame, or a JSON message.
  void Answer(OutgoingFrame frame);
  void Answer(const nlohmann::ordered_json& message);
  /// Puts a frame into the queue; a message may make older ones go.
  void Push(Waiting waiting);
  /// Leaves out all but the newest message of each channel, and counts the others.
  void Compact();

  uint64_t id_;
  bool may_control_;
  bool knows_playback_;
  const Catalogue& catalogue_;
  /// By channel: the client's id of its subscription, if it has one.
  std::vector<std::optional<uint32_t>> subscriptions_;
  /// By channel: the last message, of channels that are states.
  struct Last {
    int64_t time_ns = 0;
    std::shared_ptr<const std::string> bytes;
  };
  std::vector<Last> last_;
  std::map<std::string, nlohmann::json> parameters_;  ///< By name, as this client is to see them.
  std::set<std::string> subscribed_parameters_;
  bool all_parameters_ = false;  ///< Subscribed to all, also those that come later.

  std::deque<Waiting> waiting_;  ///< Frames in the order in which they go out.
  size_t waiting_bytes_ = 0;     ///< Of all of them.
  size_t answers_ = 0;           ///< Of what waits.
  size_t calls_ = 0;             ///< Calls that are not answered.
  bool overrun_ = false;
  // What was left out since the client was told last: by channel, and in all.
  std::vector<int64_t> missed_;
  int64_t missed_total_ = 0;
  double told_missed_s_ = -1e9;  ///< When the client was told last, on the clock of Next().
};

}  // namespace morphbus::bridge
