#pragma once
// Publishes a log again, for viewers, spies and stock LCM tools.
//
// Time is the run's sim time where messages carry it, so a log replays at the robot's pace whatever
// pace it was recorded at; messages without it go out where they stand. What would disturb a live
// run is never published: only messages of ticks, HEALTH and INFO go out (IsReplayed in
// replay_delivery.h), and nothing at all while a live run of the same name is on the bus.

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "bridge/bus/bus.h"
#include "bridge/lockstep/participant.h"
#include "bridge/observe/run_message.h"
#include "bridge/wire/channels.h"
#include "compiler/base/name_pattern.h"
#include "logger/log/event_log.h"
#include "logger/log/replay_delivery.h"

namespace morphbus::logger {

/// A command that people gave to the run of a log.
struct ClockCommand {
  /// The tick in which CLOCK names it, and its sim time (µs).
  int64_t tick = 0;
  int64_t time_us = 0;
  /// As `run --commands` reads it. Of a damaged log it may be any text.
  std::string text;
};

/// How a replay is to run. Times are sim time where the log has it, else time since the first
/// event.
struct ReplayOptions {
  /// Log time per wall time: 1 is the robot's pace, 0 as fast as listeners can follow.
  double speed = 1.0;
  /// Start of the range, seconds, inclusive. The description (INFO) goes out in any case.
  double from_s = 0.0;
  /// End of the range, seconds, exclusive; below 0: to the end of the log. In concatenated logs the
  /// range is that of each run.
  double to_s = -1.0;
  /// Which channels go out: an ECMAScript regular expression over whole names; empty: all.
  std::string channel = {};
  /// Whether to begin again at the end.
  bool loop = false;
  /// Whether to wait for Resume() before the first message.
  bool paused = false;
  /// Waits until so many processes have asked for the run's description or said HELLO.
  int wait_for = 0;
  /// A serialized description (ReadDescription) that goes out at the beginning, after each seek and
  /// in each loop, if the log holds none whole. Empty: none.
  std::string description = {};
  /// Messages a second at speed 0: what a receive buffer of 4 MB takes without loss.
  double max_rate = 50'000;
  /// How long to listen for a live run of the same name, µs of wall time; its CLOCK beats once a
  /// second even while it waits.
  int64_t listen_us = 1'500'000;
};

/// How far a replay is; kept up to date while it runs.
struct ReplayProgress {
  /// Messages sent on the bus, over all loops.
  int64_t published = 0;
  /// Messages of other kinds (IsReplayed in replay_delivery.h), which never go out.
  int64_t withheld = 0;
  /// Messages that do not match `channel`, are out of range, or have a name too long for LCM.
  int64_t filtered = 0;
  /// Findings of the log reader over the whole file, harmless ones (LogFinding) included.
  int64_t damaged = 0;
  /// Messages of ours in the file whose protocol or CRC is wrong; they go out as they are.
  int64_t damaged_messages = 0;
  /// The latest replay time in the file, seconds.
  double end_s = 0.0;
  /// How many times the end was reached.
  int64_t loops = 0;
  /// Replay time of the last message sent, seconds.
  double time_s = 0.0;
  /// Processes that asked for the description or said HELLO.
  int listeners = 0;
  /// Followers of ours, which acknowledge what they get; and those among them that fell silent.
  int followers = 0, lost_followers = 0;
};

/// Publishes the events of one log at their times. It has no clock and no thread: its owner calls
/// Advance() and handles the bus, as Replay() below does.
class Replayer {
 public:
  /// Opens the log and reads it once to learn which runs it holds and whether it has sim time.
  /// Fails if it cannot be read or holds no event, if speed or range is no usable number, or if
  /// `channel` is no regular expression.
  static Result<std::unique_ptr<Replayer>> Open(const std::string& path, ReplayOptions options);

  ~Replayer();
  Replayer(const Replayer&) = delete;
  Replayer& operator=(const Replayer&) = delete;

  /// Subscribes on `bus` to those who ask for the description, say HELLO, or run under a name of
  /// the log. Call it once, before Advance(). `bus` outlives the replayer; `now_us` is any
  /// monotonic clock (µs), the same in all calls.
  void Start(bridge::Bus* bus, int64_t now_us);
  /// Publishes what is due at `now_us`, at most 64 messages. Returns when to call again (µs, same
  /// clock), 50 ms ahead at most, or nothing once the replay is over. Handle the bus between calls.
  std::optional<int64_t> Advance(int64_t now_us);

  /// Stops publishing until Resume() or Step().
  void Pause(int64_t now_us);
  /// Goes on from where it stands: the time of the pause is not caught up with.
  void Resume(int64_t now_us);
  /// While paused: publishes the messages of the next control tick, that is all of one time.
  void Step();
  /// Goes on from the first message of `time_s` (replay time, seconds) or later, backwards or
  /// forwards, within the range; the description goes out again. While paused it publishes the
  /// messages of that tick. In concatenated logs the time is that of the first run that has it.
  void Seek(double time_s, int64_t now_us);
  /// Changes the speed from now on; ignores a speed that is negative or not finite.
  void SetSpeed(double speed, int64_t now_us);
  [[nodiscard]] bool paused() const { return paused_; }
  /// Log time per wall time; 0: as fast as listeners can follow.
  [[nodiscard]] double speed() const { return options_.speed; }
  [[nodiscard]] const ReplayProgress& progress() const { return progress_; }
  /// The commands that people gave to the run, as the replay passes the ticks in which CLOCK names
  /// them, whatever channels go out: those since the last call, in their order (10,000 at most).
  /// What a seek passes over is not among them.
  std::vector<ClockCommand> TakeCommands() { return std::exchange(passed_, {}); }
  /// Why it stopped early, e.g. because of a live run; empty if it did not.
  [[nodiscard]] const std::string& error() const { return error_; }

 private:
  /// First it listens for a live run, then it waits for listeners, then it plays.
  enum class State { kListening, kWaiting, kPlaying, kDone };

  /// An event with what its channel's name and its header say; both refer to it.
  struct Event : LogEvent {
    /// Of a channel of a run.
    std::optional<bridge::ChannelName> name;
    /// If its header is sound.
    std::optional<bridge::RunMessage> message;

    [[nodiscard]] bool Is(bridge::Topic topic) const { return name && name->topic == topic; }
    /// Whether it belongs to a tick, whose sim time sound ones have.
    [[nodiscard]] bool OfTick() const { return name && bridge::IsHashed(name->topic); }
  };

  Replayer(std::unique_ptr<EventLogReader> reader, ReplayOptions options, NamePattern channels);
  /// Reads the next event of the file, which is valid until the next call; false at its end.
  bool Read(Event* event);
  /// Learns from one event what must be known before any goes out: runs, sim time, damage.
  void Survey(const Event& event);
  /// Finds the next event to publish; false at the end of the file.
  bool ReadNext();
  /// Goes back to the beginning of the file.
  void Rewind();
  /// True if the event goes out: not withheld, in the range, and of a wanted channel.
  bool Wanted(const Event& event);
  /// Takes the commands of a CLOCK that lies in the range, once each.
  void LookForCommands(const Event& event);
  /// Those that were read up to here are passed now.
  void PassCommands();
  /// Sends the event that ReadNext() found.
  void Publish();
  /// Sends a message, to followers within a batch.
  void Send(const std::string& channel, std::span<const uint8_t> data);
  /// Ends the batch that is being sent, so that followers get it now.
  void CloseBatch(int64_t now_us);
  /// Tells followers of the end; false while one of them lacks something.
  bool AllDelivered(int64_t now_us);
  /// Prepares the description that `options` lend, unless the log has its own. Fails if it does not
  /// fit the log (LoadRunLog).
  Result<void> Borrow(const std::string& path);
  /// Sends the lent description, if there is one.
  void PublishLent();
  /// Moves log_time_us_ on to the event's time.
  void TakeSimTime(const Event& event);
  /// Paces what follows from here: the next event is due at `now_us`.
  void Anchor(int64_t now_us);
  /// Advance() in the state kPlaying.
  std::optional<int64_t> Play(int64_t now_us);
  /// Counts who asks for the description, who follows, and who says HELLO, as listeners.
  void OnResend(const uint8_t* data, size_t size);
  void OnFollow(const uint8_t* data, size_t size);
  void OnHello(const uint8_t* data, size_t size);
  /// A CLOCK that comes before we publish any is a live run's: the replay stops.
  void OnClock(const uint8_t* data, size_t size);
  /// Counts a listener, once by its name.
  void AddListener(const std::string& name);

  std::unique_ptr<EventLogReader> reader_;
  ReplayOptions options_;
  /// What `channel` says, compiled.
  NamePattern channels_;  // options_.channel
  /// What lies before it was passed over by Seek(), µs of replay time.
  int64_t seek_us_ = std::numeric_limits<int64_t>::min();
  /// End of the range, µs of replay time, exclusive.
  int64_t end_us_ = std::numeric_limits<int64_t>::max();
  bridge::Bus* bus_ = nullptr;
  /// The channels on which Start() subscribed.
  std::vector<std::string> listened_;
  /// Names of the runs in the log, 64 at most.
  std::set<std::string> runs_;
  /// Names of processes that asked, and name and process id of those that said HELLO.
  std::set<std::string> listeners_;
  State state_ = State::kListening;
  /// True between Pause() and Resume(), and then true while Step() publishes one more tick.
  bool paused_ = false;
  bool stepping_ = false;
  /// End of listening for a live run, on the caller's clock (µs).
  int64_t listen_until_us_ = 0;
  /// The first run of the log, and how its messages come to followers.
  std::string first_run_;
  std::optional<ReplayDelivery> delivery_;
  bool end_told_ = false;
  /// While stepping: the time of the tick, and whether only the description went out so far.
  int64_t step_us_ = 0;
  bool step_begins_ = false;
  /// The lent description in its parts, and the channel on which they go out.
  std::vector<std::vector<uint8_t>> lent_parts_;
  std::string lent_channel_;
  /// The event that is to go out next, if has_next_.
  Event next_;
  bool has_next_ = false;
  /// Its replay time, µs.
  int64_t next_time_us_ = 0;
  /// Commands that were read and not passed yet, and those that were passed and not taken.
  std::vector<ClockCommand> ahead_, passed_;
  /// Number of the last CLOCK that was looked at; a log may hold one twice.
  int64_t clock_sequence_ = -1;
  /// Replay time of the last event read, µs; the lowest integer before the first sim time.
  int64_t log_time_us_ = -1;
  /// In logs without sim time: the first timestamp, from which replay time is counted.
  std::optional<int64_t> first_stamp_us_;
  /// True if the log has messages of ours that carry sim time.
  bool has_sim_time_ = false;
  /// Set where time steps back between two runs: the pace is taken anew from the next event.
  bool reanchor_ = false;
  /// Wall time, replay time (both µs) and count of messages from which the pace is taken.
  int64_t anchor_wall_us_ = 0, anchor_log_us_ = 0, anchor_count_ = 0;
  ReplayProgress progress_;
  std::string error_;
};

/// Replays a log on `bus`, on the machine's monotonic clock, until its end or an error, or until
/// `*stop` (may be null; set by a signal handler) becomes true. `each` (may be empty) is called
/// about ten times a second and once at the end, and may pause, step or change the speed. Returns
/// how far the replay came; fails as Open() does, or if a live run of the log's name is on the bus.
Result<ReplayProgress> Replay(const std::string& path, const ReplayOptions& options,
                              bridge::Bus* bus, const volatile bool* stop,
                              const std::function<void(Replayer*)>& each);

}  // namespace morphbus::logger
