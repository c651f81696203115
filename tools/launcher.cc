#include "tools/launcher.h"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <csignal>

#include "bridge/channels.h"
#include "bridge/lcm_bus.h"
#include "tools/program.h"
#include "tools/progress.h"
#include "tools/wall_clock.h"

namespace morphbus::tools {
namespace {

constexpr const char* kSimName = "sim";
constexpr const char* kLogName = "log";
constexpr int kPollMs = 50;
constexpr double kEndSeconds = 5.0;  ///< In which every process must be gone once the run is over.
constexpr double kStopSeconds = 10.0;  ///< In which a run must be over once it was told to stop.

std::string ModuleName(const model::ModuleInstance& module) { return "module " + module.name; }

}  // namespace

Launcher::Launcher(const RunPlan& plan, const RunOptions& options, const RunDirectory& directory,
                   std::string log)
    : plan_(plan), options_(options), directory_(directory) {
  outcome_.run = plan.description.run();
  outcome_.log = std::move(log);
}

Result<void> Launcher::WriteInputs() {
  const std::string& folder = directory_.path();
  if (Result<void> r = WriteFile(folder + "/description.pb", plan_.description.SerializeAsString());
      !r) {
    return r;
  }
  if (Result<void> r = WriteFile(folder + "/program.image", plan_.description.program_image());
      !r) {
    return r;
  }
  for (const proto::KinematicsImage& entry : plan_.description.kinematics()) {
    const std::string path = fmt::format("{}/{}.kinematics", folder, entry.type_name());
    if (Result<void> r = WriteFile(path, entry.image()); !r) return r;
  }
  return {};
}

Result<ControlLink> Launcher::StartLinked(const std::string& name, std::vector<std::string> argv,
                                          int death_signal) {
  Result<std::pair<ControlLink, int>> link = ControlLink::Create();
  if (!link) return morphbus::Fail(link.error().message);
  argv.insert(argv.end(), {"--description", directory_.path() + "/description.pb", "--control-fd",
                           std::to_string(link->second)});
  if (!options_.lcm_url.empty()) argv.insert(argv.end(), {"--lcm-url", options_.lcm_url});
  ChildProcess::Options child;
  child.name = name;
  child.argv = std::move(argv);
  child.death_signal = death_signal;
  child.inherited_fd = link->second;
  Result<ChildProcess> started = ChildProcess::Start(child);
  close(link->second);
  if (!started) return morphbus::Fail(started.error().message);
  children_.push_back(std::move(*started));
  return std::move(link->first);
}

Result<void> Launcher::StartModule(size_t module) {
  const model::ModuleInstance& instance = plan_.robot().modules[module];
  const std::string& type = plan_.model.TypeOf(plan_.robot(), static_cast<int>(module)).name;
  const proto::RunDescription& d = plan_.description;
  std::vector<std::string> argv = {ExecutableFolder() + "/morphbus-module",
                                   "--run",
                                   d.run(),
                                   "--module",
                                   instance.name,
                                   "--id",
                                   std::to_string(module),
                                   "--kinematics",
                                   fmt::format("{}/{}.kinematics", directory_.path(), type),
                                   "--program",
                                   directory_.path() + "/program.image",
                                   "--tick-us",
                                   std::to_string(d.tick_us())};
  if (instance.name == d.root_module()) {
    const RootPose root = RootPoseOf(plan_, static_cast<int>(module));
    const vm::PoseF X = ToVmPose(root.X_RL);
    // Nine digits bring the same float back, so that the in-process run broadcasts the same pose.
    argv.insert(argv.end(),
                {"--root-link", std::to_string(root.link),
                 fmt::format("--root-pose={:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g}", X.p.x,
                             X.p.y, X.p.z, X.q.w, X.q.x, X.q.y, X.q.z)});
  }
  if (d.mode() == "realtime") argv.push_back("--realtime");
  if (d.loss() > 0) {
    const uint64_t seed = ReceiverSeed(d.seed(), kFirstModuleReceiver + static_cast<int>(module));
    argv.insert(argv.end(),
                {"--loss", fmt::format("{}", d.loss()), "--seed", std::to_string(seed)});
  }
  if (!options_.lcm_url.empty()) argv.insert(argv.end(), {"--lcm-url", options_.lcm_url});
  Result<ChildProcess> started = ChildProcess::Start({ModuleName(instance), argv});
  if (!started) return morphbus::Fail(started.error().message);
  children_.push_back(std::move(*started));
  return {};
}

Result<void> Launcher::StartAll() {
  if (Result<void> written = WriteInputs(); !written) return written;
  const std::string program = ExecutableFolder() + "/morphbus";
  // The logger closes its file on SIGTERM, so even a launcher that is killed leaves a sound log.
  Result<ControlLink> log = StartLinked(kLogName, {program, "log", "-o", outcome_.log}, SIGTERM);
  if (!log) return morphbus::Fail(log.error().message);
  log_.emplace(std::move(*log));
  Result<ControlLink> sim = StartLinked(kSimName, {program, "sim"}, SIGKILL);
  if (!sim) return morphbus::Fail(sim.error().message);
  sim_.emplace(std::move(*sim));
  for (size_t module = 0; module < plan_.robot().modules.size(); ++module) {
    if (Result<void> started = StartModule(module); !started) return started;
  }
  return {};
}

RunOutcome Launcher::Run() {
  CatchSignals();
  if (Result<void> started = StartAll(); !started) {
    outcome_.error = started.error().message;
    StopAll();
    return outcome_;
  }
  // Only now, so that no thread of LCM exists while we fork.
  const Result<std::unique_ptr<bridge::Bus>> bus = bridge::OpenLcmBus(options_.lcm_url);
  std::vector<std::string> processes = {std::string(bridge::kSimProcess),
                                        std::string(bridge::kLogProcess)};
  for (const model::ModuleInstance& module : plan_.robot().modules)
    processes.push_back(module.name);
  std::optional<HealthListener> health;
  if (bus) health.emplace(bus->get(), outcome_.run, processes);
  Progress progress(plan_.robot().name, plan_.num_ticks(), plan_.description.tick_us());
  const WallTimer timer;
  while (!AllEnded() && outcome_.error.empty()) {
    Watch();
    if (bus) (*bus)->Handle(0);
    progress.Show(outcome_.ticks);
    CheckPatience();
    if (sim_reported_ && Find(kSimName)->ended()) {
      AwaitEnd(kEndSeconds);
      break;
    }
  }
  progress.Clear();
  if (!outcome_.error.empty()) StopAll();
  if (outcome_.wall_seconds == 0) outcome_.wall_seconds = timer.seconds();
  if (bus) {
    (*bus)->Handle(0);
    outcome_.health = health->table();
  }
  return outcome_;
}

/// Sleeps until something happens, and takes it in.
void Launcher::Watch() {
  std::vector<pollfd> fds;
  for (const ChildProcess& child : children_) {
    if (!child.ended()) fds.push_back({child.pidfd(), POLLIN, 0});
  }
  for (const auto* link : {&sim_, &log_}) {
    if (!(*link)->closed()) fds.push_back({(*link)->fd(), POLLIN, 0});
  }
  poll(fds.data(), fds.size(), kPollMs);
  TakeMessages();
  CheckChildren();
}

void Launcher::TakeMessages() {
  for (const Json& message : sim_->Receive()) {
    if (message.contains("tick")) outcome_.ticks = message.value("tick", outcome_.ticks);
    if (!message.contains("outcome")) continue;
    const Json& report = message["outcome"];
    sim_reported_ = true;
    outcome_.ticks = report.value("ticks", outcome_.ticks);
    outcome_.hash = report.value("hash", "");
    outcome_.reason = report.value("reason", "");
    outcome_.messages = report.value("messages", int64_t{0});
    outcome_.missed_deadlines = report.value("missed_deadlines", int64_t{0});
    outcome_.wall_seconds = report.value("wall_seconds", 0.0);
    if (!report.value("ok", false)) outcome_.error = report.value("error", "the simulator failed");
  }
  for (const Json& message : log_->Receive()) {
    if (!message.contains("log")) continue;
    log_reported_ = true;
    outcome_.log = message.value("log", outcome_.log);
  }
}

/// A process that ends before the simulator says that the run is over has failed.
void Launcher::CheckChildren() {
  for (ChildProcess& child : children_) {
    if (child.ended() || !child.Poll()) continue;
    TakeMessages();  // its last words may still wait in the socket
    if (!sim_reported_ && child.status() == 0) {
      // The simulator's own report may be a moment behind its farewell to the modules.
      if (first_leaver_.empty()) {
        first_leaver_ = child.name();
        since_left_ = WallTimer();
      }
    } else if (!sim_reported_) {
      Fail(fmt::format("{} {}", child.name(), child.exit_text()));
    } else if (child.status() != 0 && outcome_.error.empty()) {
      Fail(fmt::format("{} {} at the end of the run", child.name(), child.exit_text()));
    }
  }
}

/// Passes a signal on, and sees to it that what must end does.
void Launcher::CheckPatience() {
  if (CaughtSignal() != 0 && !interrupted_) {
    interrupted_ = true;
    since_interrupted_ = WallTimer();
    sim_->Deliver({{"stop", CaughtSignal() == SIGINT ? "interrupted" : "stopped"}});
  }
  if (interrupted_ && since_interrupted_.seconds() > kStopSeconds)
    Fail("the run did not stop when told to");
  if (!first_leaver_.empty() && !sim_reported_ && since_left_.seconds() > kEndSeconds) {
    Fail(first_leaver_ + " left the run before its end");
  }
}

void Launcher::Fail(const std::string& error) {
  if (outcome_.error.empty()) outcome_.error = error;
}

/// Waits for all to end by themselves; names who does not.
void Launcher::AwaitEnd(double seconds) {
  const WallTimer timer;
  while (!AllEnded() && timer.seconds() < seconds) Watch();
  for (const ChildProcess& child : children_) {
    if (!child.ended()) Fail(fmt::format("{} did not end with the run", child.name()));
  }
}

/// The end of a run that failed: nothing new is simulated, the log is closed, nobody is left.
void Launcher::StopAll() {
  if (ChildProcess* sim = Find(kSimName)) sim->Signal(SIGKILL);
  ChildProcess* log = Find(kLogName);
  if (log != nullptr && !log->ended() && log_) {
    log_->Deliver({{"stop", outcome_.error}});
    const WallTimer timer;
    while (!log->Poll() && timer.seconds() < kEndSeconds) {
      pollfd fd = {log->pidfd(), POLLIN, 0};
      poll(&fd, 1, kPollMs);
    }
    for (const Json& message : log_->Receive()) outcome_.log = message.value("log", outcome_.log);
    log_reported_ = log_reported_ || log->status() == 0;
  }
  children_.clear();  // kills and waits
  if (!log_reported_) outcome_.log += ".partial";
  if (access(outcome_.log.c_str(), F_OK) != 0) outcome_.log.clear();
}

bool Launcher::AllEnded() const {
  for (const ChildProcess& child : children_) {
    if (!child.ended()) return false;
  }
  return true;
}

ChildProcess* Launcher::Find(const std::string& name) {
  for (ChildProcess& child : children_) {
    if (child.name() == name) return &child;
  }
  return nullptr;
}

}  // namespace morphbus::tools
