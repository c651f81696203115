// LCM's own tools on our logs and our replay. Runs in a network of its own (see CMakeLists.txt).

#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <map>

#include "bridge/bus/lcm_bus.h"
#include "bridge/lockstep/participant.h"
#include "logger/log/replayer.h"
#include "test/logger/temp_log.h"

extern char** environ;

namespace morphbus::logger {
namespace {

constexpr const char* kUrl = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4194304";
constexpr int64_t kPatienceUs = 60'000'000;

/// A child process that is gone when the test is over.
class Child {
 public:
  explicit Child(std::vector<std::string> arguments) {
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    if (posix_spawnp(&pid_, argv[0], nullptr, nullptr, argv.data(), environ) != 0) pid_ = -1;
  }
  ~Child() {
    if (pid_ > 0) {
      kill(pid_, SIGKILL);
      waitpid(pid_, nullptr, 0);
    }
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  [[nodiscard]] bool started() const { return pid_ > 0; }
  /// True once it has ended.
  bool Ended() {
    if (pid_ > 0 && waitpid(pid_, nullptr, WNOHANG) == pid_) pid_ = -1;
    return pid_ < 0;
  }
  void Interrupt() const { kill(pid_, SIGINT); }

 private:
  pid_t pid_ = -1;
};

using Events = std::multimap<std::string, std::vector<uint8_t>>;

Events OfRun(const std::vector<test::SyntheticEvent>& events, bool with_end) {
  Events out;
  for (const test::SyntheticEvent& e : events) {
    if (with_end || e.channel != "synth/END") out.emplace(e.channel, e.payload);
  }
  return out;
}

// So many messages of at most 2 kB fit into the socket as kernels come configured
// (net.core.rmem_max of 212992 bytes, of which they give twice that): a receiver that is slow loses
// none of them.
constexpr size_t kHeldBySocket = 200;

TEST(StockToolsTest, LcmLogplayerReplaysOurLogMessageForMessage) {
  test::SyntheticOptions options;
  options.ticks = 20;
  const TempLog file(options);
  auto bus = bridge::OpenLcmBus(kUrl);
  ASSERT_TRUE(bus.has_value()) << bus.error().message;
  Events heard;
  (*bus)->SubscribePrefix(
      "synth/", [&](std::string_view channel, const uint8_t* data, size_t size) {
        heard.emplace(std::string(channel), std::vector<uint8_t>(data, data + size));
      });
  const Events expected = OfRun(test::SyntheticEvents(options), true);
  ASSERT_LE(expected.size(), kHeldBySocket);
  Child player({"lcm-logplayer", "--lcm-url=" + std::string(kUrl), "--speed=0.2", file.path()});
  ASSERT_TRUE(player.started());
  const bridge::MonotonicTime time;
  const int64_t deadline = time.NowUs() + kPatienceUs;
  while (heard.size() < expected.size() && time.NowUs() < deadline) (*bus)->Handle(50);
  EXPECT_EQ(heard, expected);
}

/// The events of a recording that are of the run.
Events RecordedIn(const std::string& path) {
  Events events;
  auto reader = EventLogReader::Open(path);
  LogEvent event;
  while (reader && (*reader)->Next(&event)) {
    if (!event.channel.starts_with("synth/")) continue;
    events.emplace(event.channel, std::vector<uint8_t>(event.data.begin(), event.data.end()));
  }
  return events;
}

/// How many of `all` are not in `part`; -1 if `part` has an event that `all` has not.
int Lacking(const Events& part, const Events& all) {
  Events rest = all;
  for (const auto& event : part) {
    const auto [begin, end] = rest.equal_range(event.first);
    const auto found =
        std::find_if(begin, end, [&](const auto& e) { return e.second == event.second; });
    if (found == end) return -1;
    rest.erase(found);
  }
  return static_cast<int>(rest.size());
}

/// Replays the log for a fresh lcm-logger and returns what that recorded, once it has everything or
/// was given its time and told to stop. What the replay sent is checked by a subscriber of ours.
Events RecordOneReplay(const std::string& log, const Events& expected, bridge::Bus* bus,
                       int64_t deadline_us) {
  const TempFile recording("stock.log");
  Child logger({"lcm-logger", "--lcm-url=" + std::string(kUrl), "-f", "--flush-interval=1",
                recording.path()});
  EXPECT_TRUE(logger.started());
  const bridge::MonotonicTime time;
  const auto recorded = [&] {
    Events events = RecordedIn(recording.path());
    events.erase("synth/READY");
    return events;
  };
  // The logger listens once something of ours arrives in its file.
  while (RecordedIn(recording.path()).empty() && time.NowUs() < deadline_us) {
    bus->Publish("synth/READY", nullptr, 0);
    bus->Handle(50);
  }
  auto listener = bridge::OpenLcmBus(kUrl);
  EXPECT_TRUE(listener.has_value()) << (listener ? "" : listener.error().message);
  if (!listener) return {};
  Events heard;
  (*listener)->SubscribePrefix(
      "synth/", [&](std::string_view channel, const uint8_t* data, size_t size) {
        if (channel == "synth/READY") return;
        heard.emplace(std::string(channel), std::vector<uint8_t>(data, data + size));
      });
  ReplayOptions options;
  options.speed = 1.0;
  options.listen_us = 0;
  const Result<ReplayProgress> done = Replay(log, options, bus, nullptr, [&](Replayer*) {
    while ((*listener)->Handle(0) > 0) continue;
  });
  EXPECT_TRUE(done.has_value()) << (done ? "" : done.error().message);
  while (heard.size() < expected.size() && time.NowUs() < deadline_us) (*listener)->Handle(50);
  EXPECT_EQ(heard, expected) << "the replay itself is not whole";
  // The logger writes what it has at its end, after what was under way has had time to arrive.
  const int64_t patience_us = std::min(deadline_us, time.NowUs() + 2'000'000);
  while (Lacking(recorded(), expected) > 0 && time.NowUs() < patience_us) {
    (*listener)->Handle(50);
  }
  logger.Interrupt();
  while (!logger.Ended() && time.NowUs() < deadline_us) bus->Handle(20);
  return recorded();
}

// lcm-logger queues 30 messages at most and drops the rest, which a busy machine makes it do. So
// what it recorded must be what we sent and nothing else; that the replay itself is whole our own
// subscriber shows.
TEST(StockToolsTest, LcmLoggerRecordsMessagesOfOurReplayAndNoOthers) {
  const TempLog file;
  const Events expected = OfRun(test::SyntheticEvents({}), false);
  auto bus = bridge::OpenLcmBus(kUrl);
  ASSERT_TRUE(bus.has_value()) << bus.error().message;
  const int64_t deadline = bridge::MonotonicTime().NowUs() + kPatienceUs;
  const Events recorded = RecordOneReplay(file.path(), expected, bus->get(), deadline);
  EXPECT_FALSE(recorded.empty());
  EXPECT_GE(Lacking(recorded, expected), 0) << "lcm-logger recorded something that nobody sent";
}

}  // namespace
}  // namespace morphbus::logger
