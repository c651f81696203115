#pragma once
// Writes a run into an event log: the description first, then every message, END last. As a party
// of the lockstep it lacks nothing, and two runs with equal payloads give equal logs but for
// timestamps and what lies outside the run's hash. In real time it only listens and counts what it
// lost.

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "bridge/log_party.h"
#include "logger/event_log.h"

namespace morphbus::logger {

struct RecorderOptions {
  std::string path;         ///< The log; PATH.partial while it is written.
  std::string description;  ///< Serialized morphbus.proto.RunDescription, at most 16 MiB.
  bool realtime = false;
  int64_t claim = 1;  ///< Random number of this process (HELLO).
  bridge::LockstepTiming timing;
  /// Wall clock, microseconds since 1970; empty: the machine's.
  std::function<int64_t()> wall_clock;
};

/// What became of a recording.
struct RecordSummary {
  bool complete = false;  ///< The run ended as planned and nothing is missing.
  std::string path;       ///< Where the log is.
  std::string reason;     ///< Why the run ended, and what is missing.
  std::string run_hash;   ///< Of what was recorded.
  int64_t events = 0;
  uint64_t bytes = 0;
  int64_t lost = 0;  ///< Messages that publishers counted and the log does not have.
};

class Recorder : public bridge::Party {
 public:
  /// Opens the log and writes the description. `bus` and `time` outlive the recorder. Fails if the
  /// file cannot be written or the description does not say which run it is.
  static Result<std::unique_ptr<Recorder>> Create(bridge::Bus* bus, const bridge::TimeSource* time,
                                                  RecorderOptions options);
  ~Recorder() override;

  void Start() override;
  void OnTime() override;
  [[nodiscard]] int64_t next_deadline_us() const override;
  /// Also true once the disk refused: see error().
  [[nodiscard]] bool done() const override;
  [[nodiscard]] const bridge::Ledger& ledger() const override;

  /// HEALTH and a flush to the operating system; about once a second of wall time.
  void EachSecond();
  /// Writes what is left and END, and gives the log its name. Call once, when done() or
  /// interrupted; `interrupted` (may be empty) says why it is not the run's own end.
  Result<RecordSummary> Finish(const std::string& interrupted);

  /// Empty while nothing went wrong.
  [[nodiscard]] const std::string& error() const { return error_; }
  [[nodiscard]] const std::string& partial_path() const { return writer_->partial_path(); }
  [[nodiscard]] const std::string& run() const { return run_; }

 private:
  struct Held;
  struct Written;

  Recorder(bridge::Bus* bus, const bridge::TimeSource* time, RecorderOptions options,
           std::string run, uint64_t model_hash, std::unique_ptr<EventLogWriter> writer);
  void WriteInfo();
  void PublishInfo();
  void Take(const bridge::LoggedMessage& message);
  void TakeEndAck(const uint8_t* data, size_t size);
  void Release(int64_t complete_ticks);
  void Write(const std::string& channel, std::vector<uint8_t> payload, int64_t timestamp_us,
             bool hashed);
  std::vector<uint8_t> MakeEnd(const std::string& reason, bool clean, const std::string& run_hash,
                               const std::vector<bridge::ChannelTotal>& totals) const;
  [[nodiscard]] int64_t CountLost(std::string* what) const;

  RecorderOptions options_;
  std::string run_;
  uint64_t model_hash_ = 0;
  std::unique_ptr<EventLogWriter> writer_;
  std::unique_ptr<bridge::LogParty> party_;
  std::vector<Held> held_;                    ///< Hashed messages of ticks that are not whole yet.
  std::map<std::string, Written> written_;    ///< By channel.
  std::map<std::string, int64_t> published_;  ///< Counts that modules vouched for (END_ACK).
  int64_t last_tick_ = -1;
  int64_t last_time_us_ = 0;
  std::string error_;
};

}  // namespace morphbus::logger
