#include "tools/launch/control_desk.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "tools/base/files.h"
#include "tools/base/messages.h"
#include "tools/base/program.h"
#include "tools/launch/program_call.h"
#include "vm/limits.h"
#include "vm/spread/program_relay.h"

namespace morphbus::tools {
namespace {

using bridge::ControlAnswer;
using bridge::ControlCommand;
using bridge::ControlKind;

/// Commands that one tick takes: as many as a CLOCK names (kMostControls) but one, which is left
/// for a command that makes a paused run go on.
constexpr int kMostAtOnce = 4;
/// Seconds after which whoever waits for a tick hears that it may take longer.
constexpr double kLaterSeconds = 1;
/// The counter of a command that nobody awaits an answer to.
constexpr int64_t kNobody = -1;
constexpr const char* kStopped = "stopped by command";

/// Whether a command is about a module as a process.
bool OfProcess(ControlKind kind) {
  return kind == ControlKind::kKill || kind == ControlKind::kRestart || kind == ControlKind::kLose;
}

/// Whether a module begins anew by this command.
bool IsCold(const ControlCommand& command) {
  return command.kind == ControlKind::kRestart && command.cold;
}

/// Whether a run that is paused goes on by this command.
bool MovesOn(ControlKind kind) {
  return kind == ControlKind::kResume || kind == ControlKind::kStep || kind == ControlKind::kStop;
}

}  // namespace

ControlDesk::ControlDesk(const RunPlan& plan, ControlScript script, std::string folder,
                         bridge::SimParticipant* sim, sim::ControlledRobot* robot)
    : plan_(plan),
      script_(std::move(script)),
      folder_(std::move(folder)),
      sim_(*sim),
      robot_(*robot) {
  // A module whose process died without a trace begins anew, whoever started the new one.
  sim_.OnReplaced([this](size_t module, int64_t tick) {
    ControlCommand command;
    command.kind = ControlKind::kRestart;
    command.part.module = plan_.robot().modules[module].name;
    command.cold = true;
    // CLOCK of its first tick is out already.
    command.from = tick;
    Announce(command);
  });
}

void ControlDesk::Accept(Given* given, ControlAnswer::State state) {
  // The tick that is out has its sensors already: the next one is the first that shows the effect.
  if (given->counter == kNobody || given->answered || !answer_) return;
  // What is said now is done then.
  const int64_t tick = sim_.tick() + 1;
  given->command = Complete(given->command, tick);
  given->answered = true;
  answer_({given->counter, state, tick, 0, "", ControlText(given->command)});
}

void ControlDesk::Refuse(const Given& given, const Refusal& refusal, int64_t tick) {
  // Who waits for an answer gets it.
  const bool scripted = given.counter == kNobody;
  if (!scripted && !given.answered) {
    if (!answer_) return;
    return answer_(
        {given.counter, ControlAnswer::State::kRefused, tick, refusal.status, refusal.reason});
  }
  // Nobody waits for what a script says, or was promised for later: the user hears of it here.
  Warn(fmt::format("{}: tick {}: {}: {}", scripted ? "--commands" : "control", tick,
                   ControlText(given.command), refusal.reason));
}

void ControlDesk::Announce(const ControlCommand& command) {
  ++announced_;
  sim_.AnnounceControl(ControlText(command));
}

void ControlDesk::AnnounceBegun(const ControlCommand& command) {
  ++announced_;
  begun_anew_.push_back(command);
}

void ControlDesk::NameBegun() {
  for (const ControlCommand& command : std::exchange(begun_anew_, {})) {
    sim_.AnnounceControl(ControlText(command));
  }
}

int ControlDesk::NumPending() const {
  return announced_ + static_cast<int>(waiting_.size() + ordered_.size());
}

void ControlDesk::Give(int64_t counter, const ControlCommand& command) {
  Given given = {counter, command};
  const int64_t tick = sim_.tick() + 1;
  if (sim_.ending()) return Refuse(given, {kNo, "the run is over"}, tick);
  // A script says what was done once, and is told nothing that the run did not say then.
  const bool scripted = counter == kNobody;
  const int most = MovesOn(command.kind) ? kMostAtOnce + 1 : kMostAtOnce;
  if (!scripted && NumPending() >= most && command.kind != ControlKind::kStop) {
    return Refuse(given, {kNo, fmt::format("{} commands wait for the next tick already", most)},
                  tick);
  }
  Refusal refusal = Check(command);
  if (refusal.status == 0 && !scripted) refusal = CheckProgram(command);
  if (refusal.status == 0) refusal = CheckTime(command, tick, scripted);
  if (refusal.status != 0) return Refuse(given, refusal, tick);
  if (DoNow(given)) return;
  if (IsCold(command)) return BeginRestart(given);
  // A run that holds still takes it up when it goes on; nobody waits for that.
  if (Held()) Accept(&given, ControlAnswer::State::kLater);
  waiting_.push_back(std::move(given));
  // It leaves before the tick in which it is gone.
  if (command.kind == ControlKind::kLose) {
    sim_.Lose(static_cast<size_t>(*plan_.robot().FindModule(command.part.module)));
  }
}

void ControlDesk::BeginRestart(const Given& given) {
  if (plan_.description.mode() == "realtime") return Order(given);
  // A dead module must answer the present tick first, as the one that it was. It may share its
  // process with another that was killed; one that lives loses nothing by starting again.
  if (!killed_.empty()) {
    Given warm = {kNobody, given.command};
    warm.command.cold = false;
    warm.silent = true;
    ordered_.push_back(warm);
    order_(warm.command, 0);
  }
  waiting_.push_back(given);
  if (Held()) Accept(&waiting_.back(), ControlAnswer::State::kLater);
  // The old process ends between two ticks, so that the new one's first tick is certain.
  sim_.SetBarrier([this] { OrderColdRestarts(); });
}

void ControlDesk::OrderColdRestarts() {
  std::vector<Given> cold;
  for (const Given& given : waiting_) {
    if (IsCold(given.command)) cold.push_back(given);
  }
  std::erase_if(waiting_, [](const Given& given) { return IsCold(given.command); });
  for (const Given& given : cold) Order(given);
  EndColdRestarts();
}

void ControlDesk::EndColdRestarts() {
  const auto cold = [](const Given& given) { return IsCold(given.command); };
  if (std::none_of(ordered_.begin(), ordered_.end(), cold) &&
      std::none_of(waiting_.begin(), waiting_.end(), cold)) {
    sim_.PassBarrier();
  }
}

void ControlDesk::AnswerWaiting() {
  for (Given& given : waiting_) {
    if (given.answered || given.since.seconds() < kLaterSeconds) continue;
    Accept(&given, ControlAnswer::State::kLater);
  }
}

ControlDesk::Refusal ControlDesk::Check(const ControlCommand& command) {
  // A pause that waits for its tick is one already.
  const bool pausing = std::any_of(waiting_.begin(), waiting_.end(), [](const Given& given) {
    return given.command.kind == ControlKind::kPause;
  });
  switch (command.kind) {
    case ControlKind::kPause:
      if (!pausing && !sim_.paused()) return {};
      return {kNo, fmt::format("the run is paused already, at tick {}", sim_.tick())};
    case ControlKind::kResume:
    case ControlKind::kStep:
      if (sim_.paused()) return {};
      return {kNo, "the run is not paused"};
    case ControlKind::kSpeed:
    case ControlKind::kStop:
      return {};
    case ControlKind::kRestart:
      if (command.cold && !order_) return {kFailed, "this run has no launcher to do that"};
      return CheckNames(command);
    case ControlKind::kDeploy:
      return CheckDeploy(command);
    default:
      return CheckNames(command);
  }
}

ControlDesk::Refusal ControlDesk::CheckNames(const ControlCommand& command) {
  const model::Robot& robot = plan_.robot();
  // Every module that is named must be one of the robot's.
  for (const std::string& name : {command.part.module, command.mate.module, command.to}) {
    if (name.empty() || robot.FindModule(name)) continue;
    std::vector<std::string> names;
    for (const model::ModuleInstance& module : robot.modules) names.push_back(module.name);
    return {kUnusable,
            fmt::format("the robot has no module '{}'{}", name, DidYouMean(name, names))};
  }
  // What is addressed to a module that is lost would never be done.
  const bool by_part = OfProcess(command.kind) || command.kind == ControlKind::kInspect;
  const std::string& doer = by_part ? command.part.module : command.to;
  if (!doer.empty() && sim_.lost(static_cast<size_t>(*robot.FindModule(doer)))) {
    return {kNo, doer + " is lost: the run goes on without it"};
  }
  // So must be its link or connectors.
  for (const bridge::ControlPart& part : {command.part, command.mate}) {
    if (part.part.empty()) continue;
    const model::ModuleType& type = plan_.model.TypeOf(robot, *robot.FindModule(part.module));
    std::vector<std::string> names;
    if (command.kind == ControlKind::kPush) {
      for (const model::Link& link : type.links) names.push_back(link.name);
    } else {
      for (const model::Connector& connector : type.connectors) names.push_back(connector.name);
    }
    if (std::find(names.begin(), names.end(), part.part) != names.end()) continue;
    return {kUnusable,
            fmt::format("{} has no '{}'{}", part.module, part.part, DidYouMean(part.part, names))};
  }
  return {};
}

ControlDesk::Refusal ControlDesk::CheckProgram(const ControlCommand& command) {
  const int module = Addressee(command);
  const uint64_t hash = sim_.program_of(module);
  if (command.kind == ControlKind::kDeploy && hash == command.program_hash) {
    return {kNo, plan_.robot().modules[module].name + " runs this program already"};
  }
  if (command.kind != ControlKind::kInvoke) return {};
  // The program of the module that issues it says whether there is such a command.
  const vm::VerifiedProgram* program = FindProgram(hash);
  if (program == nullptr) return {kFailed, "nobody knows the program that runs there"};
  const Result<vm::InvokeRequest> request = ResolveCall(*program, command);
  return request ? Refusal() : Refusal{kUnusable, request.error().message};
}

ControlDesk::Refusal ControlDesk::CheckDeploy(const ControlCommand& command) {
  // The sim verifies an image itself: who laid it there may have been mistaken.
  if (const Refusal named = CheckNames(command); named.status != 0) return named;
  if (FindProgram(command.program_hash) == nullptr) {
    return {kUnusable, command.program + " was not handed over as an image that can be verified"};
  }
  const std::string& image = script_.images[command.program_hash];
  if (const std::string why = WhyNotFor(plan_.model, image); !why.empty()) return {kUnusable, why};
  return {};
}

bool ControlDesk::DoNow(Given given) {
  // Processes are the launcher's.
  const ControlCommand& command = given.command;
  const ControlKind kind = command.kind;
  if (OfProcess(kind) && kind != ControlKind::kLose && !IsCold(command)) {
    Order(given);
    return true;
  }
  if (kind != ControlKind::kSpeed && !MovesOn(kind)) return false;
  // A run that has not begun begins first, so that its log has a whole tick.
  if (kind == ControlKind::kStop && sim_.tick() == 0) return false;
  // Named first, for the next CLOCK may go out at once.
  if (kind == ControlKind::kStop) NameBegun();
  Announce(command);
  Accept(&given, ControlAnswer::State::kDone);
  if (kind == ControlKind::kStop) sim_.RequestStop(kStopped);
  if (kind == ControlKind::kSpeed) sim_.SetSpeed(command.speed);
  if (kind == ControlKind::kResume) {
    steps_left_ = 0;
    sim_.Resume();
  }
  if (kind == ControlKind::kStep) {
    steps_left_ += command.steps;
    sim_.Step(command.steps);
  }
  return true;
}

void ControlDesk::Order(const Given& given) {
  // A script's orders are noted at their ticks, and no more, unless they change messages.
  const bool cold = IsCold(given.command);
  if (given.counter == kNobody && !cold) return Announce(given.command);
  if (!order_) {
    return Refuse(given, {kFailed, "this run has no launcher to do that"}, sim_.tick() + 1);
  }
  // The answer waits for the launcher's.
  ordered_.push_back(given);
  const auto module = static_cast<size_t>(*plan_.robot().FindModule(given.command.part.module));
  order_(given.command, cold ? sim_.BeginIncarnation(module) : 0);
}

void ControlDesk::OrderDone(const std::string& error) {
  // The launcher answers in order.
  if (ordered_.empty()) return;
  Given given = ordered_.front();
  ordered_.erase(ordered_.begin());
  if (error.empty() && !given.silent) {
    // Processes take their time to begin anew. Named behind whatever else is said before the next
    // tick, so that a run with the same commands has the same CLOCK.
    IsCold(given.command) ? AnnounceBegun(given.command) : Announce(given.command);
    Accept(&given, ControlAnswer::State::kDone);
  } else if (!error.empty()) {
    Refuse(given, {kNo, error}, sim_.tick() + 1);
  }
  const std::string& module = given.command.part.module;
  if (error.empty() && given.command.kind == ControlKind::kKill) killed_.insert(module);
  if (error.empty() && given.command.kind == ControlKind::kRestart) killed_.erase(module);
  if (IsCold(given.command)) EndColdRestarts();
}

void ControlDesk::BeforeTick(int64_t tick) {
  // When tick 0 goes out depends on how soon processes start: what is given before takes effect at
  // tick 1.
  if (tick == 0) return;
  NameBegun();
  // Moved out first: what a command leads to may give others.
  for (const Given& given : std::exchange(waiting_, {})) {
    const ControlCommand command = Complete(given.command, tick);
    Refusal refusal = CheckTime(command, tick, given.counter == kNobody);
    if (refusal.status == 0) refusal = Do(command, tick);
    if (refusal.status != 0) {
      Refuse(given, refusal, tick);
      continue;
    }
    Announce(command);
    if (!given.answered && given.counter != kNobody && answer_) {
      answer_({given.counter, ControlAnswer::State::kDone, tick, 0, "", ControlText(command)});
    }
  }
}

void ControlDesk::AfterTick(int64_t tick) {
  // CLOCK is out, so the next one is empty yet, but for what this one had no room for; this tick
  // was one of those to step.
  announced_ = std::max(0, announced_ - kMostAtOnce - 1);
  if (steps_left_ > 0) --steps_left_;
  const std::vector<ScriptedCommand>& scripted = script_.commands;
  while (next_scripted_ < scripted.size() && scripted[next_scripted_].tick <= tick + 1) {
    // More than a CLOCK names wait for the tick whose CLOCK will, so that it stays true; a run that
    // holds still would never get there.
    if (NumPending() > kMostAtOnce && !Held()) break;
    // Counted before it is given: what it leads to may be the next tick.
    const ScriptedCommand& next = scripted[next_scripted_++];
    Give(kNobody, next.command);
  }
  // Nobody can reach a run in one process, so a pause that the script does not end has no end.
  if (folder_.empty() && Held()) {
    const std::string& reason = plan_.description.end_reason();
    sim_.RequestStop(reason.empty() ? "paused, with no command to resume" : reason);
  }
}

void ControlDesk::Finish() {
  for (const auto* given : {&waiting_, &ordered_}) {
    for (const Given& each : *given) Refuse(each, {kNo, "the run ended before"}, sim_.tick());
  }
  waiting_.clear();
  ordered_.clear();
}

ControlDesk::Refusal ControlDesk::Do(const ControlCommand& command, int64_t tick) {
  // Whatever fails here has changed nothing.
  if (const Refusal refusal = CheckProgram(command); refusal.status != 0) return refusal;
  const int addressee = Addressee(command);
  Result<void> done;
  switch (command.kind) {
    case ControlKind::kPause:
      sim_.Pause();
      break;
    case ControlKind::kStop:
      sim_.RequestStop(kStopped);
      break;
    case ControlKind::kPush: {
      const Eigen::Vector3d direction_W(command.direction_W[0], command.direction_W[1],
                                        command.direction_W[2]);
      done = robot_.Push(command.part.module, command.newtons * direction_W.normalized(),
                         command.part.part, command.seconds);
      break;
    }
    case ControlKind::kLose:
      robot_.Lose(*plan_.robot().FindModule(command.part.module));
      break;
    case ControlKind::kConnect:
      done = robot_.Connect(command.part.module, command.part.part, command.mate.module,
                            command.mate.part);
      break;
    case ControlKind::kDisconnect:
      done = robot_.Disconnect(command.part.module, command.part.part);
      break;
    case ControlKind::kDeploy:
      Deploy(command, addressee, tick);
      break;
    case ControlKind::kInvoke:
      sim_.Invoke(addressee, *ResolveCall(*FindProgram(sim_.program_of(addressee)), command));
      break;
    case ControlKind::kInspect:
      for (int m = 0; m < std::ssize(plan_.robot().modules); ++m) {
        const std::string& name = command.part.module;
        const bool asked = name.empty() || name == plan_.robot().modules[m].name;
        const auto module = static_cast<size_t>(m);
        if (asked && !sim_.lost(module)) sim_.Inspect(module);
      }
      break;
    default:
      break;
  }
  return done ? Refusal() : Refusal{kNo, done.error().message};
}

int ControlDesk::Addressee(const ControlCommand& command) const {
  // The root is in every robot, and everything spreads from there as well as from anywhere.
  const std::string& name = command.to.empty() ? plan_.description.root_module() : command.to;
  return plan_.robot().FindModule(name).value_or(0);
}

const vm::VerifiedProgram* ControlDesk::FindProgram(uint64_t hash) {
  // A module that has not been heard of yet runs what it was started with.
  if (hash == 0) hash = plan_.description.program_hash();
  const auto known = programs_.find(hash);
  if (known != programs_.end()) return known->second.get();
  // What a tool hands over lies in the run's folder, under its hash.
  std::string& image = script_.images[hash];
  if (image.empty() && hash == plan_.description.program_hash()) {
    image = plan_.description.program_image();
  }
  if (image.empty() && !folder_.empty()) {
    image = ReadFile(ImagePath(folder_, hash), vm::kMaxImageBytes).value_or("");
  }
  // The hash is that of the bytes, and the verifier has the last word.
  auto program = VerifyProgram(image);
  if (!program || (*program)->hash() != hash) {
    script_.images.erase(hash);
    return nullptr;
  }
  return (programs_[hash] = std::move(*program)).get();
}

}  // namespace morphbus::tools
