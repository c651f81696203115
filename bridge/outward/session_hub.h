#pragma once
// All clients of the monitor's server and what they get, without any socket: what sources publish
// and answer comes in on one side, what clients send and take on the other.

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bridge/outward/client_session.h"

namespace morphbus::bridge {

/// Every method may be called from any thread. None waits for a client, and what waits for one is
/// bounded (ClientSession), so whoever publishes is never held up.
class SessionHub {
 public:
  /// Says what there is, once, before anything else. `wake` is called, from any thread, when a
  /// client may have something to be sent.
  void Start(Catalogue catalogue, std::function<void()> wake);

  // For who carries messages to and fro.

  /// A client is there; returns the number by which it is known.
  /// `knows_playback`: it understands PlaybackState before it has asked for a playback.
  uint64_t Enter(bool may_control, bool knows_playback);
  void Leave(uint64_t client);
  void TakeText(uint64_t client, std::string_view text);
  void TakeBinary(uint64_t client, std::string_view bytes);
  /// The next frame for a client; false if there is none. `now_s` is any clock that does not go
  /// back.
  bool Next(uint64_t client, double now_s, OutgoingFrame* frame);
  /// Whether a client asks and does not read, and is to be disconnected.
  [[nodiscard]] bool IsOverrun(uint64_t client) const;
  /// Counts something that was refused, by its kind.
  void Count(const std::string& kind);
  /// Clients without the token.
  [[nodiscard]] int num_guests() const;

  // For sources.

  /// A message on a channel (index in the catalogue), for every client.
  void Publish(size_t channel, int64_t time_ns, const std::string& bytes);
  /// One for a single client; nothing happens if it is gone.
  void PublishTo(uint64_t client, size_t channel, int64_t time_ns, const std::string& bytes);
  /// Whether that client can take much more without anything being left out; false if it is gone.
  [[nodiscard]] bool HasRoom(uint64_t client) const;
  /// The server's time, for all clients and for one.
  void PublishTime(int64_t time_ns);
  void PublishTimeTo(uint64_t client, int64_t time_ns);
  /// A parameter, for all clients, those to come included, and for one.
  void SetParameter(const std::string& name, const nlohmann::json& value);
  void SetParameterOf(uint64_t client, const std::string& name, const nlohmann::json& value);

  /// What clients want that somebody else must do, in order; waits up to `wait_ms` for the first.
  /// Every kCall must be answered or refused, every kSet be followed by AnswerSet, every kPlayback
  /// by SendPlayback.
  std::vector<ClientRequest> TakeRequests(int wait_ms);
  void AnswerSet(const ClientRequest& request);
  void AnswerCall(const ClientRequest& request, const nlohmann::json& answer);
  void RefuseCall(const ClientRequest& request, const std::string& reason);
  /// How far a client's playback is; answers a kPlayback whose id it has.
  void SendPlayback(uint64_t client, const PlaybackState& state);
  void SendStatus(uint64_t client, int level, const std::string& text);

  /// What was refused so far, by kind; kinds that never occurred are left out.
  [[nodiscard]] std::map<std::string, int64_t> refused() const;

 private:
  /// Calls `act` with the session of a client, if it is there, and wakes who sends.
  template <class Act>
  void WithSession(uint64_t client, const Act& act);
  /// Keeps requests for TakeRequests. The mutex is held.
  void Keep(std::vector<ClientRequest> requests);

  std::function<void()> wake_;
  mutable std::mutex mutex_;  ///< Guards all that follows.
  Catalogue catalogue_;
  std::map<uint64_t, std::unique_ptr<ClientSession>> sessions_;
  std::vector<ClientRequest> requests_;
  std::condition_variable requested_;
  std::map<std::string, int64_t> refused_;
  std::map<std::string, nlohmann::json> parameters_;
  /// By channel: the last message of a state, for who comes later.
  std::vector<std::pair<int64_t, std::shared_ptr<const std::string>>> last_;
  uint64_t last_id_ = 0;
  int guests_ = 0;
};

}  // namespace morphbus::bridge
