#pragma once
// Carries commands out on a running simulator: those that people give over the bus and those of
// `run --commands`. It decides at which tick each takes effect, and has CLOCK name it.

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "bridge/control/control_command.h"
#include "bridge/lockstep/sim_participant.h"
#include "sim/controlled_robot.h"
#include "tools/launch/control_script.h"
#include "tools/launch/run_plan.h"
#include "tools/launch/wall_clock.h"
#include "vm/image/program.h"

namespace morphbus::tools {

/// What a run's simulator does at somebody's command. A command that is given while a tick is out
/// takes effect at the next one, before its sensors are read: so the same commands given at the
/// same ticks make the same run. What is refused changes nothing and stands in no CLOCK.
class ControlDesk {
 public:
  /// `folder`: the run's, for images to deploy; empty in a run that nobody can reach. All pointers
  /// and `plan` outlive the desk.
  ControlDesk(const RunPlan& plan, ControlScript script, std::string folder,
              bridge::SimParticipant* sim, sim::ControlledRobot* robot);

  /// Who hears what became of commands that were given.
  void OnAnswer(std::function<void(const bridge::ControlAnswer&)> answer) {
    answer_ = std::move(answer);
  }
  /// Who kills and restarts processes (the launcher); without it such commands are refused. Those
  /// of a script are only noted: they change no message, and a run that waits for a dead module
  /// comes to no tick at which the script could restart it.
  void OnProcessOrder(std::function<void(const bridge::ControlCommand&)> order) {
    order_ = std::move(order);
  }

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
  /// A command that was given, and whether it was answered.
  struct Given {
    int64_t counter = 0;
    bridge::ControlCommand command;
    bool answered = false;
    WallTimer since = {};
  };
  /// Why a command is refused: the exit status of who gave it, 0 for none, and the reason.
  struct Refusal {
    int status = 0;
    std::string reason;
  };

  /// What can be said against a command before its tick, whatever the modules answer until then.
  Refusal Check(const bridge::ControlCommand& command);
  /// Are all modules, links and connectors that it names there?
  Refusal CheckNames(const bridge::ControlCommand& command);
  /// Does it fit the program that its module runs, as of its last answer? At its tick all answers
  /// to the one before are there; earlier, that is a matter of time, and no reason to refuse what
  /// was done in the run that a script repeats.
  Refusal CheckProgram(const bridge::ControlCommand& command);
  /// Is there such an image, and can the robot run it?
  Refusal CheckDeploy(const bridge::ControlCommand& command);
  /// Does what waits for no tick. True if the command was of that kind.
  bool DoNow(const Given& given);
  /// Hands a command to the launcher.
  void Order(const Given& given);
  /// Does what was given for the tick whose sensors are read next.
  Refusal Do(const bridge::ControlCommand& command);
  /// Has the next CLOCK name it.
  void Announce(const bridge::ControlCommand& command);
  /// Commands that the next CLOCK may name: announced, waiting, or ordered.
  [[nodiscard]] int NumPending() const;
  /// The run holds still until somebody lets it go on.
  [[nodiscard]] bool Held() const { return sim_.paused() && steps_left_ == 0; }

  // The two kinds of answers; `tick` is the one that the command was given for.
  void Accept(const Given& given, bridge::ControlAnswer::State state);
  void Refuse(const Given& given, const Refusal& refusal, int64_t tick);
  /// The index of the module that a command is addressed to.
  [[nodiscard]] int Addressee(const bridge::ControlCommand& command) const;
  /// The verified image of this hash; null if the run has none.
  const vm::VerifiedProgram* FindProgram(uint64_t hash);

  // The run, and what it does by itself.
  const RunPlan& plan_;
  ControlScript script_;
  std::string folder_;
  // What is acted on.
  bridge::SimParticipant& sim_;
  sim::ControlledRobot& robot_;
  // Called if set; see OnAnswer and OnProcessOrder.
  std::function<void(const bridge::ControlAnswer&)> answer_;
  std::function<void(const bridge::ControlCommand&)> order_;
  // What waits for the next tick, and what for the launcher; oldest first.
  std::vector<Given> waiting_, ordered_;
  size_t next_scripted_ = 0;  ///< The first command of the script that was not given yet.
  int announced_ = 0;         ///< Commands that were announced and that no CLOCK has named yet.
  int64_t steps_left_ = 0;    ///< Ticks that `step` still has to run.
  /// Images that were looked at, by hash, and what the verifier made of them.
  std::map<uint64_t, std::unique_ptr<vm::VerifiedProgram>> programs_;
};

}  // namespace morphbus::tools
