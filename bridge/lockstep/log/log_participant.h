#pragma once
// The logger's side of the lockstep: knows what a run must have published, asks for what it lacks,
// acknowledges. What is done with the messages is the recorder's business (logger/).

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/lockstep/lockstep_participant.h"
#include "bridge/lockstep/log/log_lockstep.h"
#include "bridge/lockstep/log/received_streams.h"

namespace morphbus::bridge {

/// What a logger is told before it starts. In real time it only listens, and counts what it lost.
struct LogParticipantOptions : LogLockstep::Config {
  /// Name of the run, the first part of every channel.
  std::string run;
  /// Messages that speak of another model are bad.
  uint64_t model_hash = 0;
  /// Random number of the process: two of them claiming to be the logger are told apart by it.
  int64_t claim = 1;
  /// Version of the software, for people.
  std::string build;
};

/// One message as it arrived. The views and the bytes are valid while the recorder is called.
struct LoggedMessage {
  std::string_view channel;
  /// The payload, with neither LCM's header nor the channel's name.
  const uint8_t* data = nullptr;
  size_t size = 0;
  bool duplicate = false;  ///< Had before: a log holds each once.
  bool bad = false;        ///< Not decodable: wrong CRC, version, type or model.
  /// Sound, but nothing that this run can have published: it has no place in the log.
  bool refused = false;
  /// Which hashed channel it is of: they are counted from 0 as they are first heard. -1 for others,
  /// and where the message is bad or refused.
  int channel_index = -1;
  /// CLOCK with PHASE_END, for the first time. It ends the log.
  bool end = false;
};

/// The logger as a participant of a run. It lacks nothing in the end, or says so by error().
class LogParticipant : public LockstepParticipant<LogLockstep> {
 public:
  /// Takes one message; its bytes are valid during the call only.
  using Sink = std::function<void(const LoggedMessage& message)>;

  /// `bus` and `time` outlive the participant. `record` gets every message on RUN/..., in order of
  /// arrival.
  LogParticipant(Bus* bus, const TimeSource* time, LogParticipantOptions options, Sink record);

  /// Answers requests for the run's description (INFO): `publish_info` is called whenever someone
  /// asks on RUN/LOG/RESEND.
  void OnInfoRequest(std::function<void()> publish_info) {
    publish_info_ = std::move(publish_info);
  }

  /// Listens to everything on the run's channels and says HELLO.
  void Start() override;
  /// Does what is due.
  void OnTime() override;
  /// For publishing parts of the description on INFO, numbered like all that the logger sends.
  [[nodiscard]] Outbox& outbox() { return outbox_; }

  /// True once END was seen and nothing before it is missing; in real time, where loss is counted
  /// and no failure, once END was seen.
  [[nodiscard]] bool complete() const;
  /// Empty if the run ended as planned, as the sim says of all participants; else what went wrong.
  /// Valid once done().
  [[nodiscard]] const std::string& error() const { return error_; }
  /// Why the run ended, as CLOCK tells; empty before.
  [[nodiscard]] const std::string& end_reason() const { return end_reason_; }
  /// Whether the run has a process of this name, as far as SENSORS has told.
  [[nodiscard]] bool HasProcess(std::string_view process) const;
  /// Ticks of which nothing is missing; in real time all ticks of the run, once it is over.
  [[nodiscard]] int64_t complete_ticks() const {
    const bool all = options_.realtime && machine_.end_seen();
    return all ? machine_.end_tick() : machine_.complete_tick() + 1;
  }
  /// Count and hash of every hashed channel, as received, in order of name; equal to the
  /// publishers' once complete().
  [[nodiscard]] std::vector<ChannelTotal> totals() const { return streams_.totals(); }
  /// Hash over totals(), 32 hexadecimal digits.
  [[nodiscard]] std::string run_hash() const { return RunHash(totals()); }

 private:
  [[nodiscard]] Moment CurrentMoment() const override;
  void CarryOut(const LogAction& action) override;
  /// Takes a message on any channel of the run, and hands it to the recorder.
  void OnMessage(std::string_view channel, const uint8_t* data, size_t size);
  /// What the machine says of a message; nothing if the message is bad.
  using MaybeTaken = std::optional<LogLockstep::Taken>;
  /// Takes a message on a hashed channel, of which `stream` has come (null: nothing): fills in what
  /// it is worth.
  void TakeHashed(const ChannelName& name, ReceivedStream* stream, const morphbus::header_t& header,
                  LoggedMessage* message);
  /// Takes a message on any other channel of the run; the same.
  void TakeOther(const ChannelName& name, LoggedMessage* message);
  // These check a message on a hashed channel and tell the machine that it has come. `name` is the
  // channel's, taken apart, and `stream` what has come on it, or null.
  MaybeTaken TellMachine(const ChannelName& name, const ReceivedStream* stream,
                         const morphbus::header_t& header, LoggedMessage* message);
  MaybeTaken TellClock(const morphbus::header_t& header, LoggedMessage* message);
  /// Whether the run has this channel. While SENSORS has not named all modules, what counts for the
  /// hash is asked for again later, and of the rest some is let in.
  bool HasChannel(const ChannelName& name);
  /// Tells the machine of the modules that SENSORS names; false if the message is bad.
  bool TakeNames(const uint8_t* data, size_t size);
  /// Begins to note what comes on a channel, of which nothing has come yet.
  ReceivedStream& BeginStream(const LoggedMessage& message, const ChannelName& name);
  /// Compares what a process says it has published with what was recorded. If they differ the
  /// run is over.
  void CompareTotals(const ChannelName& name, const uint8_t* data, size_t size);
  /// Takes a request; a bad one changes nothing.
  void TakeResend(const uint8_t* data, size_t size);
  /// Tells the sim how far the logger is.
  void SayProgress();
  /// Publishes the description if somebody wants it, but only now and then.
  void AnswerInfo();

  LogParticipantOptions options_;
  // Where every message goes, and what has come on the hashed channels.
  Sink record_;
  ReceivedStreams streams_;
  std::function<void()> publish_info_;
  // Somebody wants the description, and the wall time before which it is not published again.
  bool info_wanted_ = false;
  int64_t info_due_us_ = 0;
  /// Messages of processes that SENSORS had not named yet.
  int64_t early_ = 0;
  // See error() and end_reason().
  std::string error_, end_reason_;
};

}  // namespace morphbus::bridge
