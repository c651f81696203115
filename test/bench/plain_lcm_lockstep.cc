// The peer of our lockstep: stock LCM as its users write it. One process publishes a state of 512
// bytes, nine others answer with a command of 200 bytes each, the first waits for all nine, and so
// on. No headers, checks, resends, neighbours or logger. Prints ticks a second.
//
//   plain_lcm_lockstep TICKS [MODULES]      (in a network namespace of its own)

#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>
#include <lcm/lcm-cpp.hpp>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

namespace {

constexpr const char* kUrl = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4194304";

/// Answers every STATE with CMD_<i>, until killed.
[[noreturn]] void RunModule(int index) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  lcm::LCM bus(kUrl);
  if (!bus.good()) std::_Exit(2);
  const std::string channel = "CMD_" + std::to_string(index);
  std::vector<char> answer(200);
  struct Context {
    lcm::LCM* bus;
    const std::string* channel;
    std::vector<char>* answer;
  } context{&bus, &channel, &answer};
  struct Handler {
    Context* c;
    void On(const lcm::ReceiveBuffer* received, const std::string&) {
      // Echo the tick so that the simulator can tell answers apart.
      std::copy_n(static_cast<const char*>(received->data), 8, c->answer->begin());
      c->bus->publish(*c->channel, c->answer->data(), static_cast<unsigned>(c->answer->size()));
    }
  } handler{&context};
  bus.subscribe("STATE", &Handler::On, &handler);
  while (bus.handle() == 0) {
  }
  std::_Exit(0);
}

struct Simulator {
  long tick = 0;
  int answers = 0;
  void On(const lcm::ReceiveBuffer* received, const std::string&) {
    long answered = 0;
    std::copy_n(static_cast<const char*>(received->data), 8, reinterpret_cast<char*>(&answered));
    if (answered == tick) ++answers;
  }
};

}  // namespace

int main(int argc, char** argv) {
  const long ticks = argc > 1 ? std::atol(argv[1]) : 1000;
  const int modules = argc > 2 ? std::atoi(argv[2]) : 9;
  std::vector<pid_t> children;
  for (int i = 0; i < modules; ++i) {
    const pid_t pid = fork();
    if (pid == 0) RunModule(i);
    children.push_back(pid);
  }
  lcm::LCM bus(kUrl);
  if (!bus.good()) return 2;
  Simulator simulator;
  for (int i = 0; i < modules; ++i) {
    bus.subscribe("CMD_" + std::to_string(i), &Simulator::On, &simulator)->setQueueCapacity(0);
  }
  std::vector<char> state(512);
  auto begin = std::chrono::steady_clock::now();
  for (simulator.tick = 1; simulator.tick <= ticks; ++simulator.tick) {
    simulator.answers = 0;
    std::copy_n(reinterpret_cast<const char*>(&simulator.tick), 8, state.begin());
    bus.publish("STATE", state.data(), static_cast<unsigned>(state.size()));
    // The first tick is repeated until every module has come up.
    while (simulator.answers < modules) {
      if (bus.handleTimeout(20) <= 0) {
        simulator.answers = 0;
        bus.publish("STATE", state.data(), static_cast<unsigned>(state.size()));
      }
    }
    if (simulator.tick == 1) begin = std::chrono::steady_clock::now();
  }
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  std::printf("%.1f\n", static_cast<double>(ticks - 1) / seconds);
  for (const pid_t pid : children) kill(pid, SIGKILL);
  for (const pid_t pid : children) waitpid(pid, nullptr, 0);
  return 0;
}
