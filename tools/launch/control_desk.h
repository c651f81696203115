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
  /// Who kills and restarts processes (the launcher). Without it a script's commands to do so are
  /// only noted, for they change no message, and others are refused.
  void OnProcessOrder(std::function<void(const bridge::ControlCommand&)> order) {
    order_ = std::move(order);
  }

  /// Does it, or sees to it that it is done at the next tick. The answer follows now or then.
  void Give(int64_t counter, const bridge::ControlCommand& command);
  /// The launcher has carried out the oldest order, or says why not.
  void OrderDone(const std::string& error);
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
  };
  /// Why a command is refused: the exit status of who gave it, 0 for none, and the reason.
  struct Refusal {
    int status = 0;
    std::string reason;
  };

  /// What can be said against a command before its tick.
  Refusal Check(const bridge::ControlCommand& command);
  /// Are all modules, links, connectors, roles and arguments that it names there?
  Refusal CheckNames(const bridge::ControlCommand& command);
  /// Is there such an image, and can the robot run it?
  Refusal CheckDeploy(const bridge::ControlCommand& command);
  /// Does what waits for no tick. True if the command was of that kind.
  bool DoNow(const Given& given);
  /// Hands a command to the launcher.
  void Order(const Given& given);
  /// Does what was given for the tick whose sensors are read next.
  Refusal Do(const bridge::ControlCommand& command);
  /// Gives a module an invocation to issue.
  Refusal Invoke(const bridge::ControlCommand& command);

  // The two kinds of answers.
  void Accept(const Given& given, bridge::ControlAnswer::State state);
  void Refuse(const Given& given, const Refusal& refusal);
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
  int announced_ = 0;         ///< Commands that the next CLOCK will name.
  int64_t steps_left_ = 0;    ///< Ticks that `step` still has to run.
  /// Images that were looked at, by hash, and what the verifier made of them.
  std::map<uint64_t, std::unique_ptr<vm::VerifiedProgram>> programs_;
};

}  // namespace morphbus::tools
