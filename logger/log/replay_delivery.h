#pragma once
// A replay that followers of ours acknowledge, so that each of them gets every message exactly once
// and in order, at any speed. A bus may lose messages and tells nobody.
//
// Messages go out in batches, each between two marks on RUN/LOG/BATCH: one names its number, the
// other one also how many messages it has, and their hash. Followers say on RUN/FOLLOW that they
// follow, until a batch comes, and then of each batch whether it came whole: if count or hash do
// not fit it goes out again. The next batch begins once all have it. Who does not follow hears the
// same messages, those of a repeated batch twice.

#include <cstdint>
#include <functional>
#include <map>
#include <morphbus/replay_batch_t.hpp>
#include <morphbus/replay_follow_t.hpp>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bridge/bus/bus.h"
#include "bridge/wire/channels.h"
#include "bridge/wire/stream_hash.h"

namespace morphbus::logger {

/// A follower that says nothing for so long is given up, and so is a replay (µs).
inline constexpr int64_t kFollowPatienceUs = 5'000'000;
/// Longer messages travel in fragments, which no bus of ours takes; they are left out of batches.
inline constexpr size_t kMaxFollowedBytes = 60'000;

/// Whether a replay publishes what a log has of a topic: all but what would disturb a live run, or
/// tell listeners that it has ended.
bool IsReplayed(bridge::Topic topic);

/// Whether a message of a replay of `run` is one of a batch: the run's own, of a kind that a replay
/// publishes, and short enough.
bool IsFollowed(std::string_view run, std::string_view channel, size_t size);

/// Count and hash of the messages of a batch, in their order.
class BatchSum {
 public:
  void Add(std::string_view channel, std::span<const uint8_t> data);
  [[nodiscard]] int64_t count() const { return count_; }
  [[nodiscard]] int64_t hash() const { return static_cast<int64_t>(hash_.Digest()); }

 private:
  bridge::StreamHash hash_;
  int64_t count_ = 0;
};

/// The replayer's side. It has no clock: times are its owner's, µs.
class ReplayDelivery {
 public:
  /// Of the messages of `run`, published on `bus`, which outlives it.
  ReplayDelivery(bridge::Bus* bus, std::string run) : bus_(bus), run_(std::move(run)) {}

  /// Takes what a follower said.
  void Take(const morphbus::replay_follow_t& said);
  /// Whether a batch waits for acknowledgements, so that nothing may be published. Sends again what
  /// followers lack, and gives up those that are silent. Call it often while it is true.
  bool Waiting(int64_t now_us);
  /// Publishes a message, within a batch if anybody follows.
  void Publish(const std::string& channel, std::span<const uint8_t> data);
  /// Whether the batch is so large that it should be closed.
  [[nodiscard]] bool full() const;
  /// Ends the batch that was begun, if one was; Waiting() is true then.
  void Close(int64_t now_us);
  /// Tells the followers that nothing will follow. Close the batch before; when Waiting() is false
  /// again, all of them know.
  void End(int64_t now_us);
  /// Lets followers know that the replay lives; for pauses.
  void Beat(int64_t now_us);

  [[nodiscard]] int followers() const { return static_cast<int>(followers_.size()); }
  /// Followers that fell silent.
  [[nodiscard]] int lost() const { return lost_; }

 private:
  /// Sends a mark of the present batch: the one at its beginning, or at its end.
  void Mark(bool ended);
  /// Sends the present batch once more.
  void SendAgain(int64_t now_us);

  bridge::Bus* bus_;
  std::string run_;
  /// Who follows, and whether the present batch is acknowledged.
  std::map<std::string, bool> followers_;
  /// Number of the present or the last batch; -1 before the first.
  int64_t number_ = -1;
  int64_t marks_ = 0;  ///< Sent so far.
  /// The messages of the present batch, until it is acknowledged.
  std::vector<std::pair<std::string, std::vector<uint8_t>>> batch_;
  size_t batch_bytes_ = 0;
  BatchSum sum_;
  /// Who asked for the present batch again since it was last found out who is silent.
  std::set<std::string> asking_;
  bool open_ = false;     ///< Begun and not closed.
  bool waiting_ = false;  ///< Closed and not acknowledged by all.
  bool again_ = false;    ///< Somebody lacks it.
  bool ending_ = false;   ///< It is the one that says that nothing follows.
  int lost_ = 0;
  /// When the batch was closed; when it, or its end, was sent last; and how long to wait before
  /// that is repeated.
  int64_t closed_us_ = 0, sent_us_ = 0, pause_us_ = 0;
};

/// A follower's side: gets a replay's messages, exactly once and in their order, from the first
/// batch that begins after it joined.
class ReplayFollower {
 public:
  using Sink = std::function<void(std::string_view channel, std::span<const uint8_t> data)>;

  /// Follows the replay of `run` on `bus`, which outlives it, under `name` (a process's name, its
  /// own among all followers). `sink` gets the messages.
  ReplayFollower(bridge::Bus* bus, std::string run, std::string name, Sink sink);
  ~ReplayFollower();
  ReplayFollower(const ReplayFollower&) = delete;
  ReplayFollower& operator=(const ReplayFollower&) = delete;

  /// Joins, and asks again until a batch comes. Call it between Handle()s of the bus, at least ten
  /// times a second.
  void Advance(int64_t now_us);
  /// True once the replay has told that it is over.
  [[nodiscard]] bool finished() const { return finished_; }
  /// True once a replay that was heard has been silent for kFollowPatienceUs.
  [[nodiscard]] bool abandoned() const { return abandoned_; }
  /// Messages handed to the sink.
  [[nodiscard]] int64_t delivered() const { return delivered_; }
  /// Batches that did not come whole and were asked for again.
  [[nodiscard]] int64_t asked_again() const { return asked_again_; }

 private:
  void OnMessage(std::string_view channel, std::span<const uint8_t> data);
  void OnMark(const morphbus::replay_batch_t& mark);
  /// Says which batch it answers, and whether it came whole; -1: none has come.
  void Answer(int64_t batch, bool whole);

  bridge::Bus* bus_;
  std::string run_, name_;
  Sink sink_;
  /// The batch that is being gathered; -1: none, and messages are ignored.
  int64_t gathering_ = -1;
  std::vector<std::pair<std::string, std::vector<uint8_t>>> batch_;
  BatchSum sum_;
  /// Number of the last batch that was delivered; -1 before the first.
  int64_t done_ = -1;
  bool heard_ = false;  ///< A mark came since the last Advance().
  bool joined_ = false;
  bool finished_ = false, abandoned_ = false;
  int64_t last_heard_us_ = 0, last_asked_us_ = 0;
  int64_t delivered_ = 0, asked_again_ = 0;
};

}  // namespace morphbus::logger
