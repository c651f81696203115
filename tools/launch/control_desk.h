#pragma once
// Carries commands out on a running simulator: those that people give over the bus and those of
// `run --commands`. It decides at which tick each takes effect, and has CLOCK name it.

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <set>
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
  /// Who kills and restarts processes (the launcher); without it such commands are refused. A
  /// module that begins anew does so under this incarnation, else it is 0. Kills and warm restarts
  /// of a script are only noted: they change no message, and a run that waits for a dead module
  /// comes to no tick at which the script could restart it.
  using ProcessOrder =
      std::function<void(const bridge::ControlCommand& command, uint32_t incarnation)>;
  void OnProcessOrder(ProcessOrder order) { order_ = std::move(order); }

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
    bool silent = false;  ///< A step of another command: nobody hears of it, nor does CLOCK.
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
  /// Is the time at which all go over to the program one that is still to come, if the program is
  /// given to its module at `tick`?
  Refusal CheckTime(const bridge::ControlCommand& command, int64_t tick, bool scripted);
  /// Sim time at which a tick begins.
  [[nodiscard]] double SecondsOf(int64_t tick) const;
  /// When a program is given to its module, and when all modules go over to it.
  struct Schedule {
    int64_t from_tick = 0;
    int64_t switch_tick = 0;
  };
  /// The schedule of a deployment that is done at `tick`: the time that it names, or one by which
  /// all have it. Where an earlier program waits for its time, and some would go over to that one
  /// before they hear of this one, this one is given to its module only then: the robot must never
  /// be of two minds.
  Schedule Plan(const bridge::ControlCommand& command, int64_t tick);
  /// The ticks from the first piece of a program until all have it.
  int64_t TicksToAll(const bridge::ControlCommand& command);
  /// The command as it is done at `tick`: a deployment has a time.
  bridge::ControlCommand Complete(bridge::ControlCommand command, int64_t tick);
  /// Does what waits for no tick. True if the command was of that kind.
  bool DoNow(Given given);
  /// Hands a command to the launcher.
  void Order(const Given& given);
  /// Sees to it that a module begins anew with the next tick, or in real time at once.
  void BeginRestart(const Given& given);
  /// Between two ticks: hands the cold restarts that wait to the launcher. The next tick begins
  /// when it has done them.
  void OrderColdRestarts();
  /// Lets the next tick begin, if no cold restart is under way.
  void EndColdRestarts();
  /// Does what was given for the tick whose sensors are read next.
  Refusal Do(const bridge::ControlCommand& command, int64_t tick);
  /// Gives a module a program with the tick at which all go over to it.
  void Deploy(const bridge::ControlCommand& command, int module, int64_t tick);
  /// Has the next CLOCK name it.
  void Announce(const bridge::ControlCommand& command);
  /// The same of a module that has begun anew, once all else for the next tick has been said.
  void AnnounceBegun(const bridge::ControlCommand& command);
  /// Tells the next CLOCK of the modules that have begun anew.
  void NameBegun();
  /// Commands that the next CLOCK may name: announced, waiting, or ordered.
  [[nodiscard]] int NumPending() const;
  /// The run holds still until somebody lets it go on.
  [[nodiscard]] bool Held() const { return sim_.paused() && steps_left_ == 0; }

  // The two kinds of answers; `tick` is the one that the command was given for.
  void Accept(Given* given, bridge::ControlAnswer::State state);
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
  ProcessOrder order_;
  // What waits for the next tick, and what for the launcher; oldest first.
  std::vector<Given> waiting_, ordered_;
  size_t next_scripted_ = 0;  ///< The first command of the script that was not given yet.
  std::vector<bridge::ControlCommand> begun_anew_;  ///< That no CLOCK has been told of yet.
  int announced_ = 0;       ///< Commands that were announced and that no CLOCK has named yet.
  int64_t steps_left_ = 0;  ///< Ticks that `step` still has to run.
  // Of the last deployment: its number, and its tick; those of the last that went out whole.
  uint32_t last_number_ = 1;
  int64_t last_switch_tick_ = -1, whole_switch_tick_ = -1;
  /// Modules whose processes were killed by command and not restarted.
  std::set<std::string> killed_;
  /// Images that were looked at, by hash, and what the verifier made of them.
  std::map<uint64_t, std::unique_ptr<vm::VerifiedProgram>> programs_;
};

}  // namespace morphbus::tools
