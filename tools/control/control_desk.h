#pragma once
// Carries commands out on a running simulator: those that people give over the bus and those of
// `run --commands`. It decides at which tick each takes effect, and has CLOCK name it.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "bridge/control/control_command.h"
#include "bridge/lockstep/sim/sim_participant.h"
#include "sim/controlled_robot.h"
#include "tools/control/command_check.h"
#include "tools/control/command_effects.h"
#include "tools/control/deployment_schedule.h"
#include "tools/control/given_command.h"
#include "tools/control/process_orders.h"
#include "tools/control/run_images.h"
#include "tools/plan/control_script.h"
#include "tools/plan/run_plan.h"

namespace morphbus::tools {

/// The commands of a run between being given and being answered. A command that is given while a
/// tick is out takes effect at the next one, before its sensors are read: so the same commands
/// given at the same ticks make the same run. What is refused changes nothing and stands in no
/// CLOCK.
class ControlDesk {
 public:
  /// `folder`: the run's, for images to deploy; empty in a run without a bus. All pointers
  /// and `plan` outlive the desk.
  ControlDesk(const RunPlan& plan, ControlScript script, const std::string& folder,
              bridge::SimParticipant* sim, sim::ControlledRobot* robot);

  /// Who hears what became of commands that were given.
  void OnAnswer(std::function<void(const bridge::ControlAnswer&)> answer) {
    answer_ = std::move(answer);
  }
  /// Who kills and restarts processes (the launcher); without it such commands are refused. Kills
  /// and warm restarts of a script are only noted: they change no message, and a run that waits for
  /// a dead module comes to no tick at which the script could restart it.
  void OnProcessOrder(ProcessOrders::Send send) { orders_.OnSend(std::move(send)); }

  /// Does it, or sees to it that it is done at the next tick. The answer follows now or then.
  void Give(int64_t counter, const bridge::ControlCommand& command);
  /// The launcher has carried out the oldest order, or says why not.
  void OrderDone(const std::string& error);
  /// To be called now and then: who has waited for a tick for a second hears that the command will
  /// be done later. The run may not have begun, be slow, or wait for a module that does not answer.
  void AnswerWaiting();
  /// To be called before the sensors of each tick are read, and after its messages are out.
  void BeforeTick(int64_t tick);
  void AfterTick(int64_t tick);
  /// Refuses what will not be done any more.
  void Finish();

 private:
  /// What can be said against a command that is given for `tick`.
  Refusal Check(const GivenCommand& given, int64_t tick);
  /// Why the run as a whole is in no state for it.
  [[nodiscard]] Refusal CheckPause(bridge::ControlKind kind) const;
  /// Is the time that a deployment names one that can be kept, if it is done at `tick`?
  [[nodiscard]] Refusal CheckTime(const GivenCommand& given, int64_t tick) const;
  /// The command as it is done at `tick`: a deployment has a time.
  [[nodiscard]] GivenCommand Complete(GivenCommand given, int64_t tick) const;

  /// Does what was given for the tick whose sensors are read next; a setting gets its image. What
  /// is refused has changed nothing.
  Refusal DoAt(int64_t tick, GivenCommand* given);
  /// Does what waits for no tick. True if the command was of that kind.
  bool DoNow(GivenCommand given);
  /// Sees to it that a process is killed or started, or notes that it was.
  void Order(const GivenCommand& given);
  /// Sees to it that a module begins anew with the next tick, or in real time at once.
  void BeginRestart(const GivenCommand& given);

  /// Has the next CLOCK name a command.
  void Announce(const std::string& text);
  /// The same of a module that has begun anew, once all else for the next tick has been said.
  void AnnounceBegun(const std::string& text);
  /// Tells the next CLOCK of the modules that have begun anew.
  void NameBegun();
  /// Commands that the next CLOCK may name: announced, waiting, or ordered.
  [[nodiscard]] int NumPending() const;
  /// The run holds still until a command lets it go on.
  [[nodiscard]] bool Held() const { return sim_.paused() && steps_left_ == 0; }

  // The two kinds of answers, once each; `tick` is the one that the command was given for.
  void Accept(GivenCommand* given, bridge::ControlAnswer::State state, int64_t tick);
  void Refuse(const GivenCommand& given, const Refusal& refusal, int64_t tick);

  const RunPlan& plan_;
  std::vector<ScriptedCommand> script_;
  bool reachable_;  ///< Whether people can give commands.
  bridge::SimParticipant& sim_;
  // What the desk works with.
  RunImages images_;
  CommandCheck check_;
  DeploymentSchedule schedule_;
  CommandEffects effects_;
  ProcessOrders orders_;
  ColdRestarts restarts_;
  std::function<void(const bridge::ControlAnswer&)> answer_;  ///< Called if set.
  std::vector<GivenCommand> waiting_;                         ///< For the next tick, oldest first.
  size_t next_scripted_ = 0;  ///< The first command of the script that was not given yet.
  std::vector<std::string> begun_anew_;  ///< Commands that no CLOCK has been told of yet.
  int announced_ = 0;       ///< Commands that were announced and that no CLOCK has named yet.
  int64_t steps_left_ = 0;  ///< Ticks that `step` still has to run.
};

}  // namespace morphbus::tools
