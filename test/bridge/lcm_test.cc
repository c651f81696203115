// The bus over real LCM. Runs in a network of its own (test/support/netns.sh).

#include <arpa/inet.h>
#include <dirent.h>
#include <gtest/gtest.h>
#include <lcm/lcm.h>
#include <linux/filter.h>
#include <netinet/in.h>
#include <sched.h>
#include <sys/socket.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <limits>
#include <list>
#include <map>

#include "bridge/bus/bus_adapters.h"
#include "bridge/bus/lcm_bus.h"
#include "bridge/bus/lcm_url.h"
#include "bridge/bus/udpm_sources.h"
#include "test/bridge/fake_run.h"

namespace morphbus::bridge {
namespace {

std::unique_ptr<Bus> Open(const std::string& url = "") {
  auto bus = OpenLcmBus(url);
  if (!bus) {
    ADD_FAILURE() << bus.error().message;
    std::abort();
  }
  return std::move(*bus);
}

void Publish(Bus* bus, const std::string& channel, size_t size = 100) {
  const std::vector<uint8_t> bytes(size, 0x55);
  bus->Publish(channel, bytes.data(), bytes.size());
}

/// Handles until `done`; the test's time limit is the only other way out.
template <class Done>
void HandleUntil(Bus* bus, const Done& done) {
  while (!done()) bus->Handle(10);
}

/// Instructions of the filters on this process's sockets that receive from the group's port.
std::vector<int> FilterSizes() {
  std::vector<int> sizes;
  for (int fd = 0; fd < 256; ++fd) {
    sockaddr_in address = {};
    socklen_t length = sizeof address;
    if (getsockname(fd, reinterpret_cast<sockaddr*>(&address), &length) != 0) continue;
    if (address.sin_family != AF_INET || ntohs(address.sin_port) != 7667) continue;
    std::array<sock_filter, BPF_MAXINSNS> program;
    socklen_t count = program.size();
    sizes.push_back(getsockopt(fd, SOL_SOCKET, SO_GET_FILTER, program.data(), &count) == 0
                        ? static_cast<int>(count)
                        : 0);
  }
  return sizes;
}

TEST(Lcm, DeliversWhatIsSubscribedAndNothingElse) {
  const auto sender = Open(), receiver = Open();
  std::string heard;
  for (const char* channel : {"run/a", "run/b"}) {
    receiver->Subscribe(channel, [&heard](std::string_view name, const uint8_t*, size_t size) {
      heard += std::string(name) + ":" + std::to_string(size) + " ";
    });
  }
  Publish(sender.get(), "run/c");
  Publish(sender.get(), "run/a", 1);
  Publish(sender.get(), "run/ab");
  Publish(sender.get(), "run/b", 1300);
  HandleUntil(receiver.get(), [&] { return heard.size() >= 16; });
  EXPECT_EQ(heard, "run/a:1 run/b:1300 ");
}

TEST(Lcm, DatagramsOfAnyLengthArriveWhole) {
  const auto sender = Open(), receiver = Open();
  std::vector<size_t> heard;
  receiver->Subscribe("run/a", [&heard](std::string_view, const uint8_t* data, size_t size) {
    bool right = true;
    for (size_t i = 0; i < size; ++i) right = right && data[i] == static_cast<uint8_t>(i * 7);
    heard.push_back(right ? size : 0);
  });
  const std::vector<size_t> sizes = {1, 1300, 2030, 2040, 2048, 2049, 5000, 60'000, 3};
  for (const size_t size : sizes) {
    std::vector<uint8_t> bytes(size);
    for (size_t i = 0; i < size; ++i) bytes[i] = static_cast<uint8_t>(i * 7);
    sender->Publish("run/a", bytes.data(), bytes.size());
  }
  HandleUntil(receiver.get(), [&] { return heard.size() >= sizes.size(); });
  EXPECT_EQ(heard, sizes);
}

TEST(Lcm, QuietChannelsEndNoWaitAndComeBeforeWhatDoes) {
  const auto sender = Open(), receiver = Open();
  std::string heard;
  const auto note = [&heard](std::string_view name, const uint8_t*, size_t) {
    heard += std::string(name) + " ";
  };
  Interest quiet;
  quiet.wakes = false;
  receiver->Subscribe("run/quiet", note, quiet);
  receiver->Subscribe("run/loud", note);
  // A wait that nothing ends lasts its time, and then takes what is there.
  Publish(sender.get(), "run/quiet");
  const MonotonicTime time;
  const int64_t before = time.NowUs();
  EXPECT_EQ(receiver->HandleFor(20'000), 1);
  EXPECT_GE(time.NowUs() - before, 20'000);
  EXPECT_EQ(heard, "run/quiet ");
  // What was sent before a message that wakes is dispatched before it.
  heard.clear();
  Publish(sender.get(), "run/quiet");
  Publish(sender.get(), "run/quiet");
  Publish(sender.get(), "run/loud");
  HandleUntil(receiver.get(), [&] { return heard.ends_with("run/loud "); });
  EXPECT_EQ(heard, "run/quiet run/quiet run/loud ");
  // Who waits for a lost one is woken by it: this wait would outlast the test's time limit.
  heard.clear();
  receiver->WakeForAny(true);
  Publish(sender.get(), "run/quiet");
  EXPECT_EQ(receiver->HandleFor(int64_t{3600} * 1'000'000), 1);
}

/// What the kernel gives a socket for filters, in this network alone, until this is destroyed.
class FilterMemory {
 public:
  explicit FilterMemory(int bytes) {
    std::ifstream(kPath) >> before_;
    set_ = before_ > 0 && Write(bytes);
  }
  ~FilterMemory() {
    if (set_) Write(before_);
  }
  FilterMemory(const FilterMemory&) = delete;
  FilterMemory& operator=(const FilterMemory&) = delete;
  /// False if the kernel does not let itself be told.
  [[nodiscard]] bool set() const { return set_; }

 private:
  static constexpr const char* kPath = "/proc/sys/net/core/optmem_max";
  static bool Write(int bytes) {
    std::ofstream limit(kPath);
    limit << bytes << std::flush;
    return limit.good();
  }
  int before_ = 0;
  bool set_ = false;
};

TEST(Lcm, FiltersOfManyModulesFitIntoWhatOlderKernelsGive) {
  // The default before Linux 6.8.
  const FilterMemory old_default(20480);
  if (!old_default.set()) GTEST_SKIP() << "net.core.optmem_max cannot be set here";
  const auto sender = Open(), receiver = Open();
  constexpr int kModules = 1000;
  int heard = 0;
  const auto count = [&heard](std::string_view, const uint8_t*, size_t) { ++heard; };
  Interest quiet;
  quiet.wakes = false;
  const auto name = [](int module, const char* topic) {
    return "run/m" + std::to_string(module) + "/" + topic;
  };
  {
    const SubscriptionBatch together(receiver.get());
    for (int i = 0; i < kModules; ++i) {
      receiver->Subscribe(name(i, "RESEND"), count);
      receiver->Subscribe(name(i, "TRANSFORM"), count, quiet);
    }
  }
  // The old program and the new one are there at once for a moment.
  receiver->Subscribe("run/SIM/CLOCK", count);
  EXPECT_EQ(receiver->losses().refused_filters, 0);
  for (const int size : FilterSizes()) EXPECT_GT(size, 0);
  // Nothing else comes through, though it would fill any queue.
  for (int i = 0; i < 20000; ++i) Publish(sender.get(), name(i % kModules, "ACTUATOR"));
  for (int i = 0; i < kModules; ++i)
    Publish(sender.get(), name(i, i % 2 == 0 ? "RESEND" : "TRANSFORM"));
  HandleUntil(receiver.get(), [&] { return heard >= kModules; });
  EXPECT_EQ(heard, kModules);
}

TEST(Lcm, AFilterThatTheKernelRefusesIsCountedAndLetsEverythingPass) {
  const FilterMemory hardly_any(300);
  if (!hardly_any.set()) GTEST_SKIP() << "net.core.optmem_max cannot be set here";
  const auto sender = Open(), receiver = Open();
  std::string heard;
  const auto note = [&heard](std::string_view name, const uint8_t*, size_t) {
    heard += std::string(name) + " ";
  };
  receiver->Subscribe("run/a_channel", note);
  receiver->Subscribe("run/another_channel", note);
  EXPECT_GT(receiver->losses().refused_filters, 0);
  EXPECT_EQ(FilterSizes(), std::vector<int>{0});
  Publish(sender.get(), "run/foreign");
  Publish(sender.get(), "run/a_channel");
  Publish(sender.get(), "run/another_channel");
  HandleUntil(receiver.get(), [&] { return heard.ends_with("another_channel "); });
  EXPECT_EQ(heard, "run/a_channel run/another_channel ");
}

TEST(Lcm, TheKernelDropsForeignChannels) {
  const auto sender = Open(), receiver = Open();
  EXPECT_TRUE(FilterSizes().empty()) << "who only publishes has no receiving socket";
  int heard = 0;
  const auto count = [&heard](std::string_view, const uint8_t*, size_t) { ++heard; };
  receiver->Subscribe("run/a", count);
  ASSERT_EQ(FilterSizes().size(), 1u);
  const int one = FilterSizes()[0];
  EXPECT_GT(one, 0);
  receiver->Subscribe("run/b", count);
  EXPECT_GT(FilterSizes()[0], one);
  receiver->Unsubscribe("run/b");
  EXPECT_EQ(FilterSizes()[0], one);
  // Far more foreign messages than LCM could queue do not push ours out.
  for (int i = 0; i < 20000; ++i) Publish(sender.get(), "run/foreign");
  Publish(sender.get(), "run/a");
  HandleUntil(receiver.get(), [&] { return heard > 0; });
  EXPECT_EQ(receiver->losses().queue_overflows, 0);
  receiver->SubscribePrefix("run/", count);
  EXPECT_EQ(FilterSizes()[0], 0) << "a prefix needs everything";
  heard = 0;
  Publish(sender.get(), "run/whatever");
  HandleUntil(receiver.get(), [&] { return heard > 0; });
}

TEST(Lcm, SubscriptionsThatAreHeldChangeTheFilterOnce) {
  const auto sender = Open(), receiver = Open();
  std::string heard;
  const auto note = [&heard](std::string_view name, const uint8_t*, size_t) {
    heard += std::string(name) + " ";
  };
  receiver->Subscribe("run/old", note);
  const std::vector<int> before = FilterSizes();
  {
    const SubscriptionBatch together(receiver.get());
    for (const char* channel : {"run/a", "run/b", "run/c"}) receiver->Subscribe(channel, note);
    receiver->Unsubscribe("run/old");
    receiver->Unsubscribe("run/b");
    EXPECT_EQ(FilterSizes(), before);
  }
  EXPECT_NE(FilterSizes(), before);
  // One by one again, and what was held is what counts.
  for (const char* channel : {"run/old", "run/a", "run/b", "run/c"}) Publish(sender.get(), channel);
  HandleUntil(receiver.get(), [&] { return heard.ends_with("run/c "); });
  EXPECT_EQ(heard, "run/a run/c ");
  const std::vector<int> after = FilterSizes();
  receiver->Subscribe("run/d", note);
  EXPECT_NE(FilterSizes(), after);
}

/// How many of the addresses that messages come from are listed as those that sockets listen to.
int NumListedSources() {
  std::ifstream table("/proc/net/mcfilter");
  std::string line;
  int listed = 0;
  // Index, interface, group, source, sockets that include it, sockets that exclude it.
  while (std::getline(table, line)) listed += line.find("0x7f4c43") != std::string::npos ? 1 : 0;
  return listed;
}

TEST(Lcm, SendersThatAReceiverDoesNotNeedAreNotListenedToAndAllThatItNeedsComes) {
  const auto sender = Open(), receiver = Open();
  std::map<std::string, int> heard;
  const auto count = [&heard](std::string_view channel, const uint8_t*, size_t) {
    ++heard[std::string(channel)];
  };
  EXPECT_EQ(NumListedSources(), 0);
  receiver->Subscribe("run/0", count);
  EXPECT_EQ(NumListedSources(), 1);
  // Whatever is needed later comes, from whichever address.
  const int channels = 3 * kNumSources;
  for (int i = 1; i < channels; ++i) {
    receiver->Subscribe("run/" + std::to_string(i), count);
    for (int j = 0; j <= i; ++j) Publish(sender.get(), "run/" + std::to_string(j));
    HandleUntil(receiver.get(), [&] { return heard["run/" + std::to_string(i)] == 1; });
    EXPECT_EQ(heard["run/0"], i);
  }
  // Nobody lists all there are.
  EXPECT_EQ(NumListedSources(), 0);
  // A publisher that knows nothing of addresses is heard, too, and so is everything by a prefix.
  lcm_t* stock = lcm_create(kDefaultLcmUrl);
  ASSERT_NE(stock, nullptr);
  const auto listener = Open();
  listener->Subscribe("run/0", count);
  heard.clear();
  lcm_publish(stock, "run/0", "x", 1);
  HandleUntil(listener.get(), [&] { return heard["run/0"] > 0; });
  lcm_destroy(stock);
  listener->SubscribePrefix("run/", count);
  heard.clear();
  for (int i = 0; i < channels; ++i) Publish(sender.get(), "run/" + std::to_string(i));
  HandleUntil(listener.get(), [&] { return heard.size() == static_cast<size_t>(channels); });
}

TEST(Lcm, StockSubscribersSeeEverything) {
  const auto sender = Open(), filtered = Open();
  filtered->Subscribe("run/a", [](std::string_view, const uint8_t*, size_t) {});
  lcm_t* stock = lcm_create(kDefaultLcmUrl);
  ASSERT_NE(stock, nullptr);
  int heard = 0;
  const lcm_msg_handler_t count = [](const lcm_recv_buf_t*, const char*, void* user) {
    ++*static_cast<int*>(user);
  };
  lcm_subscribe(stock, "run/.*", count, &heard);
  for (const char* channel : {"run/a", "run/b", "run/c"}) Publish(sender.get(), channel);
  while (heard < 3) lcm_handle_timeout(stock, 10);
  lcm_destroy(stock);
}

/// Bytes that the kernel takes for a message of ours in a socket, which is more than the message.
constexpr int kKernelBytes = 2048;

/// What the kernel gives the sockets of this process that receive from the group's port; the least
/// of them. It is what net.core.rmem_max allows.
int ReceiveBuffer() {
  int least = std::numeric_limits<int>::max();
  for (int fd = 0; fd < 256; ++fd) {
    sockaddr_in address = {};
    socklen_t length = sizeof address;
    if (getsockname(fd, reinterpret_cast<sockaddr*>(&address), &length) != 0) continue;
    if (address.sin_family != AF_INET || ntohs(address.sin_port) != 7667) continue;
    int bytes = 0;
    socklen_t size = sizeof bytes;
    getsockopt(fd, SOL_SOCKET, SO_RCVBUF, &bytes, &size);
    least = std::min(least, bytes);
  }
  return least;
}

TEST(Lcm, ABurstOfAThousandIsNotLost) {
  const auto sender = Open(), receiver = Open();
  if (ReceiveBuffer() < 1000 * kKernelBytes) GTEST_SKIP() << "net.core.rmem_max is too low";
  int heard = 0;
  receiver->Subscribe("run/a", [&heard](std::string_view, const uint8_t*, size_t) { ++heard; });
  for (int i = 0; i < 1000; ++i) Publish(sender.get(), "run/a", 200);
  HandleUntil(receiver.get(), [&] { return heard == 1000; });
}

TEST(Lcm, ABusyReceiverKeepsWhatTheSocketHolds) {
  const auto sender = Open(), receiver = Open();
  if (ReceiveBuffer() < static_cast<int>(kBusQueueDepth) * kKernelBytes) {
    GTEST_SKIP() << "net.core.rmem_max is too low";
  }
  int heard = 0;
  // A receiver that is busy: it handles nothing while far more arrives than it may keep.
  receiver->Subscribe("run/a", [&heard](std::string_view, const uint8_t*, size_t) { ++heard; });
  const int sent = static_cast<int>(3 * kBusQueueDepth);
  for (int i = 0; i < sent; ++i) Publish(sender.get(), "run/a", 20);
  int before = -1;
  while (heard != before) {
    before = heard;
    receiver->Handle(200);
  }
  EXPECT_GE(heard, static_cast<int>(kBusQueueDepth));
  EXPECT_LE(heard, sent);
}

TEST(Lcm, WithoutARouteItSaysWhatToDo) {
  const pid_t child = fork();
  if (child == 0) {
    if (unshare(CLONE_NEWNET) != 0) _exit(77);
    const auto bus = OpenLcmBus("");
    if (bus) _exit(1);
    const std::string& why = bus.error().message;
    const bool good = why.find("has no route") != std::string::npos &&
                      why.find("ip route add 224.0.0.0/4 dev lo") != std::string::npos &&
                      why.find("--isolate") != std::string::npos &&
                      why.find('\n') == std::string::npos;
    _exit(good ? 0 : 2);
  }
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST(Lcm, BadUrlsAreRefused) { EXPECT_FALSE(OpenLcmBus("udpm://10.0.0.1:7667")); }

TEST(Lcm, OtherProvidersWork) {
  const auto bus = Open("memq://");
  int heard = 0;
  bus->Subscribe("run/a", [&heard](std::string_view, const uint8_t*, size_t) { ++heard; });
  Publish(bus.get(), "run/a");
  HandleUntil(bus.get(), [&] { return heard == 1; });
}

TEST(Lcm, ARunOverLcmHasTheHashOfOneInProcessWithAndWithoutLoss) {
  FakeRunOptions options;
  options.ticks = 100;
  FakeRun reference(options);
  ASSERT_TRUE(reference.Run());
  for (const double loss : {0.0, 0.2}) {
    options.loss = loss;
    options.connect = [] { return Open(); };
    FakeRun run(options);
    ASSERT_TRUE(run.Run());
    EXPECT_TRUE(run.sim->outcome().ok) << run.sim->outcome().error;
    EXPECT_EQ(run.sim->outcome().run_hash, reference.sim->outcome().run_hash) << "loss " << loss;
    EXPECT_EQ(run.sim->outcome().recorded_hash, reference.sim->outcome().run_hash);
  }
}

/// LCM's bus, which notes what its participant is interested in.
class NotingLcmBus : public ForwardingBus {
 public:
  using Interests = std::map<std::string, Interest>;
  explicit NotingLcmBus(Interests* interests)
      : ForwardingBus(nullptr), lcm_(Open()), interests_(*interests) {
    inner_ = lcm_.get();
  }
  void Receive(const Channels& channels, Handler handler) override {
    if (channels.by == Channels::By::kName) interests_[channels.name] = channels.interest;
    inner_->Receive(channels, std::move(handler));
  }

 private:
  std::unique_ptr<Bus> lcm_;
  Interests& interests_;
};

TEST(Lcm, AModuleIsWokenByItsOwnSensorsAlone) {
  std::list<NotingLcmBus::Interests> interests;
  FakeRunOptions options;
  options.ticks = 100;
  options.logger = false;
  options.connect = [&interests] {
    return std::make_unique<NotingLcmBus>(&interests.emplace_back());
  };
  FakeRun run(options);
  ASSERT_TRUE(run.Run());
  int modules = 0;
  for (const NotingLcmBus::Interests& noted : interests) {
    if (!noted.contains("test/SIM/SENSORS")) continue;  // The sim's own.
    ++modules;
    for (const auto& [channel, interest] : noted) {
      const bool transform = channel.ends_with("/TRANSFORM");
      const bool filtered = channel.ends_with("/CLOCK") || channel.ends_with("/SENSORS");
      EXPECT_EQ(interest.wakes, !transform) << channel;
      EXPECT_EQ(interest.width > 0, filtered) << channel;
    }
  }
  EXPECT_EQ(modules, options.modules);
  // On a busy machine somebody is asked for what is only late: each request and each message that
  // is sent again may come to everybody.
  int64_t again = run.sim->ledger().asked + run.sim->ledger().resent;
  for (const FakeRun::Module& module : run.modules) {
    again += module.participant->ledger().asked + module.participant->ledger().resent;
  }
  for (const FakeRun::Module& module : run.modules) {
    // SENSORS and the mates' TRANSFORM of every tick, and CLOCK at the beginning and the end only.
    const int64_t mates = &module == &run.modules.front() || &module == &run.modules.back() ? 1 : 2;
    EXPECT_LT(module.participant->ledger().received,
              options.ticks * (1 + mates) + options.ticks / 2 + again);
  }
}

}  // namespace
}  // namespace morphbus::bridge
