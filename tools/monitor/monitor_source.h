#pragma once
// What the monitor shows: a run that goes on, or a log.

#include <string>
#include <utility>
#include <vector>

#include "bridge/outward/session_hub.h"
#include "bridge/outward/topics.h"
#include "logger/log/run_log.h"
#include "tools/base/json.h"

namespace morphbus::tools {

/// One source. The monitor asks it what it offers, gives it the server, and then calls Step() again
/// and again, and Take() with what clients want of it; all in one thread.
class MonitorSource {
 public:
  virtual ~MonitorSource() = default;

  /// Begins the names of its topics, services and parameters.
  [[nodiscard]] const std::string& name() const { return name_; }
  /// Changes the name, before Open: two sources may not have the same.
  void Rename(std::string name) { name_ = std::move(name); }
  /// The run of which this log is the past, which was before the monitor came; empty for any other.
  [[nodiscard]] const std::string& past_of() const { return past_of_; }
  void SetPastOf(std::string run) { past_of_ = std::move(run); }
  /// What viewers are told of it (serverInfo.metadata.sources).
  [[nodiscard]] virtual Json Info() const = 0;
  /// Its services, the last parts of their names.
  [[nodiscard]] virtual std::vector<std::string> services() const = 0;

  /// What matching the run with another one needs, as far as it is known: a log's outline. Fails
  /// if the file cannot be read or its model not be used.
  [[nodiscard]] virtual Result<logger::RunLog> Outline() = 0;
  /// Grows with what Outline() has.
  [[nodiscard]] virtual int64_t outline_version() const = 0;

  /// `server` outlives the source; `first_channel` is the index of its first topic, behind which
  /// the others stand in the order of OutwardTopic. `tells_time`: its time is that of the server.
  virtual void Open(bridge::SessionHub* server, size_t first_channel, bool tells_time) {
    server_ = server;
    first_channel_ = first_channel;
    tells_time_ = tells_time;
  }
  /// Does what is due, waiting for it up to `wait_ms`. Returns how long nothing is due after that,
  /// milliseconds.
  virtual int Step(int wait_ms) = 0;
  /// Something that a client wants of this source, or that a client came or went. `what` is the
  /// last part of the service's or parameter's name.
  virtual void Take(const bridge::ClientRequest& request, const std::string& what) = 0;

 protected:
  /// Full name of a parameter.
  [[nodiscard]] std::string Parameter(const std::string& what) const {
    return "/" + name_ + "/" + what;
  }
  [[nodiscard]] size_t ChannelOf(bridge::OutwardTopic topic) const {
    return first_channel_ + static_cast<size_t>(topic);
  }

  std::string name_, past_of_;
  bridge::SessionHub* server_ = nullptr;
  size_t first_channel_ = 0;
  bool tells_time_ = false;
};

}  // namespace morphbus::tools
