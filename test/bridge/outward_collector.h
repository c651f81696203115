#pragma once
// What leaves the bus of a made-up run, collected.

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "bridge/outward/converter.h"
#include "test/support/synthetic_log.h"

namespace morphbus::bridge {

/// A message that left the bus.
struct Sent {
  OutwardTopic topic;
  int64_t time_ns = 0;
  std::string bytes;
};

/// Takes what a converter sends.
class Collector {
 public:
  OutwardSink sink() {
    return [this](OutwardTopic topic, int64_t time_ns, const std::string& bytes) {
      sent.push_back({topic, time_ns, bytes});
    };
  }
  /// The messages of a topic, parsed.
  template <class M>
  [[nodiscard]] std::vector<M> Of(OutwardTopic topic) const {
    std::vector<M> messages;
    for (const Sent& s : sent) {
      if (s.topic != topic) continue;
      messages.emplace_back();
      EXPECT_TRUE(messages.back().ParseFromString(s.bytes));
    }
    return messages;
  }
  std::vector<Sent> sent;
};

/// The model of a made-up run.
inline std::shared_ptr<const RunModel> Model(const test::SyntheticOptions& options) {
  auto run = ReadRunWithRobot(test::SyntheticDescription(options.robot, options.run));
  EXPECT_TRUE(run.has_value()) << run.error().message;
  return *run;
}

/// Everything that a run's messages become.
inline Collector Convert(const test::SyntheticOptions& options, const ProgramText& text = nullptr) {
  Collector collector;
  Converter converter(Model(options), "src", text);
  converter.Begin(collector.sink());
  for (const test::SyntheticEvent& event : test::SyntheticEvents(options)) {
    EXPECT_TRUE(
        converter.Take(event.channel, event.payload.data(), event.payload.size(), collector.sink()))
        << event.channel;
  }
  converter.Finish(collector.sink());
  return collector;
}

}  // namespace morphbus::bridge
