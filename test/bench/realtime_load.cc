// What sixty modules' traffic in real time costs: a process each, 50 ticks a second, over the
// project's bus or over stock LCM. In every tick the simulator publishes a state in parts of 12
// modules; each module, when its part comes, publishes 300 bytes for its two neighbours and 200 for
// the simulator. Prints the CPU time of all module processes, in percent of one processor, and how
// long the state took to reach the modules, in microseconds: median and 99th percentile.
//
//   realtime_load plain|ours MODULES SECONDS      (in a network namespace of its own)

#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>
#include <lcm/lcm-cpp.hpp>

#include <algorithm>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/bus/lcm_bus.h"

namespace {

constexpr const char* kUrl = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4194304";
constexpr int kTicksASecond = 50;
constexpr int kModulesAPart = 12;
constexpr size_t kStateBytes = 1200, kNeighbourBytes = 300, kCommandBytes = 200;
/// A number at the place where SENSORS has that of its part.
constexpr uint32_t kPartOffset = 16;
constexpr int64_t kNever = -1;

int64_t NowUs() {
  timespec now = {};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return int64_t{now.tv_sec} * 1'000'000 + now.tv_nsec / 1000;
}

/// Either bus, as far as this program needs it.
class Endpoint {
 public:
  using Handler = std::function<void(const uint8_t* data)>;
  virtual ~Endpoint() = default;
  virtual void Publish(const std::string& channel, const std::vector<uint8_t>& bytes) = 0;
  /// Every module needs its own part of the state when it comes.
  virtual void HearState(int part, Handler handler) = 0;
  /// What a neighbour says is needed when the next state comes.
  virtual void HearNeighbour(const std::string& channel) = 0;
  virtual void Wait() = 0;
};

/// Stock LCM as its users write it.
class PlainLcm : public Endpoint {
 public:
  void Publish(const std::string& channel, const std::vector<uint8_t>& bytes) override {
    bus_.publish(channel, bytes.data(), static_cast<unsigned>(bytes.size()));
  }
  void HearState(int part, Handler handler) override {
    handler_ = std::move(handler);
    bus_.subscribe("STATE_" + std::to_string(part), &PlainLcm::OnState, this);
  }
  void HearNeighbour(const std::string& channel) override {
    bus_.subscribe(channel, &PlainLcm::OnNeighbour, this);
  }
  void Wait() override { bus_.handle(); }

 private:
  void OnState(const lcm::ReceiveBuffer* received, const std::string&) {
    handler_(static_cast<const uint8_t*>(received->data));
  }
  void OnNeighbour(const lcm::ReceiveBuffer*, const std::string&) {}

  lcm::LCM bus_{kUrl};
  Handler handler_;
};

/// The project's bus, with what the modules of a run tell it of their needs.
class OurBus : public Endpoint {
 public:
  OurBus() : bus_(*morphbus::bridge::OpenLcmBus(kUrl)) {}
  void Publish(const std::string& channel, const std::vector<uint8_t>& bytes) override {
    bus_->Publish(channel, bytes.data(), bytes.size());
  }
  void HearState(int part, Handler handler) override {
    const morphbus::bridge::Interest own{true, 2, kPartOffset, static_cast<uint16_t>(part), false};
    bus_->Subscribe(
        "STATE_" + std::to_string(part),
        [handler](std::string_view, const uint8_t* data, size_t) { handler(data); }, own);
  }
  void HearNeighbour(const std::string& channel) override {
    const morphbus::bridge::Interest quiet{false, 0, 0, 0, false};
    bus_->Subscribe(
        channel, [](std::string_view, const uint8_t*, size_t) {}, quiet);
  }
  void Wait() override { bus_->HandleFor(1'000'000); }

 private:
  std::unique_ptr<morphbus::bridge::Bus> bus_;
};

std::unique_ptr<Endpoint> Open(bool plain) {
  if (plain) return std::make_unique<PlainLcm>();
  return std::make_unique<OurBus>();
}

/// Answers every state until killed, and notes how long each took to come.
[[noreturn]] void RunModule(bool plain, int index, int modules, int64_t* delays, int most) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  const std::unique_ptr<Endpoint> bus = Open(plain);
  const std::string own = std::to_string(index);
  std::vector<uint8_t> news(kNeighbourBytes), command(kCommandBytes);
  bus->HearState(index / kModulesAPart, [&](const uint8_t* data) {
    int64_t sent_us = 0, tick = 0;
    std::memcpy(&sent_us, data, sizeof sent_us);
    std::memcpy(&tick, data + sizeof sent_us, sizeof tick);
    if (tick >= 0 && tick < most) delays[tick] = NowUs() - sent_us;
    bus->Publish("NEWS_" + own, news);
    bus->Publish("CMD_" + own, command);
  });
  if (index > 0) bus->HearNeighbour("NEWS_" + std::to_string(index - 1));
  if (index + 1 < modules) bus->HearNeighbour("NEWS_" + std::to_string(index + 1));
  while (true) bus->Wait();
}

void SleepUntil(int64_t us) {
  const timespec at = {us / 1'000'000, us % 1'000'000 * 1000};
  clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, nullptr);
}

/// Publishes one tick's state.
void PublishState(Endpoint* bus, int parts, int64_t tick) {
  std::vector<uint8_t> state(kStateBytes);
  for (int part = 0; part < parts; ++part) {
    const int64_t now_us = NowUs();
    std::memcpy(state.data(), &now_us, sizeof now_us);
    std::memcpy(state.data() + sizeof now_us, &tick, sizeof tick);
    state[kPartOffset] = static_cast<uint8_t>(part >> 8);
    state[kPartOffset + 1] = static_cast<uint8_t>(part);
    bus->Publish("STATE_" + std::to_string(part), state);
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  const bool plain = std::string(argv[1]) == "plain";
  const int modules = std::atoi(argv[2]), ticks = std::atoi(argv[3]) * kTicksASecond;
  const int parts = (modules + kModulesAPart - 1) / kModulesAPart;
  // The children write what they measure to memory that is shared with us.
  const size_t samples = static_cast<size_t>(modules) * static_cast<size_t>(ticks);
  auto* delays =
      static_cast<int64_t*>(mmap(nullptr, samples * sizeof(int64_t), PROT_READ | PROT_WRITE,
                                 MAP_SHARED | MAP_ANONYMOUS, -1, 0));
  if (delays == MAP_FAILED) return 2;
  std::fill_n(delays, samples, kNever);
  std::vector<pid_t> children;
  for (int i = 0; i < modules; ++i) {
    const pid_t pid = fork();
    if (pid == 0) RunModule(plain, i, modules, delays + static_cast<size_t>(i) * ticks, ticks);
    children.push_back(pid);
  }
  const std::unique_ptr<Endpoint> bus = Open(plain);
  // Ticks below zero are repeated until every module answers; the first measured one follows.
  const auto ready = [&] {
    for (int i = 0; i < modules; ++i) {
      if (delays[static_cast<size_t>(i) * ticks] == kNever) return false;
    }
    return true;
  };
  for (int tries = 0; !ready() && tries < 500; ++tries) {
    PublishState(bus.get(), parts, 0);
    SleepUntil(NowUs() + 20'000);
  }
  if (!ready()) return 3;
  // Only what follows counts: the processes' own clocks say how much they used before.
  const auto cpu_us = [&] {
    int64_t sum = 0;
    for (const pid_t pid : children) {
      clockid_t clock = 0;
      timespec used = {};
      if (clock_getcpuclockid(pid, &clock) == 0) clock_gettime(clock, &used);
      sum += int64_t{used.tv_sec} * 1'000'000 + used.tv_nsec / 1000;
    }
    return sum;
  };
  const int64_t used_us = cpu_us(), begin_us = NowUs();
  for (int tick = 1; tick < ticks; ++tick) {
    SleepUntil(begin_us + int64_t{tick} * 1'000'000 / kTicksASecond);
    PublishState(bus.get(), parts, tick);
  }
  SleepUntil(NowUs() + 20'000);
  const double percent =
      100.0 * static_cast<double>(cpu_us() - used_us) / static_cast<double>(NowUs() - begin_us);
  std::vector<int64_t> sorted;
  int64_t missing = 0;
  for (size_t i = 0; i < samples; ++i) {
    if (i % static_cast<size_t>(ticks) == 0) continue;  // The tick in which all started.
    delays[i] == kNever ? void(++missing) : sorted.push_back(delays[i]);
  }
  std::sort(sorted.begin(), sorted.end());
  std::printf("{\"cpu_percent\": %.2f, \"p50_us\": %ld, \"p99_us\": %ld, \"missing\": %ld}\n",
              percent, static_cast<long>(sorted[sorted.size() / 2]),
              static_cast<long>(sorted[sorted.size() * 99 / 100]), static_cast<long>(missing));
  for (const pid_t pid : children) kill(pid, SIGKILL);
  for (const pid_t pid : children) waitpid(pid, nullptr, 0);
  return 0;
}
