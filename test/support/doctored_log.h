#pragma once
// Logs that somebody altered and then made consistent again: payloads with right CRCs, unbroken
// numbers, and an END whose counts and hashes fit. What is wrong with them only their content says.

#include <cstdint>
#include <functional>
#include <morphbus/log_end_t.hpp>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/wire/channels.h"
#include "bridge/wire/codec.h"
#include "test/support/synthetic_log.h"

namespace morphbus::test {

class DoctoredLog {
 public:
  /// Reads a log that must be whole.
  explicit DoctoredLog(const std::string& path);

  /// Calls `alter(&message)` for every message of type M on the channel of `topic` and, unless it
  /// is empty, `process`; the message is encoded anew, with its CRC.
  template <class M, class Alter>
  void Change(bridge::Topic topic, std::string_view process, const Alter& alter) {
    ForEach<M>(topic, process, [&](M* message, SyntheticEvent* event) {
      alter(message);
      bridge::Encode(*message, &event->payload);
    });
  }
  /// Takes out the messages for which `unwanted(message)` is true, and numbers the others of their
  /// channel anew.
  template <class M, class Unwanted>
  void Drop(bridge::Topic topic, std::string_view process, const Unwanted& unwanted) {
    ForEach<M>(topic, process, [&](M* message, SyntheticEvent* event) {
      if (unwanted(*message)) event->channel.clear();
    });
    std::erase_if(events_, [](const SyntheticEvent& e) { return e.channel.empty(); });
    int64_t next = 0;
    Change<M>(topic, process, [&next](M* message) { message->header.sequence = next++; });
  }
  /// Takes out whole channels.
  void DropChannels(bridge::Topic topic, std::string_view process);
  /// Alters END after its totals were made right.
  void ChangeEnd(std::function<void(log_end_t*)> alter) { on_end_ = std::move(alter); }

  /// The events, for changes that are none of a message.
  std::vector<SyntheticEvent>& events() { return events_; }
  /// Writes the log, with an END that fits.
  void Write(const std::string& path);

 private:
  template <class M, class Visit>
  void ForEach(bridge::Topic topic, std::string_view process, const Visit& visit) {
    for (SyntheticEvent& event : events_) {
      const auto name = bridge::ParseChannel(event.channel);
      if (!name || name->topic != topic || (!process.empty() && name->process != process)) continue;
      M message;
      MORPHBUS_CHECK(
          bridge::Decode(event.payload.data(), event.payload.size(), {}, &message).has_value());
      visit(&message, &event);
    }
  }

  std::vector<SyntheticEvent> events_;
  std::function<void(log_end_t*)> on_end_;
};

}  // namespace morphbus::test
