#pragma once
// Writes a run into an event log: the description first, then every message, END last. As a
// participant of the lockstep it lacks nothing, and two runs with equal payloads give equal logs
// but for timestamps and what lies outside the run's hash. In real time it only listens and counts
// what it lost.

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <morphbus/header_t.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/description/described_run.h"
#include "bridge/lockstep/log/log_participant.h"
#include "bridge/wire/channels.h"
#include "bridge/wire/stream_hash.h"
#include "compiler/base/text_hash.h"
#include "logger/log/channel_stream.h"
#include "logger/log/event_log.h"

namespace morphbus::logger {

/// The machine's wall clock, microseconds since 1970.
int64_t WallClockUs();

/// What a recorder is told before it starts.
struct RecorderOptions {
  /// Path of the finished log; it is called PATH.partial while it is written.
  std::string path;
  /// The path is that of a file in memory, which has this name from the start and is there.
  bool in_memory = false;
  /// Serialized morphbus.proto.RunDescription, at most 16 MiB: the head of the log.
  std::string description;
  /// True to listen and count losses only; false to take part in the lockstep.
  bool realtime = false;
  /// Random number of this process, sent in HELLO: it tells two loggers of one run apart.
  int64_t claim = 1;
  /// How long the lockstep waits before it asks again or gives up.
  bridge::LockstepTiming timing;
  /// Wall clock, microseconds since 1970; empty: the machine's.
  std::function<int64_t()> wall_clock;
};

/// What became of a recording, as Finish() returns it.
struct RecordSummary {
  /// True if the run ended as planned; in lockstep also only if nothing is missing.
  bool complete = false;
  /// Where the log is.
  std::string path;
  /// Why the run ended, and which messages are missing, for people.
  std::string reason;
  /// Hash of the run as recorded, 32 hexadecimal digits.
  std::string run_hash;
  /// Events in the log, the description and END included.
  int64_t events = 0;
  /// Size of the log in bytes.
  uint64_t bytes = 0;
  /// Messages that publishers counted and the log does not have.
  int64_t lost = 0;
};

/// The process (or, in a run within one process, the participant) that writes the log. Its maker
/// calls Start(), then OnTime() whenever the bus was handled or a deadline has come, EachSecond(),
/// and at last Finish(). One that is destroyed without Finish() leaves PATH.partial without END.
class Recorder : public bridge::Participant {
 public:
  /// Opens the log and writes the description, so that even a run that never starts leaves a log
  /// that says what it was to be. `bus` and `time` outlive the recorder. Fails if the file cannot
  /// be written, the description is larger than 16 MiB or does not say which run it is, or the
  /// run's name does not fit into channel names.
  static Result<std::unique_ptr<Recorder>> Create(bridge::Bus* bus, const bridge::TimeSource* time,
                                                  RecorderOptions options);
  ~Recorder() override;

  /// Listens to the run's channels, says HELLO and publishes the description.
  void Start() override;
  /// Does what is due on the bus, and writes the messages of all ticks that became whole.
  void OnTime() override;
  /// When OnTime() must be called again (µs of the TimeSource); after the run's end, when the wait
  /// for the last ledgers ends.
  [[nodiscard]] int64_t next_deadline_us() const override;
  /// True once the run is over and every process has sent its last ledger, or had time to; also
  /// once the disk refused: see error().
  [[nodiscard]] bool done() const override;

  /// Publishes HEALTH and flushes the log to the operating system. To be called about once a second
  /// of wall time, so that a killed run loses a second at most. A failure to write shows in
  /// error().
  void EachSecond();
  /// Writes what is still held and END, and gives the log its name. Call it once, when done() or
  /// interrupted; `interrupted` says why if it is not the run's own end, and is empty if it is.
  /// Fails if the log could not be written; then PATH.partial holds what could.
  Result<RecordSummary> Finish(const std::string& interrupted);

  /// Why writing failed; empty while it did not.
  [[nodiscard]] const std::string& error() const { return error_; }
  /// Where the log is until Finish().
  [[nodiscard]] const std::string& partial_path() const { return writer_->partial_path(); }
  /// The run's name, from the description.
  [[nodiscard]] const std::string& run() const { return described_.run; }

 private:
  /// What the log holds of one channel.
  struct Written {
    int64_t count = 0;
    bool hashed = false;
    /// Of the payloads in the order in which they were written. In real time messages come in any
    /// order, and the run's hash is over them in that of their numbers: by_number has it.
    bridge::StreamHash hash;
    std::unique_ptr<ChannelStream> by_number;
    int order = 0;  ///< Its place among all channels by name; holds while in_order_ is true.
  };
  using Channels = TextTable<Written>;
  /// A message that waits for its tick to be whole, so that order of arrival leaves no trace.
  struct Held {
    Channels::value_type* channel = nullptr;
    bridge::Topic topic = bridge::Topic::kClock;
    int64_t sequence = 0;  ///< Its number on the channel.
    /// Wall clock of its arrival, µs since 1970.
    int64_t timestamp_us = 0;
    std::vector<uint8_t> payload;
  };

  Recorder(bridge::Bus* bus, const bridge::TimeSource* time, RecorderOptions options,
           bridge::DescribedRun described, std::unique_ptr<EventLogWriter> writer);
  /// Fills the header of a message that only the log gets, and writes it: it is dated by the latest
  /// tick heard of.
  template <class M>
  void WriteOwn(const std::string& channel, int64_t sequence, M* message);
  /// Writes the description's parts into the log, as its head.
  void WriteInfo();
  /// Sends the description's parts on the bus, for those who ask.
  void PublishInfo();
  /// True once every process that sent HEALTH sent it after the run's end, too.
  [[nodiscard]] bool HasAllLedgers() const;
  /// Takes one message of the run as it arrives: writes it, or holds it until its tick is whole.
  void Take(const bridge::LoggedMessage& message);
  /// Takes from TOTALS how many messages a module published, by channel.
  void TakeTotals(const uint8_t* data, size_t size);
  /// What the log holds of a channel, begun if need be.
  Channels::value_type* ChannelNamed(std::string_view name);
  /// The same for a message's channel, by the index that the participant knows it by.
  Channels::value_type* ChannelOf(const bridge::LoggedMessage& message);
  /// Keeps a message until its tick is whole.
  void Hold(Channels::value_type* channel, const bridge::LoggedMessage& message,
            bridge::Topic topic, const morphbus::header_t& header, int64_t timestamp_us);
  /// Writes the held messages of the first `complete_ticks` ticks in an order that only they
  /// decide.
  void Release(int64_t complete_ticks);
  /// Puts the messages of one tick in the order in which the log has them: by topic, name of the
  /// channel, and number.
  void Sort(std::vector<Held>* tick);
  /// Appends one event, and counts and hashes it under its channel for END; `timestamp_us` is wall
  /// clock.
  void Write(Channels::value_type* channel, const std::vector<uint8_t>& payload,
             int64_t timestamp_us, bool hashed);
  /// In real time: the same for a message of a hashed channel, by its number.
  void WriteNumbered(Channels::value_type* channel, int64_t sequence,
                     const std::vector<uint8_t>& payload, int64_t timestamp_us);
  /// Writes END: how the run ended, and the totals of every channel.
  void WriteEnd(const RecordSummary& summary, const std::vector<bridge::ChannelTotal>& totals);
  /// How many messages the publishers counted and the log lacks; appends their channels to `what`.
  [[nodiscard]] int64_t CountLost(std::string* what) const;

  const bridge::TimeSource* time_;
  RecorderOptions options_;
  bridge::DescribedRun described_;
  /// The log; never null.
  std::unique_ptr<EventLogWriter> writer_;
  /// The logger's part in the lockstep; it hands every message to Take().
  std::unique_ptr<bridge::LogParticipant> participant_;
  /// Messages that count for the run's hash, of ticks that are not whole yet, by tick.
  std::map<int64_t, std::vector<Held>> held_;
  /// Buffers of messages that have been written, for later ones.
  std::vector<std::vector<uint8_t>> spare_;
  /// What the log holds, by channel, and whether all channels know their place in order of name.
  Channels written_;
  std::vector<Channels::value_type*> by_index_;  ///< Of them those with an index; null: none yet.
  bool in_order_ = false;
  /// How many messages the modules said they published (TOTALS), by channel.
  std::map<std::string, int64_t> published_;
  /// Processes that sent HEALTH, and whether they did so after the run's end.
  std::map<std::string, bool> ledgers_;
  /// Time (TimeSource, µs) after which ledgers are waited for no longer; -1 before the end.
  int64_t ledgers_due_us_ = -1;
  /// The latest tick heard of, and its sim time in µs; they date the messages that only the log
  /// gets.
  int64_t last_tick_ = -1;
  int64_t last_time_us_ = 0;
  /// Stamp of the event written last, µs since 1970.
  int64_t last_stamp_us_ = 0;
  std::string error_;
};

}  // namespace morphbus::logger
