#pragma once
// The logger's side of the lockstep: knows what a run must have published, asks for what it lacks,
// acknowledges. What is done with the messages is the recorder's business (logger/).

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <morphbus/ask_t.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/channels.h"
#include "bridge/log_lockstep.h"
#include "bridge/outbox.h"
#include "bridge/party.h"
#include "bridge/sequence_tracker.h"

namespace morphbus::bridge {

struct LogPartyOptions {
  std::string run;
  uint64_t model_hash = 0;
  bool realtime = false;  ///< Only listens, and counts what it lost.
  int64_t claim = 1;
  std::string build;
  LockstepTiming timing;
};

/// One message as it arrived.
struct LoggedMessage {
  std::string_view channel;
  const uint8_t* data = nullptr;
  size_t size = 0;
  bool duplicate = false;  ///< Of a numbered channel, and had before: a log holds each once.
  bool bad = false;        ///< Not decodable: wrong CRC, version, type or model.
};

class LogParty : public Party {
 public:
  using Recorder = std::function<void(const LoggedMessage& message)>;

  /// `bus` and `time` outlive the party. `record` gets every message on RUN/..., in order of
  /// arrival.
  LogParty(Bus* bus, const TimeSource* time, LogPartyOptions options, Recorder record);
  ~LogParty() override;

  /// Answers requests for the run's description; called when someone asks on RUN/LOG/ASK.
  void OnInfoRequest(std::function<void()> publish_info);

  void Start() override;
  void OnTime() override;
  [[nodiscard]] int64_t next_deadline_us() const override;
  [[nodiscard]] bool done() const override;
  [[nodiscard]] const Ledger& ledger() const override { return ledger_; }
  /// Sends HEALTH with the ledger.
  void PublishHealth();
  /// For INFO parts and HEALTH.
  [[nodiscard]] Outbox& outbox() { return outbox_; }

  /// True once END was seen and nothing before it is missing.
  [[nodiscard]] bool complete() const;
  [[nodiscard]] const std::string& error() const { return error_; }
  [[nodiscard]] const std::string& end_reason() const { return end_reason_; }
  /// Ticks of which nothing is missing.
  [[nodiscard]] int64_t complete_ticks() const { return machine_.complete_tick() + 1; }
  /// Count and hash of every hashed channel, as received, in order of name; equal to the
  /// publishers' once complete().
  [[nodiscard]] std::vector<ChannelTotal> totals() const;
  [[nodiscard]] std::string run_hash() const;

 private:
  /// Puts one channel's payloads into sequence order for hashing.
  struct Line;

  enum class Verdict : uint8_t { kNew, kDuplicate, kBad };

  void OnMessage(std::string_view channel, const uint8_t* data, size_t size);
  Verdict TakeHashed(const ChannelName& name, std::string_view channel, const uint8_t* data,
                     size_t size);
  Verdict TakeClock(const uint8_t* data, size_t size);
  Verdict TakeSensors(const morphbus::header_t& header, const uint8_t* data, size_t size);
  Verdict TakeModule(const ChannelName& name, const morphbus::header_t& header, const uint8_t* data,
                     size_t size);
  void AddToLine(std::string_view channel, int64_t sequence, const uint8_t* data, size_t size);
  void TakeAsk(const uint8_t* data, size_t size);
  /// Carries out the machine's wishes until it has none.
  void Settle();
  void Do(const LogAction& action);
  void Ask(const std::string& to, morphbus::ask_t* ask);
  void SayHello();

  const TimeSource* time_;
  LogPartyOptions options_;
  Recorder record_;
  Bus* bus_;
  Ledger ledger_;
  Outbox outbox_;
  LogLockstep machine_;
  std::map<std::string, std::unique_ptr<Line>, std::less<>> lines_;
  std::function<void()> publish_info_;
  SequenceTrackers trackers_;
  std::vector<LogAction> actions_;
  bool working_ = false;  ///< Within Settle().
  std::string error_, end_reason_;
};

}  // namespace morphbus::bridge
