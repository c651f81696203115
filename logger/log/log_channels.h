#pragma once
// The channels of a log while it is read: each is found by its name once, and then known.

#include <cstddef>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>

#include "bridge/wire/channels.h"
#include "compiler/base/text_hash.h"
#include "logger/log/channel_stream.h"
#include "logger/log/event_log.h"
#include "logger/log/run_facts.h"

namespace morphbus::logger {

/// Finds the channel of each event, and enters new ones into the log's facts. A million events have
/// some dozens of channels, so that what a name says is found out once.
class LogChannels {
 public:
  /// A channel of the file.
  struct Known {
    /// Its name as the file has it.
    std::string raw;
    /// The parts of the name, which point into `raw`; empty for a channel of others.
    bridge::ChannelName name;
    /// Whether it is one of the run that is read.
    bool ours = false;
    /// Its entry in LogFacts::channels.
    ChannelFacts* facts = nullptr;
    /// Its messages in order; null for a channel of others.
    ChannelStream* stream = nullptr;
  };

  /// `run` is the run that is read; `facts` outlives this.
  LogChannels(std::string run, LogFacts* facts) : run_(std::move(run)), facts_(*facts) {}

  /// The channel of an event; the reference is valid until the next call. A damaged log can name a
  /// new channel with every event: beyond 200,000 they are counted as one.
  Known& Of(const LogEvent& event);

  /// By the names under which the facts list them.
  std::map<std::string, ChannelStream>& streams() { return streams_; }
  /// Further runs that the file names.
  [[nodiscard]] const std::set<std::string>& other_runs() const { return other_runs_; }
  /// Was there any message of the run?
  [[nodiscard]] bool found() const { return found_; }

 private:
  std::string run_;
  LogFacts& facts_;
  std::map<std::string, ChannelStream> streams_;
  TextTable<std::unique_ptr<Known>> known_;
  /// The channel of the last event if it is one too many.
  std::unique_ptr<Known> unremembered_;
  std::set<std::string> other_runs_;
  bool found_ = false;
};

}  // namespace morphbus::logger
