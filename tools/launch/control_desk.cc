#include "tools/launch/control_desk.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "bridge/wire/channels.h"
#include "tools/base/files.h"
#include "tools/base/messages.h"
#include "tools/base/program.h"
#include "tools/launch/program_call.h"
#include "vm/limits.h"

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
      robot_(*robot) {}

void ControlDesk::Accept(const Given& given, ControlAnswer::State state) {
  // The tick that is out has its sensors already: the next one is the first that shows the effect.
  if (given.counter == kNobody || given.answered || !answer_) return;
  answer_({given.counter, state, sim_.tick() + 1, 0, ""});
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
  if (refusal.status != 0) return Refuse(given, refusal, tick);
  if (DoNow(given)) return;
  // A run that holds still takes it up when it goes on; nobody waits for that.
  if (Held()) {
    Accept(given, ControlAnswer::State::kLater);
    given.answered = true;
  }
  waiting_.push_back(std::move(given));
}

void ControlDesk::AnswerWaiting() {
  for (Given& given : waiting_) {
    if (given.answered || given.since.seconds() < kLaterSeconds) continue;
    Accept(given, ControlAnswer::State::kLater);
    given.answered = true;
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
      if (command.cold) return {kUnusable, "a cold restart is not possible yet"};
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

bool ControlDesk::DoNow(const Given& given) {
  // Processes are the launcher's.
  const ControlCommand& command = given.command;
  const ControlKind kind = command.kind;
  if (kind == ControlKind::kKill || kind == ControlKind::kRestart) {
    Order(given);
    return true;
  }
  if (kind != ControlKind::kSpeed && !MovesOn(kind)) return false;
  // A run that has not begun begins first, so that its log has a whole tick.
  if (kind == ControlKind::kStop && sim_.tick() == 0) return false;
  // Named first, for the next CLOCK may go out at once.
  Announce(command);
  Accept(given, ControlAnswer::State::kDone);
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
  // A script's orders are noted at their ticks, and no more.
  if (given.counter == kNobody) return Announce(given.command);
  if (!order_) {
    return Refuse(given, {kFailed, "this run has no launcher to do that"}, sim_.tick() + 1);
  }
  // The answer waits for the launcher's.
  ordered_.push_back(given);
  order_(given.command);
}

void ControlDesk::OrderDone(const std::string& error) {
  // The launcher answers in order.
  if (ordered_.empty()) return;
  const Given given = ordered_.front();
  ordered_.erase(ordered_.begin());
  if (!error.empty()) return Refuse(given, {kNo, error}, sim_.tick() + 1);
  Announce(given.command);
  Accept(given, ControlAnswer::State::kDone);
}

void ControlDesk::BeforeTick(int64_t tick) {
  // Moved out first: what a command leads to may give others.
  for (const Given& given : std::exchange(waiting_, {})) {
    const Refusal refusal = Do(given.command);
    if (refusal.status != 0) {
      Refuse(given, refusal, tick);
      continue;
    }
    Announce(given.command);
    if (!given.answered && given.counter != kNobody && answer_) {
      answer_({given.counter, ControlAnswer::State::kDone, tick, 0, ""});
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
    sim_.RequestStop("paused, with no command to resume");
  }
}

void ControlDesk::Finish() {
  for (const auto* given : {&waiting_, &ordered_}) {
    for (const Given& each : *given) Refuse(each, {kNo, "the run ended before"}, sim_.tick());
  }
  waiting_.clear();
  ordered_.clear();
}

ControlDesk::Refusal ControlDesk::Do(const ControlCommand& command) {
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
    case ControlKind::kConnect:
      done = robot_.Connect(command.part.module, command.part.part, command.mate.module,
                            command.mate.part);
      break;
    case ControlKind::kDisconnect:
      done = robot_.Disconnect(command.part.module, command.part.part);
      break;
    case ControlKind::kDeploy: {
      const std::string& image = script_.images[command.program_hash];
      sim_.Deploy(addressee, command.program_hash, {image.begin(), image.end()});
      break;
    }
    case ControlKind::kInvoke:
      sim_.Invoke(addressee, *ResolveCall(*FindProgram(sim_.program_of(addressee)), command));
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
