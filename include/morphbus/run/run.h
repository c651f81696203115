#pragma once
// Runs of a robot with a program, in this process, tick by tick: a virtual machine in every module,
// the simulator and the logger, with the messages and the hash of `morphbus run`.
//
// Library morphbus-run. A run belongs to one thread at a time; any number of runs may go on in
// threads beside each other, and what happens in a run does not depend on that. Units are SI. The
// world frame W has x north, y up and z east, and its ground at y = 0.

#include <morphbus/dynarole/program.h>
#include <morphbus/export.h>
#include <morphbus/model/model.h>

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace morphbus {

/// How a run is done: the options of `morphbus run` (docs/cli.md), with its defaults.
struct RunOptions {
  /// Sim time after which the run is over (s); 0: when it is closed.
  double seconds = 0;
  /// Path of the log; empty: none is written, and what would stand in it is kept in memory.
  std::string log = {};
  /// The run's name, with which its channels begin.
  std::string name = "run";
  /// Parameters of the program, and attributes of the model such as MTRAN.joint_1.torque, with
  /// their values as text.
  std::vector<std::pair<std::string, std::string>> settings = {};
  /// Path of an SDFormat world with obstacles; empty: none.
  std::string world = {};
  /// Coulomb friction of all contacts, and whether there is level ground.
  double friction = 0.8;
  bool ground = true;
  /// Without physics: joints follow their set-points, and nothing falls.
  bool still = false;
  /// The share of messages that every receiver throws away on purpose (0 to 1), and the seed by
  /// which they are chosen.
  double loss = 0;
  uint64_t seed = 1;
  /// Seeds of the numbers that the program draws, and of the noise of sensors and of what else
  /// differs by chance.
  uint64_t random_seed = 1;
  int noise_seed = 1;
};

/// What there is to see of a run at a tick.
struct Observation {
  int64_t tick = 0;
  /// Sim time since the run's start (s).
  double time_s = 0;
  /// Measured values of all joints, in the order of Robot::joints: rad or m, rad/s or m/s, and what
  /// their motors exerted in the tick before, N m or N. Those of lost modules are there, too.
  std::vector<double> position;
  std::vector<double> velocity;
  std::vector<double> effort;
  /// The pose X_WL of each link L in the world, in the order of Robot::links.
  std::vector<Pose> X_WL;
  /// What the sensors of each module measure, in the order of Robot::modules: of a distance sensor
  /// a distance (m), of a contact sensor 0 or 1, of a tilt sensor the three components of the
  /// direction that points up, in the frame of its link; one behind the other, as M3L declares
  /// them.
  std::vector<std::vector<double>> sensors;
  /// The role that each module plays; empty where it plays none.
  std::vector<std::string> roles;
};

/// How a run went.
struct RunResult {
  /// 32 hexadecimal digits: equal for equal runs.
  std::string hash;
  int64_t ticks = 0;
  /// Why it ended: "finished" if nothing else.
  std::string reason;
  /// What went wrong; empty if nothing did.
  std::string error;
  /// Where the log is; empty without one.
  std::string log;
};

/// The fingerprint of the arithmetic that can reach a run (docs/arithmetic.md), 16 hexadecimal
/// digits, made of results that are tried: another one than that of `morphbus run` means that runs
/// have other bits here, as they may where the process found functions of C before it came to this
/// library.
MORPHBUS_EXPORT std::string ArithmeticFingerprint();

/// A run that goes on as its owner says.
class MORPHBUS_EXPORT Run {
 public:
  /// Puts robot and program together and begins: tick 0 is out. Throws Failure where an option
  /// makes no sense, the robot stands in an obstacle or the log cannot be written.
  Run(const Robot& robot, const Program& program, const RunOptions& options = {});
  /// Closes the run if that has not been done.
  ~Run();
  Run(Run&& other) noexcept;
  Run& operator=(Run&& other) noexcept;

  /// Goes on by so many ticks of 20 ms, at most to the run's end. Throws Failure, and has gone on
  /// all the same, if a command was refused.
  void Step(int64_t ticks = 1);
  /// True once the run is over: it has come to its end, was stopped or failed.
  [[nodiscard]] bool over() const;
  /// What there is to see now.
  [[nodiscard]] Observation Observe() const;
  /// Gives a command, as `morphbus control` takes them: "push m1 up 5", "lose m3",
  /// "disconnect m2.c3". It takes effect at the next tick. Throws Failure for a text that is none,
  /// or one that makes no sense in such a run ("pause", "kill m1", "deploy x.dyn").
  void Command(std::string_view text);
  /// Gives a parameter of the program another value, in all modules at one tick.
  void Set(std::string_view parameter, double value);
  /// From the next tick on this joint drives to a target (rad, or m), at this speed at most (rad/s,
  /// or m/s; 0: its own), whatever the program says. `joint` is a place in Robot::joints. The log
  /// has what the joint was told, and not by whom: `morphbus reproduce` cannot do such a run again.
  void Drive(int joint, double target, double speed = 0);
  /// Leaves the joint to the program again.
  void Release(int joint);

  /// Ends the run if it is not over, closes the log and tells how it went. Steps are refused from
  /// then on. The same answer every time.
  const RunResult& Close();
  /// All that `morphbus run --json` tells of the closed run, as JSON (docs/cli.md): figures,
  /// faults, roles, losses. Reads the log, so it takes a while.
  [[nodiscard]] std::string SummaryJson() const;

 private:
  class Content;
  std::unique_ptr<Content> content_;
};

}  // namespace morphbus
