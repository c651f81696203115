#pragma once
// Publishes a log again, for viewers, spies and stock LCM tools.
//
// Time is the run's sim time where messages carry it, so a log replays at the robot's pace whatever
// pace it was recorded at; messages without it go out where they stand. What would disturb a live
// run is never published: CONTROL, HELLO, ASK and END never, and nothing at all while a live run of
// the same name is on the bus.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "bridge/bus.h"
#include "bridge/party.h"
#include "logger/event_log.h"

namespace morphbus::logger {

struct ReplayOptions {
  double speed = 1.0;        ///< Times real time; 0: as fast as listeners can follow.
  double from_s = 0.0;       ///< Sim time, inclusive. INFO always goes out.
  double to_s = -1.0;        ///< Sim time, exclusive; below 0: to the end.
  std::string channel = {};  ///< ECMAScript regular expression over whole names; empty: all.
  bool loop = false;         ///< Begins again at the end.
  bool paused = false;       ///< Waits for Resume().
  int wait_for = 0;          ///< Waits until so many processes asked for the run's description.
  double max_rate = 50'000;  ///< Messages a second at speed 0: what a 4 MB buffer follows.
  /// How long to listen for a live run of the same name; CLOCK beats once a second.
  int64_t listen_us = 1'500'000;
};

/// How far a replay is.
struct ReplayProgress {
  int64_t published = 0;
  int64_t withheld = 0;  ///< CONTROL, HELLO, ASK, END.
  int64_t filtered = 0;  ///< Did not match `channel`, or out of range.
  int64_t damaged = 0;   ///< Places in the file that were read past.
  /// Messages of ours in the file whose protocol or CRC is wrong; they go out as they are.
  int64_t damaged_messages = 0;
  double end_s = 0.0;   ///< The latest replay time in the file.
  int64_t loops = 0;    ///< Times the end was reached.
  double time_s = 0.0;  ///< Sim time of the last message.
  int listeners = 0;    ///< Processes that asked for the description.
};

class Replayer {
 public:
  /// Opens the log; fails if it cannot be read, holds no event, or `channel` is no expression.
  static Result<std::unique_ptr<Replayer>> Open(const std::string& path, ReplayOptions options);

  ~Replayer();
  Replayer(const Replayer&) = delete;
  Replayer& operator=(const Replayer&) = delete;

  /// Subscribes on `bus` to who asks; call once before Advance(). `bus` outlives the replayer.
  void Start(bridge::Bus* bus, int64_t now_us);
  /// Publishes what is due. Returns when to call again (µs, same clock), or nothing at the end.
  /// Handle the bus between calls.
  std::optional<int64_t> Advance(int64_t now_us);

  void Pause(int64_t now_us);
  void Resume(int64_t now_us);
  /// Paused: publishes on to the end of the next control tick.
  void Step();
  void SetSpeed(double speed, int64_t now_us);
  [[nodiscard]] bool paused() const { return paused_; }
  [[nodiscard]] const ReplayProgress& progress() const { return progress_; }
  /// Why it stopped early, e.g. a live run; empty if it did not.
  [[nodiscard]] const std::string& error() const { return error_; }

 private:
  enum class State { kListening, kWaiting, kPlaying, kDone };

  Replayer(std::unique_ptr<EventLogReader> reader, ReplayOptions options);
  void Survey(const LogEvent& event);
  bool ReadNext();
  void Rewind();
  bool Wanted(const LogEvent& event);
  void Publish();
  void TakeSimTime(const LogEvent& event);
  void Anchor(int64_t now_us);
  std::optional<int64_t> Play(int64_t now_us);
  void OnAsk(const uint8_t* data, size_t size);
  void OnHello(const uint8_t* data, size_t size);
  void OnClock();

  std::unique_ptr<EventLogReader> reader_;
  ReplayOptions options_;
  std::regex filter_;
  bridge::Bus* bus_ = nullptr;
  std::set<std::string> runs_;  ///< In the log.
  std::set<std::string> listeners_;
  State state_ = State::kListening;
  bool paused_ = false;
  bool stepping_ = false;
  int64_t listen_until_us_ = 0;
  LogEvent next_;  ///< The event that is to go out next.
  bool has_next_ = false;
  int64_t next_time_us_ = 0;               ///< Its replay time.
  int64_t log_time_us_ = -1;               ///< Replay time of the last event read.
  std::optional<int64_t> first_stamp_us_;  ///< Logs without sim time: the first timestamp.
  bool has_sim_time_ = false;
  bool reanchor_ = false;  ///< Time stepped: pace anew from the next event.
  int64_t anchor_wall_us_ = 0, anchor_log_us_ = 0, anchor_count_ = 0;
  ReplayProgress progress_;
  std::string error_;
};

/// Replays on `bus` until the end, `*stop` (may be null), or an error. `each` (may be empty) is
/// called about ten times a second and may pause, step or change the speed.
Result<ReplayProgress> Replay(const std::string& path, const ReplayOptions& options,
                              bridge::Bus* bus, const volatile bool* stop,
                              const std::function<void(Replayer*)>& each);

}  // namespace morphbus::logger
