#pragma once
// Starts a run's processes, watches them, and makes sure that all of them end.

#include <list>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tools/launch/failure_watch.h"
#include "tools/launch/launcher_link.h"
#include "tools/launch/run_outcome.h"
#include "tools/launch/run_record.h"
#include "tools/machine/child_process.h"
#include "tools/machine/run_registry.h"
#include "tools/plan/run_plan.h"

namespace morphbus::tools {

/// A run of one simulator, one process a module and a logger, which talk over LCM. The launcher
/// takes no part in the lockstep: it starts the processes, hears from sim and logger over
/// links how they get on, starts modules' processes again that die, and stops the rest when
/// somebody fails for good. No process outlives the launcher, however that ends. One object is one
/// run.
class Launcher {
 public:
  /// @param record  what the logger writes. All arguments outlive the launcher.
  Launcher(const RunPlan& plan, const RunOptions& options, const RunDirectory& directory,
           const RunRecord& record);

  /// Runs until the run is over, a process fails, or a signal ends it. A module's process that dies
  /// goes on from the state that it has saved. Any other that dies, and a module's that dies three
  /// times in ten seconds (FailureWatch), ends the run at once: it is named in `error`, the log is
  /// closed and kept, the others are stopped.
  RunOutcome Run();

 private:
  /// Writes what the processes read into the run's directory: description and images. Fails if a
  /// file cannot be written.
  Result<void> WriteInputs();
  /// Starts logger, sim and modules, in this order: the log is open before anyone speaks. Fails at
  /// the first process that does not start; those before it run on, for StopAll to end.
  Result<void> StartAll();
  /// A process that one module has, or several share.
  struct ModuleProcess {
    std::string name;          ///< In messages.
    std::vector<int> modules;  ///< By index in the robot.
    std::string state;         ///< Path of the file that it saves its state to.
    int restarts = 0;          ///< How often it was started again because it had died.
  };
  /// The process that has the module of this index.
  ModuleProcess& ProcessOf(int module);
  /// All modules of a process have left the run; it has nothing more to do.
  [[nodiscard]] bool IsGone(const ModuleProcess& process) const;
  /// Starts morphbus-module for the modules of this process; with `resume`, they go on from what
  /// the process before it has saved, or begin anew where their incarnation is a later one.
  Result<void> StartModules(const ModuleProcess& process, bool resume);
  /// Starts a process again that has ended. Modules whose state is lost get a later incarnation;
  /// their names are returned.
  Result<std::vector<std::string>> RestartModules(const ModuleProcess& process);
  /// The file that a module saves its state to.
  [[nodiscard]] std::string StateFile(const ModuleProcess& process, int module) const;
  /// Starts a module's process again, which has died; the run fails if it does not start.
  void OnModuleDeath(ModuleProcess* process, const std::string& how);
  /// What the sim wants done with a module's process.
  struct Order {
    bool kills = false;        ///< Else it is started again.
    std::string module;        ///< Its name.
    uint32_t incarnation = 0;  ///< Under which the module begins anew; 0: it does not.
  };
  /// Kills or restarts a module's process at somebody's command. Fails if there is nothing to kill.
  Result<void> CarryOutOrder(const Order& order);
  /// Starts a process that reports over a link of its own, and returns the launcher's end of the
  /// link. `argv` is completed with the description, the link's descriptor and the LCM URL;
  /// `death_signal` is what the process gets when the launcher dies, `fds` what it inherits
  /// besides.
  Result<LauncherLink> StartLinked(const std::string& name, std::vector<std::string> argv,
                                   int death_signal, std::vector<int> fds = {});
  /// Sleeps until a process ends, a message or a signal comes, or kPollMs are over; then reads the
  /// messages and notes which processes have ended.
  void Watch();
  /// Reads what sim and logger said over their links. Orders are only noted, for who reads may be
  /// looking at a child that an order takes away.
  void TakeMessages();
  /// Carries out the orders that were noted, and answers each.
  void CarryOutOrders();
  /// Notices who has ended. Ending before the simulator reports the end of the run is failing.
  void CheckChildren();
  /// Passes a signal on to the sim, and has the run fail if somebody whose turn it is stays silent.
  void CheckTimeouts();
  /// Ends a run that failed: nothing new is simulated, the log is closed, nobody is left.
  void StopAll();
  /// Waits for all to end by themselves; names who does not. A run that was interrupted before it
  /// began waits for its logger only, and blames nobody: whoever did not join cannot know.
  void AwaitEnd(double seconds);
  /// Whether every child has been found to have ended.
  [[nodiscard]] bool AllEnded() const;
  /// The child of this name, as messages call it; null if it was never started.
  ChildProcess* Find(const std::string& name);

  const RunPlan& plan_;
  const RunOptions& options_;
  const RunDirectory& directory_;
  const RunRecord& record_;
  std::vector<ModuleProcess> processes_;  ///< Of modules, in their order.
  /// All processes of the run, in the order in which they were started.
  std::list<ChildProcess> children_;
  std::optional<LauncherLink> sim_;  ///< None until StartAll has started the process.
  std::optional<LauncherLink> log_;
  /// What Run returns, filled in as reports arrive.
  RunOutcome outcome_;
  /// Whether the run has failed, and why.
  FailureWatch watch_;
  bool interrupted_ = false;      ///< A signal came, and the sim was told to stop.
  std::set<std::string> killed_;  ///< Processes that were killed by command.
  std::set<std::string> gone_;    ///< Modules that have left the run, which goes on.
  std::string no_room_;  ///< Why a state could not be saved, the first time; empty: all can be.
  std::vector<Order> orders_;  ///< Of the sim, not carried out yet; oldest first.
  /// By module: the incarnation that its process is told.
  std::vector<uint32_t> incarnations_;
  /// What the user is told next, once the line of progress is gone.
  std::vector<std::string> news_;
};

}  // namespace morphbus::tools
