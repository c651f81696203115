#include "tools/launch/launcher.h"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <utility>

#include "bridge/module/snapshot_file.h"
#include "compiler/base/text.h"
#include "logger/compare/kinematic_tracks.h"
#include "tools/base/files.h"
#include "tools/base/json.h"
#include "tools/base/messages.h"
#include "tools/base/program.h"
#include "tools/launch/progress.h"
#include "tools/machine/key_choice.h"
#include "tools/machine/wall_clock.h"

namespace morphbus::tools {
namespace {

// So long Watch sleeps at most, in milliseconds: progress and timeouts are looked at meanwhile.
constexpr int kPollMs = 50;
constexpr double kEndSeconds = 5.0;  ///< In which every process must be gone once the run is over.

}  // namespace

Launcher::Launcher(const RunPlan& plan, const RunOptions& options, const RunDirectory& directory,
                   const RunRecord& record)
    : plan_(plan), options_(options), directory_(directory), record_(record) {
  outcome_.run = plan.description.run();
  outcome_.log = record.path();
  const std::vector<model::ModuleInstance>& modules = plan_.robot().modules;
  incarnations_.assign(modules.size(), 1);
  // Without --processes each module has a process of its own.
  const size_t most =
      options.processes == 0 ? modules.size() : static_cast<size_t>(options.processes);
  processes_.resize(std::min(most, modules.size()));
  for (int m = 0; m < std::ssize(modules); ++m) ProcessOf(m).modules.push_back(m);
  for (size_t p = 0; p < processes_.size(); ++p) {
    ModuleProcess& process = processes_[p];
    const std::string& first = modules[process.modules.front()].name;
    const std::string& last = modules[process.modules.back()].name;
    process.name = process.modules.size() == 1 ? "module " + first
                                               : fmt::format("modules {} to {}", first, last);
    process.state = fmt::format("{}/process-{}.state", directory.path(), p);
  }
}

Result<void> Launcher::WriteInputs() {
  // Sim and logger read the description, which holds everything. Modules, which are to be small
  // programs, get the two images that they need as files.
  const proto::RunDescription& d = plan_.description;
  std::vector<std::pair<std::string, std::string>> files = {
      {"description.pb", d.SerializeAsString()}, {"program.image", d.program_image()}};
  if (!d.faults().empty()) files.emplace_back("faults", d.faults());
  for (const proto::KinematicsImage& entry : d.kinematics()) {
    files.emplace_back(entry.type_name() + ".kinematics", entry.image());
  }
  for (const auto& [name, bytes] : files) {
    if (Result<void> r = WriteFile(directory_.path() + "/" + name, bytes); !r) return r;
  }
  // What the sim obeys: the script of a run that is repeated.
  return WriteScript(plan_.script, directory_.path());
}

Result<LauncherLink> Launcher::StartLinked(const std::string& name, std::vector<std::string> argv,
                                           int death_signal, std::vector<int> fds) {
  // The link comes before the child, which inherits one end of it by number.
  Result<std::pair<LauncherLink, int>> link = LauncherLink::Create();
  if (!link) return Fail(link.error().message);
  argv.insert(argv.end(), {"--description", directory_.path() + "/description.pb", "--launcher-fd",
                           std::to_string(link->second)});
  if (!options_.lcm_url.empty()) argv.insert(argv.end(), {"--lcm-url", options_.lcm_url});
  // Whether the run is open, the description says.
  if (!plan_.description.open()) argv.insert(argv.end(), {"--key", KeyPath(directory_.path())});
  // The descriptor is the child's from here on; ours closes, so that its end tells of our death.
  ChildProcess::Options child;
  child.name = name;
  child.argv = std::move(argv);
  child.death_signal = death_signal;
  child.inherited_fds = std::move(fds);
  child.inherited_fds.push_back(link->second);
  Result<ChildProcess> started = ChildProcess::Start(child);
  close(link->second);
  if (!started) return Fail(started.error().message);
  children_.push_back(std::move(*started));
  return std::move(link->first);
}

Launcher::ModuleProcess& Launcher::ProcessOf(int module) {
  // In order of the robot, since modules that are declared together are mostly mated.
  return processes_[static_cast<size_t>(module) * processes_.size() / plan_.robot().modules.size()];
}

bool Launcher::IsGone(const ModuleProcess& process) const {
  return std::ranges::all_of(process.modules, [this](int module) {
    return gone_.contains(plan_.robot().modules[module].name);
  });
}

std::string Launcher::StateFile(const ModuleProcess& process, int module) const {
  // Several modules of one process save to one file each.
  const bool alone = process.modules.size() == 1;
  return alone ? process.state : process.state + "." + plan_.robot().modules[module].name;
}

Result<void> Launcher::StartModules(const ModuleProcess& process, bool resume) {
  const proto::RunDescription& d = plan_.description;
  // A module knows its own type and the program; where it is in the robot, its neighbours tell it.
  const std::vector<int>& modules = process.modules;
  std::vector<std::string> names, ids, kinematics, incarnations;
  // It fails with the first state file that cannot be made; the process is then started without
  // any.
  Result<void> room;
  for (const int module : modules) {
    names.push_back(plan_.robot().modules[module].name);
    ids.push_back(std::to_string(module));
    kinematics.push_back(fmt::format("{}/{}.kinematics", directory_.path(),
                                     plan_.model.TypeOf(plan_.robot(), module).name));
    incarnations.push_back(std::to_string(incarnations_[module]));
    // Made now, so that one that is missing later is known to be lost.
    const std::string state = StateFile(process, module);
    if (const auto file = bridge::SnapshotFile::Open(state); !file && room) {
      room = tl::unexpected(file.error());
      unlink(state.c_str());
    }
  }
  const Result<std::string> program = ModuleProgram();
  if (!program) {
    return morphbus::Fail(
        fmt::format("cannot start {}: {}", process.name, program.error().message));
  }
  // The options are those of morphbus-module --help.
  std::vector<std::string> argv = {*program,
                                   "--run",
                                   d.run(),
                                   modules.size() == 1 ? "--module" : "--modules",
                                   fmt::format("{}", fmt::join(names, ",")),
                                   "--id",
                                   fmt::format("{}", fmt::join(ids, ",")),
                                   "--kinematics",
                                   fmt::format("{}", fmt::join(kinematics, ",")),
                                   "--program",
                                   directory_.path() + "/program.image",
                                   "--tick-us",
                                   std::to_string(d.tick_us()),
                                   "--incarnation",
                                   fmt::format("{}", fmt::join(incarnations, ",")),
                                   "--restarts",
                                   std::to_string(process.restarts)};
  if (d.open()) {
    argv.push_back("--open");
  } else {
    argv.insert(argv.end(), {"--key", KeyPath(directory_.path())});
  }
  // It saves its state, so that it can be restarted; where there is no room for that, it runs on
  // without, and begins anew should it die.
  if (!room && no_room_.empty()) {
    no_room_ = room.error().message;
    news_.push_back(fmt::format(
        "modules whose processes die will begin anew, as their state cannot be saved: {}",
        no_room_));
  }
  if (room) argv.insert(argv.end(), {"--snapshot", process.state});
  if (resume && room) argv.push_back("--resume");
  // The root is told where it is; its pose spreads over the connections to the others.
  const auto root_name = std::find(names.begin(), names.end(), d.root_module());
  if (root_name != names.end()) {
    const RootPose root = RootPoseOf(plan_, modules[root_name - names.begin()]);
    const vm::PoseF X = logger::ToVmPose(root.X_RL);
    // Nine digits bring the same float back, so that the in-process run broadcasts the same pose.
    argv.insert(argv.end(),
                {"--root-module", *root_name, "--root-link", std::to_string(root.link),
                 fmt::format("--root-pose={:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g}", X.p.x,
                             X.p.y, X.p.z, X.q.w, X.q.x, X.q.y, X.q.z)});
  }
  argv.insert(argv.end(), {"--random-seed", std::to_string(d.random_seed())});
  if (d.mode() == "realtime") argv.push_back("--realtime");
  // What befalls the messages that it receives. Its name makes its random numbers its own.
  argv.insert(argv.end(),
              {"--loss", fmt::format("{}", d.loss()), "--seed", std::to_string(d.seed())});
  if (!d.faults().empty()) argv.insert(argv.end(), {"--faults", directory_.path() + "/faults"});
  if (!options_.lcm_url.empty()) argv.insert(argv.end(), {"--lcm-url", options_.lcm_url});
  Result<ChildProcess> started = ChildProcess::Start({process.name, argv});
  if (!started) return Fail(started.error().message);
  children_.push_back(std::move(*started));
  return {};
}

Result<std::vector<std::string>> Launcher::RestartModules(const ModuleProcess& process) {
  // Two processes must never claim to be one module: the old one is gone before the new one starts.
  children_.remove_if([&](const ChildProcess& other) { return other.name() == process.name; });
  killed_.erase(process.name);
  // A file that is empty belongs to a process that had said nothing yet; one that is not there, or
  // that cannot be opened, is lost with all that its module knew.
  std::vector<std::string> lost;
  for (const int module : process.modules) {
    const std::string file = StateFile(process, module);
    if (access(file.c_str(), F_OK) == 0 && bridge::SnapshotFile::Open(file)) continue;
    lost.push_back(plan_.robot().modules[module].name);
    ++incarnations_[module];
  }
  if (Result<void> started = StartModules(process, true); !started) {
    return Fail(started.error().message);
  }
  return lost;
}

void Launcher::OnModuleDeath(ModuleProcess* process, const std::string& how) {
  const std::string what = process->name + " " + how;
  ++process->restarts;
  const Result<std::vector<std::string>> lost = RestartModules(*process);
  if (!lost) return watch_.Fail(fmt::format("{}; {}", what, lost.error().message));
  // Whoever knows of it later reads it in the summary, and in HEALTH.
  for (const int module : process->modules) {
    ++outcome_.restarts[plan_.robot().modules[module].name];
  }
  news_.push_back(lost->empty() ? what + "; started again, it goes on where it was"
                                : fmt::format("{}; started again, and {} without a state, anew",
                                              what, NameFirst(*lost, 3)));
}

Result<void> Launcher::StartAll() {
  if (Result<void> written = WriteInputs(); !written) return written;
  const std::string program = OwnProgram();
  // The logger closes its file on SIGTERM, so even a launcher that is killed leaves a sound log.
  std::vector<std::string> log_argv = {program, "log", "-o", record_.path()};
  std::vector<int> log_fds;
  if (options_.force) log_argv.push_back("--force");
  if (record_.in_memory()) {
    log_argv.push_back("--in-memory");
    log_fds.push_back(record_.fd());
  }
  Result<LauncherLink> log =
      StartLinked(FailureWatch::kLog, std::move(log_argv), SIGTERM, std::move(log_fds));
  if (!log) return Fail(log.error().message);
  log_.emplace(std::move(*log));
  Result<LauncherLink> sim =
      StartLinked(FailureWatch::kSim, {program, "sim", "--run-folder", directory_.path()}, SIGKILL);
  if (!sim) return Fail(sim.error().message);
  sim_.emplace(std::move(*sim));
  for (const ModuleProcess& process : processes_) {
    if (Result<void> started = StartModules(process, false); !started) return started;
  }
  return {};
}

RunOutcome Launcher::Run() {
  CatchSignals();
  // A process that does not start ends the run before it begins, with those that did start.
  if (Result<void> started = StartAll(); !started) {
    watch_.Fail(started.error().message);
    StopAll();
    outcome_.error = watch_.error();
    return outcome_;
  }
  Progress progress(plan_.robot().name, plan_.num_ticks(), plan_.description.tick_us());
  const WallTimer timer;
  // The sim's report ends the run; any failure before it ends it too.
  while (!AllEnded() && watch_.error().empty()) {
    Watch();
    if (!news_.empty()) progress.Clear();
    for (const std::string& news : std::exchange(news_, {})) Warn(news);
    progress.Show(outcome_.ticks);
    CheckTimeouts();
    if (watch_.sim_reported() && Find(FailureWatch::kSim)->ended()) {
      AwaitEnd(watch_.error().empty() ? kEndSeconds : FailureWatch::kLeftSeconds);
      break;
    }
  }
  progress.Clear();
  // Who is still there after a failure is stopped, the logger last.
  if (!watch_.error().empty()) StopAll();
  outcome_.error = watch_.error();
  if (outcome_.wall_seconds == 0) outcome_.wall_seconds = timer.seconds();
  return outcome_;
}

void Launcher::Watch() {
  // A process that ends wakes us, and so does a word from sim or logger.
  std::vector<pollfd> fds;
  for (const ChildProcess& child : children_) {
    if (!child.ended()) fds.push_back({child.pidfd(), POLLIN, 0});
  }
  for (const auto* link : {&sim_, &log_}) {
    if (!(*link)->closed()) fds.push_back({(*link)->fd(), POLLIN, 0});
  }
  // What poll reports is not looked at: both functions below look at everything.
  poll(fds.data(), fds.size(), kPollMs);
  TakeMessages();
  CheckChildren();
  CarryOutOrders();
}

void Launcher::TakeMessages() {
  for (const Json& message : sim_->Receive()) {
    // Every message of the sim shows that it lives.
    watch_.SimSpoke();
    if (message.contains("tick")) outcome_.ticks = message.value("tick", outcome_.ticks);
    if (message.contains("gone")) gone_ = message.value("gone", std::set<std::string>());
    if (message.contains("order")) {
      orders_.push_back({message.value("order", "") == "kill", message.value("module", ""),
                         message.value("incarnation", uint32_t{0})});
    }
    if (!message.contains("outcome")) continue;
    // How the run ended, which only the sim knows.
    const Json& report = message["outcome"];
    outcome_.ticks = report.value("ticks", outcome_.ticks);
    outcome_.reason = report.value("reason", "");
    outcome_.missed_deadlines = report.value("missed_deadlines", int64_t{0});
    outcome_.wall_seconds = report.value("wall_seconds", 0.0);
    const bool ok = report.value("ok", false);
    watch_.SimReported(ok ? "" : report.value("error", "the simulator failed"));
  }
  for (const Json& message : log_->Receive()) {
    if (message.contains("error")) watch_.Fail("the log: " + message.value("error", ""));
    if (!message.contains("log")) continue;
    watch_.LogClosed(message.value("complete", true) ? "" : message.value("reason", ""));
    outcome_.log = message.value("log", outcome_.log);
    outcome_.hash = message.value("hash", "");
  }
}

void Launcher::CheckChildren() {
  // Starting one again changes the list, so that it is done afterwards.
  std::vector<std::pair<ModuleProcess*, std::string>> dead;
  for (ChildProcess& child : children_) {
    if (child.ended() || !child.Poll()) continue;
    TakeMessages();  // its last words may still wait in the socket
    const auto process = std::ranges::find(processes_, child.name(), &ModuleProcess::name);
    if (process != processes_.end() && IsGone(*process)) continue;
    if (killed_.contains(child.name())) continue;  // the sim will notice, if nobody restarts it
    if (watch_.OnExit(child.name(), child.status(), child.exit_text())) {
      dead.emplace_back(&*process, child.exit_text());
    }
  }
  for (const auto& [process, how] : dead) {
    if (watch_.error().empty()) OnModuleDeath(process, how);
  }
}

void Launcher::CheckTimeouts() {
  // The sim ends the run for all of us, at the next tick.
  if (CaughtSignal() != 0 && !interrupted_) {
    interrupted_ = true;
    watch_.Interrupted();
    sim_->Deliver({{"stop", CaughtSignal() == SIGINT ? "interrupted" : "stopped"}});
  }
  watch_.OnTime();
}

void Launcher::CarryOutOrders() {
  for (const Order& order : std::exchange(orders_, {})) {
    // Nobody is started for a run that is over, and nobody there awaits an answer.
    if (watch_.sim_reported() || !watch_.error().empty()) return;
    const Result<void> done = CarryOutOrder(order);
    sim_->Deliver({{"ordered", done ? "" : done.error().message}});
  }
}

Result<void> Launcher::CarryOutOrder(const Order& order) {
  const std::optional<int> module = plan_.robot().FindModule(order.module);
  if (!module) return Fail("no such module: " + order.module);
  const ModuleProcess& process = ProcessOf(*module);
  ChildProcess* child = Find(process.name);
  // Killed on purpose, it does not end the run; whether the others can go on without it is theirs
  // to find out.
  if (order.kills) {
    if (child == nullptr || child->Poll()) return Fail(process.name + " does not run");
    killed_.insert(process.name);
    child->Signal(SIGKILL);
    return {};
  }
  incarnations_[*module] = std::max(incarnations_[*module], order.incarnation);
  const Result<std::vector<std::string>> restarted = RestartModules(process);
  return restarted ? Result<void>() : Fail(restarted.error().message);
}

void Launcher::AwaitEnd(double seconds) {
  WakingTimer timer;
  // Nobody has waited for lost modules to hear that the run is over.
  for (const std::string& name : gone_) {
    const std::optional<int> module = plan_.robot().FindModule(name);
    ChildProcess* child = module ? Find(ProcessOf(*module).name) : nullptr;
    if (child != nullptr) child->Signal(SIGTERM);
  }
  // They end by themselves once the sim has said good-bye. Modules that had not joined hear nothing
  // of that, so a run that never began waits for its log only.
  const bool never_began = interrupted_ && outcome_.ticks == 0;
  while (!AllEnded() && timer.seconds() < seconds) {
    if (never_began && Find(FailureWatch::kLog)->ended()) return;
    Watch();
  }
  for (const ChildProcess& child : children_) {
    if (!child.ended()) watch_.Fail(fmt::format("{} did not end with the run", child.name()));
  }
}

void Launcher::StopAll() {
  // Without the sim no tick begins, and the modules have nothing more to say.
  if (ChildProcess* sim = Find(FailureWatch::kSim)) sim->Signal(SIGKILL);
  // The logger gets time to close its file, for the log of a failed run is what explains it.
  ChildProcess* log = Find(FailureWatch::kLog);
  bool closed = watch_.log_closed();
  if (log != nullptr && !log->ended() && log_) {
    log_->Deliver({{"stop", watch_.error()}});
    WakingTimer timer;
    while (!log->Poll() && timer.seconds() < kEndSeconds) {
      pollfd fd = {log->pidfd(), POLLIN, 0};
      poll(&fd, 1, kPollMs);
    }
    TakeMessages();  // its last words: where the log is
    closed = watch_.log_closed() || (log->ended() && log->status() == 0);
  }
  children_.clear();  // kills and waits
  // A logger that did not close its file leaves it under its temporary name.
  if (!closed) outcome_.log = record_.partial_path();
  // A path without a file would send the user looking for it.
  if (access(outcome_.log.c_str(), F_OK) != 0) outcome_.log.clear();
}

bool Launcher::AllEnded() const {
  return std::all_of(children_.begin(), children_.end(),
                     [](const ChildProcess& child) { return child.ended(); });
}

ChildProcess* Launcher::Find(const std::string& name) {
  for (ChildProcess& child : children_) {
    if (child.name() == name) return &child;
  }
  return nullptr;
}

}  // namespace morphbus::tools
