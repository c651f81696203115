// The peer of our lockstep: stock LCM as its users write it, with the same messages. A simulator
// publishes the clock and the state, in parts of 12 modules; each module, in a process of its own,
// answers its part with a command, once it has what its neighbours in the chain said in the tick
// before, and tells them something itself; the simulator goes on when it has all commands; a
// logger, in a process of its own, writes everything to a log. Messages are as long as a run's of
// M-TRAN modules are on average. No checks, no hashes, no requests for what is lost: the simulator
// says the tick again if nothing comes for 20 ms. Prints ticks a second.
//
//   plain_lcm_lockstep TICKS [MODULES [LOG]]      (in a network namespace of its own)

#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>
#include <lcm/lcm-cpp.hpp>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <string>
#include <vector>

namespace {

constexpr const char* kUrl = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4194304";
constexpr int kModulesAPart = 12;
/// Bytes of CLOCK, of a part of SENSORS beside its modules, of a module in it, of TRANSFORM and of
/// ACTUATOR, as `morphbus info` gives them.
constexpr size_t kClockBytes = 74, kPartBytes = 30, kReadingBytes = 52, kTransformBytes = 238;
constexpr size_t kActuatorBytes = 102;

/// The tick stands at the beginning of every message.
std::vector<char> Stamped(size_t size, int64_t tick) {
  std::vector<char> message(size);
  std::memcpy(message.data(), &tick, sizeof tick);
  return message;
}

int64_t TickOf(const lcm::ReceiveBuffer* received) {
  int64_t tick = 0;
  std::memcpy(&tick, received->data, sizeof tick);
  return tick;
}

/// What all processes are called by the parts that concern them.
std::string Sensors(int part) { return "SENSORS_" + std::to_string(part); }
std::string Transform(int module) { return "TRANSFORM_" + std::to_string(module); }
std::string Actuator(int module) { return "ACTUATOR_" + std::to_string(module); }

/// A subscription whose queue has no limit, which would otherwise drop what does not fit.
template <class T>
void Subscribe(lcm::LCM* bus, const std::string& channel,
               void (T::*method)(const lcm::ReceiveBuffer*, const std::string&), T* object) {
  bus->subscribe(channel, method, object)->setQueueCapacity(0);
}

void Publish(lcm::LCM* bus, const std::string& channel, const std::vector<char>& message) {
  bus->publish(channel, message.data(), static_cast<unsigned>(message.size()));
}

/// One module: computes a tick when it has its state, and its neighbours' words of the last one.
class Module {
 public:
  Module(int index, int modules) : index_(index), bus_(kUrl) {
    if (!bus_.good()) std::_Exit(2);
    Subscribe(&bus_, Sensors(index / kModulesAPart), &Module::OnSensors, this);
    for (const int mate : {index - 1, index + 1}) {
      if (mate < 0 || mate >= modules) continue;
      heard_[Transform(mate)] = -1;
      Subscribe(&bus_, Transform(mate), &Module::OnTransform, this);
    }
  }

  [[noreturn]] void Run() {
    while (bus_.handle() == 0) {
    }
    std::_Exit(0);
  }

 private:
  void OnSensors(const lcm::ReceiveBuffer* received, const std::string&) {
    const int64_t tick = TickOf(received);
    // A tick that is said again has been computed, and is answered again.
    if (tick == computed_) Answer();
    sensed_ = std::max(sensed_, tick);
    Try();
  }

  void OnTransform(const lcm::ReceiveBuffer* received, const std::string& channel) {
    int64_t& heard = heard_[channel];
    heard = std::max(heard, TickOf(received));
    Try();
  }

  void Try() {
    const auto has = [this](const auto& mate) { return mate.second >= sensed_ - 1; };
    if (sensed_ <= computed_ || !std::all_of(heard_.begin(), heard_.end(), has)) return;
    computed_ = sensed_;
    Answer();
  }

  void Answer() {
    Publish(&bus_, Transform(index_), Stamped(kTransformBytes, computed_));
    Publish(&bus_, Actuator(index_), Stamped(kActuatorBytes, computed_));
  }

  int index_;
  lcm::LCM bus_;
  int64_t sensed_ = -1, computed_ = -1;
  std::map<std::string, int64_t> heard_;
};

/// Writes all that is said, as lcm-logger does.
class Logger {
 public:
  explicit Logger(const char* path) : bus_(kUrl), log_(path, "w") {
    if (!bus_.good() || !log_.good()) std::_Exit(2);
    Subscribe(&bus_, ".*", &Logger::On, this);
  }

  [[noreturn]] void Run() {
    while (bus_.handle() == 0) {
    }
    std::_Exit(0);
  }

 private:
  void On(const lcm::ReceiveBuffer* received, const std::string& channel) {
    lcm::LogEvent event = {number_++, received->recv_utime, channel,
                           static_cast<int32_t>(received->data_size), received->data};
    log_.writeEvent(&event);
  }

  lcm::LCM bus_;
  lcm::LogFile log_;
  int64_t number_ = 0;
};

/// Says each tick, and waits for the commands of all modules.
class Simulator {
 public:
  explicit Simulator(int modules) : modules_(modules), answered_(modules, -1), bus_(kUrl) {
    if (!bus_.good()) std::_Exit(2);
    for (int i = 0; i < modules; ++i) {
      numbers_[Actuator(i)] = i;
      Subscribe(&bus_, Actuator(i), &Simulator::On, this);
    }
  }

  void Tick(int64_t tick) {
    missing_ = modules_;
    tick_ = tick;
    Say();
    // The first tick is said until every module has come up.
    while (missing_ > 0) {
      if (bus_.handleTimeout(20) <= 0) Say();
    }
  }

 private:
  void Say() {
    Publish(&bus_, "CLOCK", Stamped(kClockBytes, tick_));
    for (int first = 0; first < modules_; first += kModulesAPart) {
      const int members = std::min(kModulesAPart, modules_ - first);
      const size_t size = kPartBytes + kReadingBytes * static_cast<size_t>(members);
      Publish(&bus_, Sensors(first / kModulesAPart), Stamped(size, tick_));
    }
  }

  void On(const lcm::ReceiveBuffer* received, const std::string& channel) {
    const int64_t tick = TickOf(received);
    int64_t& answered = answered_[static_cast<size_t>(numbers_[channel])];
    if (tick != tick_ || answered == tick) return;
    answered = tick;
    --missing_;
  }

  int modules_;
  std::vector<int64_t> answered_;
  std::map<std::string, int> numbers_;
  lcm::LCM bus_;
  int missing_ = 0;
  int64_t tick_ = -1;
};

/// Runs what it is given in a process that ends with this one.
template <class Body>
pid_t Start(const Body& body) {
  const pid_t pid = fork();
  if (pid != 0) return pid;
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  body();
  std::_Exit(0);
}

}  // namespace

int main(int argc, char** argv) {
  const long ticks = argc > 1 ? std::atol(argv[1]) : 1000;
  const int modules = argc > 2 ? std::atoi(argv[2]) : 9;
  const char* log = argc > 3 ? argv[3] : "/dev/null";
  if (ticks < 2 || modules < 1) {
    std::fprintf(stderr, "usage: plain_lcm_lockstep TICKS [MODULES [LOG]]\n");
    return 2;
  }
  std::vector<pid_t> children;
  for (int i = 0; i < modules; ++i) {
    children.push_back(Start([&] { Module(i, modules).Run(); }));
  }
  children.push_back(Start([&] { Logger(log).Run(); }));
  Simulator simulator(modules);
  // The first tick lasts until all are there, and is not measured.
  simulator.Tick(0);
  const auto begin = std::chrono::steady_clock::now();
  for (long tick = 1; tick < ticks; ++tick) simulator.Tick(tick);
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  std::printf("%.1f\n", static_cast<double>(ticks - 1) / seconds);
  for (const pid_t pid : children) kill(pid, SIGKILL);
  for (const pid_t pid : children) waitpid(pid, nullptr, 0);
  return 0;
}
