// LCM's own tools on our logs and our replay. Runs in a network of its own (see CMakeLists.txt).

#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

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

TEST(StockToolsTest, LcmLogplayerReplaysOurLogMessageForMessage) {
  const TempLog file;
  auto bus = bridge::OpenLcmBus(kUrl);
  ASSERT_TRUE(bus.has_value()) << bus.error().message;
  Events heard;
  (*bus)->SubscribePrefix(
      "synth/", [&](std::string_view channel, const uint8_t* data, size_t size) {
        heard.emplace(std::string(channel), std::vector<uint8_t>(data, data + size));
      });
  const Events expected = OfRun(test::SyntheticEvents({}), true);
  Child player({"lcm-logplayer", "--lcm-url=" + std::string(kUrl), "--speed=0.2", file.path()});
  ASSERT_TRUE(player.started());
  const bridge::MonotonicTime time;
  const int64_t deadline = time.NowUs() + kPatienceUs;
  while (heard.size() < expected.size() && time.NowUs() < deadline) (*bus)->Handle(50);
  EXPECT_EQ(heard, expected);
}

TEST(StockToolsTest, LcmLoggerRecordsOurReplayMessageForMessage) {
  const TempLog file;
  const TempFile recording("stock.log");
  Child logger({"lcm-logger", "--lcm-url=" + std::string(kUrl), "-f", "--flush-interval=1",
                recording.path()});
  ASSERT_TRUE(logger.started());
  const auto recorded = [&] {
    Events events;
    auto reader = EventLogReader::Open(recording.path());
    LogEvent event;
    while (reader && (*reader)->Next(&event)) {
      if (event.channel.substr(0, 6) != "synth/") continue;
      events.emplace(event.channel, std::vector<uint8_t>(event.data.begin(), event.data.end()));
    }
    return events;
  };
  auto bus = bridge::OpenLcmBus(kUrl);
  ASSERT_TRUE(bus.has_value()) << bus.error().message;
  const bridge::MonotonicTime time;
  const int64_t deadline = time.NowUs() + kPatienceUs;
  // The logger listens once something of ours arrives in its file.
  while (recorded().empty() && time.NowUs() < deadline) {
    (*bus)->Publish("synth/READY", nullptr, 0);
    (*bus)->Handle(50);
  }
  ReplayOptions options;
  options.speed = 4.0;
  options.listen_us = 0;
  const Result<ReplayProgress> done = Replay(file.path(), options, bus->get(), nullptr, {});
  ASSERT_TRUE(done.has_value()) << done.error().message;
  const Events expected = OfRun(test::SyntheticEvents({}), false);
  Events events;
  while (events.size() < expected.size() && time.NowUs() < deadline) {
    (*bus)->Handle(50);
    events = recorded();
    events.erase("synth/READY");
  }
  EXPECT_EQ(events, expected);
  logger.Interrupt();
  while (!logger.Ended() && time.NowUs() < deadline) (*bus)->Handle(20);
}

}  // namespace
}  // namespace morphbus::logger
