#include "tools/control/control_desk.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "tools/base/messages.h"

namespace morphbus::tools {
namespace {

using bridge::ControlAnswer;
using bridge::ControlCommand;
using bridge::ControlKind;

/// Commands that one tick takes: as many as a CLOCK names but one, which is left for a command that
/// makes a paused run go on.
constexpr int kMostAtOnce = static_cast<int>(bridge::TickPublisher::kMostAnnounced) - 1;
/// Bytes that the time of a deployment, with its option, adds to its text, and an image's hash.
constexpr size_t kTimeBytes = 16, kHashBytes = 17;
/// Seconds after which a sender that waits for a tick hears that it may take longer.
constexpr double kLaterSeconds = 1;

/// Whether a run that is paused goes on by this command.
bool MovesOn(ControlKind kind) {
  return kind == ControlKind::kResume || kind == ControlKind::kStep || kind == ControlKind::kStop;
}

/// What a run knows of its programs beforehand.
std::map<uint64_t, std::string> ImagesOf(const RunPlan& plan, const ControlScript& script) {
  std::map<uint64_t, std::string> images = script.images;
  images.emplace(plan.description.program_hash(), plan.description.program_image());
  return images;
}

DeploymentSchedule::Run TimesOf(const RunPlan& plan) {
  const proto::RunDescription& run = plan.description;
  return {run.tick_us(), plan.num_ticks(), run.mode() == "realtime", run.loss()};
}

}  // namespace

ControlDesk::ControlDesk(const RunPlan& plan, ControlScript script, const std::string& folder,
                         bridge::SimParticipant* sim, sim::ControlledRobot* robot)
    : plan_(plan),
      script_(std::move(script.commands)),
      reachable_(!folder.empty()),
      sim_(*sim),
      images_(plan.description.program_hash(), ImagesOf(plan, script), folder),
      check_(plan.model, plan.robot(), plan.description.root_module(), &images_,
             {[sim](int module) { return sim->lost(static_cast<size_t>(module)); },
              [sim](int module) { return sim->program_of(static_cast<size_t>(module)); }}),
      schedule_(TimesOf(plan)),
      effects_(&check_, &images_, &schedule_, sim, robot),
      restarts_(&orders_,
                {[sim](std::function<void()> at) { sim->SetBarrier(std::move(at)); },
                 [sim] { sim->PassBarrier(); },
                 [this](const ControlCommand& command) {
                   return sim_.BeginIncarnation(static_cast<size_t>(check_.ModuleOf(command)));
                 }}) {
  // A module whose process died without a trace begins anew, also where no command asked for it.
  sim_.OnReplaced([this](size_t module, int64_t tick) {
    ControlCommand command;
    command.kind = ControlKind::kRestart;
    command.part.module = plan_.robot().modules[module].name;
    command.cold = true;
    // CLOCK of its first tick is out already.
    command.from = tick;
    Announce(ControlText(command));
  });
}

void ControlDesk::Accept(GivenCommand* given, ControlAnswer::State state, int64_t tick) {
  if (given->counter == kNobody || given->answered || !answer_) return;
  // What is said now is done then.
  *given = Complete(std::move(*given), tick);
  given->answered = true;
  answer_({given->counter, state, tick, 0, "", given->text, given->command.at});
}

void ControlDesk::Refuse(const GivenCommand& given, const Refusal& refusal, int64_t tick) {
  // Who waits for an answer gets it.
  const bool scripted = given.counter == kNobody;
  if (!scripted && !given.answered) {
    if (!answer_) return;
    return answer_({given.counter, ControlAnswer::State::kRefused, tick, refusal.status,
                    refusal.reason, given.text, std::nullopt});
  }
  // A script awaits no answer, nor does a sender to whom it was promised for later: the user hears
  // of it here.
  Warn(fmt::format("{}: tick {}: {}: {}", scripted ? "--commands" : "control", tick, given.text,
                   refusal.reason));
}

void ControlDesk::Announce(const std::string& text) {
  ++announced_;
  sim_.AnnounceControl(text);
}

void ControlDesk::AnnounceBegun(const std::string& text) {
  ++announced_;
  begun_anew_.push_back(text);
}

void ControlDesk::NameBegun() {
  for (const std::string& text : std::exchange(begun_anew_, {})) sim_.AnnounceControl(text);
}

int ControlDesk::NumPending() const {
  return announced_ + static_cast<int>(waiting_.size() + restarts_.waiting().size() +
                                       orders_.under_way().size());
}

void ControlDesk::Give(int64_t counter, const ControlCommand& command) {
  GivenCommand given = {counter, command, ControlText(command)};
  // The tick that is out has its sensors already: the next one is the first that shows the effect.
  const int64_t tick = sim_.tick() + 1;
  if (const Refusal refusal = Check(given, tick)) return Refuse(given, refusal, tick);
  if (DoNow(given)) return;
  if (IsCold(command)) return BeginRestart(given);
  // A run that holds still takes it up when it goes on; the sender does not wait for that.
  if (Held()) Accept(&given, ControlAnswer::State::kLater, tick);
  waiting_.push_back(std::move(given));
  // It leaves before the tick in which it is gone.
  if (command.kind == ControlKind::kLose) {
    sim_.Lose(static_cast<size_t>(check_.ModuleOf(command)));
  }
}

Refusal ControlDesk::Check(const GivenCommand& given, int64_t tick) {
  if (sim_.ending()) return {kNo, "the run is over"};
  // A script says what was done once, and is told nothing that the run did not say then.
  const ControlCommand& command = given.command;
  const bool scripted = given.counter == kNobody;
  // CLOCK adds the time of a deployment that names none, and the hash of an image that has none
  // yet.
  const bool brings = bridge::BringsImage(command.kind);
  const size_t added = (brings && !command.at ? kTimeBytes : 0) +
                       (brings && command.program_hash == 0 ? kHashBytes : 0);
  if (!scripted && given.text.size() + added > bridge::kLongestText) {
    return {kUnusable, "the command is too long"};
  }
  const int most = MovesOn(command.kind) ? kMostAtOnce + 1 : kMostAtOnce;
  if (!scripted && NumPending() >= most && command.kind != ControlKind::kStop) {
    return {kNo, fmt::format("{} commands wait for the next tick already", most)};
  }
  if (Refusal refusal = CheckPause(command.kind)) return refusal;
  if (IsCold(command) && !orders_.possible()) {
    return {kFailed, "this run has no launcher to do that"};
  }
  if (Refusal refusal = check_.Check(command)) return refusal;
  // What the modules run by then is certain at the tick alone.
  if (!scripted) {
    if (Refusal refusal = check_.CheckProgram(command)) return refusal;
    // Which program has the parameter is known only where no other one waits for the same tick.
    const bool certain = std::ranges::none_of(waiting_, [](const GivenCommand& other) {
      return bridge::BringsImage(other.command.kind);
    });
    if (command.kind == ControlKind::kSet && certain) {
      if (Refusal refusal = effects_.CheckSetting(command, tick)) return refusal;
    }
  }
  return CheckTime(given, tick);
}

Refusal ControlDesk::CheckPause(ControlKind kind) const {
  // A pause that waits for its tick is one already.
  const bool pausing = std::ranges::any_of(waiting_, [](const GivenCommand& given) {
    return given.command.kind == ControlKind::kPause;
  });
  if (kind == ControlKind::kPause && (pausing || sim_.paused())) {
    return {kNo, fmt::format("the run is paused already, at tick {}", sim_.tick())};
  }
  const bool moves = kind == ControlKind::kResume || kind == ControlKind::kStep;
  return moves && !sim_.paused() ? Refusal{kNo, "the run is not paused"} : Refusal();
}

Refusal ControlDesk::CheckTime(const GivenCommand& given, int64_t tick) const {
  if (!bridge::BringsImage(given.command.kind)) return {};
  // A script may be that of a run which went on for longer.
  const bool endless = given.counter == kNobody;
  const std::string why = schedule_.WhyNot(effects_.OrderOf(given.command, tick), endless);
  return why.empty() ? Refusal() : Refusal{kNo, why};
}

GivenCommand ControlDesk::Complete(GivenCommand given, int64_t tick) const {
  ControlCommand& command = given.command;
  if (!bridge::BringsImage(command.kind)) return given;
  const DeploymentSchedule::Times times = schedule_.Plan(effects_.OrderOf(command, tick));
  const double at = schedule_.SecondsOf(times.switch_tick);
  if (command.at == at) return given;
  command.at = at;
  given.text = ControlText(command);
  return given;
}

bool ControlDesk::DoNow(GivenCommand given) {
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
  Announce(given.text);
  const int64_t tick = sim_.tick() + 1;
  Accept(&given, ControlAnswer::State::kDone, tick);
  // Counted first, for the next tick may begin at once.
  if (kind == ControlKind::kResume) steps_left_ = 0;
  if (kind == ControlKind::kStep) steps_left_ += command.steps;
  (void)effects_.Apply(command, tick);
  return true;
}

void ControlDesk::BeginRestart(const GivenCommand& given) {
  if (plan_.description.mode() == "realtime") return Order(given);
  restarts_.Take(given);
  if (Held()) Accept(&restarts_.waiting().back(), ControlAnswer::State::kLater, sim_.tick() + 1);
}

void ControlDesk::Order(const GivenCommand& given) {
  // A script's orders are noted at their ticks, and no more, unless they change messages.
  const bool cold = IsCold(given.command);
  if (given.counter == kNobody && !cold) return Announce(given.text);
  if (!orders_.possible()) {
    return Refuse(given, {kFailed, "this run has no launcher to do that"}, sim_.tick() + 1);
  }
  // The answer waits for the launcher's.
  const auto module = static_cast<size_t>(check_.ModuleOf(given.command));
  orders_.Order(given, cold ? sim_.BeginIncarnation(module) : 0);
}

void ControlDesk::OrderDone(const std::string& error) {
  std::optional<GivenCommand> given = orders_.Done(error.empty());
  if (!given) return;
  const bool cold = IsCold(given->command);
  if (!error.empty()) {
    Refuse(*given, {kNo, error}, sim_.tick() + 1);
  } else if (!given->silent) {
    // Processes take their time to begin anew. Named behind whatever else is said before the next
    // tick, so that a run with the same commands has the same CLOCK.
    cold ? AnnounceBegun(given->text) : Announce(given->text);
    Accept(&*given, ControlAnswer::State::kDone, sim_.tick() + 1);
  }
  if (cold) restarts_.OnDone();
}

void ControlDesk::AnswerWaiting() {
  for (std::vector<GivenCommand>* all : {&waiting_, &restarts_.waiting()}) {
    for (GivenCommand& given : *all) {
      if (given.answered || given.since.seconds() < kLaterSeconds) continue;
      Accept(&given, ControlAnswer::State::kLater, sim_.tick() + 1);
    }
  }
}

void ControlDesk::BeforeTick(int64_t tick) {
  // When tick 0 goes out depends on how soon processes start: what is given before takes effect at
  // tick 1.
  if (tick == 0) return;
  NameBegun();
  // Moved out first: what a command leads to may give others.
  for (const GivenCommand& given : std::exchange(waiting_, {})) {
    GivenCommand done = Complete(given, tick);
    if (const Refusal refusal = DoAt(tick, &done)) {
      Refuse(given, refusal, tick);
      continue;
    }
    Announce(done.text);
    Accept(&done, ControlAnswer::State::kDone, tick);
  }
}

Refusal ControlDesk::DoAt(int64_t tick, GivenCommand* given) {
  if (given->command.kind == ControlKind::kSet) {
    if (Refusal refusal = effects_.PrepareSetting(&given->command, tick)) return refusal;
    given->text = ControlText(given->command);
  }
  if (Refusal refusal = CheckTime(*given, tick)) return refusal;
  if (Refusal refusal = check_.CheckProgram(given->command)) return refusal;
  const Result<void> done = effects_.Apply(given->command, tick);
  return done ? Refusal() : Refusal{kNo, done.error().message};
}

void ControlDesk::AfterTick(int64_t tick) {
  // CLOCK is out, so the next one is empty yet, but for what this one had no room for; this tick
  // was one of those to step.
  announced_ = std::max(0, announced_ - kMostAtOnce - 1);
  if (steps_left_ > 0) --steps_left_;
  while (next_scripted_ < script_.size() && script_[next_scripted_].tick <= tick + 1) {
    // More than a CLOCK names wait for the tick whose CLOCK will, so that it stays true; a run that
    // holds still would never get there.
    if (NumPending() > kMostAtOnce && !Held()) break;
    // Counted before it is given: what it leads to may be the next tick.
    const ScriptedCommand& next = script_[next_scripted_++];
    Give(kNobody, next.command);
  }
  // No command reaches a run in one process, so a pause that the script does not end has no end.
  if (!reachable_ && Held()) {
    const std::string& reason = plan_.description.end_reason();
    sim_.RequestStop(reason.empty() ? "paused, with no command to resume" : reason);
  }
}

void ControlDesk::Finish() {
  for (const auto* all :
       {&std::as_const(waiting_), &std::as_const(restarts_.waiting()), &orders_.under_way()}) {
    for (const GivenCommand& each : *all) {
      Refuse(each, {kNo, "the run ended before"}, sim_.tick());
    }
  }
  waiting_.clear();
  restarts_.waiting().clear();
  orders_.Clear();
}

}  // namespace morphbus::tools
