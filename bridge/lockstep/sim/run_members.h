#pragma once
// Who takes part in a run: whom the simulator expects, which process speaks for each of them, and
// who is turned away.

#include <cstdint>
#include <functional>
#include <morphbus/admit_t.hpp>
#include <morphbus/hello_t.hpp>
#include <set>
#include <string>
#include <vector>

#include "compiler/base/text_hash.h"
#include "vm/limits.h"

namespace morphbus::bridge {

/// A module that must join before tick 0 is over.
struct ExpectedModule {
  /// Name and number of the module in the model, by which it says HELLO and sends.
  std::string name;
  uint16_t id = 0;
  /// Its type, and the hash of that type's kinematics image: HELLO must name the same.
  std::string type_name;
  uint64_t kinematics_hash = 0;
  int num_connectors = vm::kMaxNeighbours;  ///< Of its type; fewer make smaller SENSORS.
};

/// Whom a run needs, and what they must have in common with it.
struct ExpectedMembers {
  /// Hash of the model, which every process must name.
  uint64_t model_hash = 0;
  uint64_t program_hash = 0;            ///< Of the image every module must run; 0: any.
  std::vector<ExpectedModule> modules;  ///< In order of id.
};

/// The members of a run by number: the modules in order of id, then the logger, if there is one.
/// Each is spoken for by one process, the first one that fits; of a module that does not answer, a
/// later incarnation may take the place.
class RunMembers {
 public:
  /// What a process that says HELLO has to do with the run at that moment.
  struct Standing {
    bool started = false;   ///< Tick 0 is over.
    bool ending = false;    ///< END is out.
    bool lost = false;      ///< The run goes on without this module.
    bool answered = false;  ///< The module has answered the tick that is out.
  };
  /// What becomes of a process that says HELLO.
  enum class Welcome : uint8_t {
    kJoins,       ///< It speaks for the member from now on, as the first one.
    kKnown,       ///< It does so already.
    kReplaces,    ///< It takes the place of a module that has died and left nothing behind.
    kTurnedAway,  ///< It has no part in the run, which does not mind.
    kUnfit,       ///< The run cannot begin with it.
  };

  /// @param logger    whether the run has one.
  /// @param realtime  whether the wall clock decides when a tick is over.
  RunMembers(const ExpectedMembers& expected, bool logger, bool realtime);

  /// Decides what becomes of a process that says HELLO at `now_us` of wall time. `why` says it, as
  /// a sentence, of one that is kTurnedAway or kUnfit.
  Welcome OnHello(const morphbus::hello_t& hello, const Standing& standing, int64_t now_us,
                  std::string* why);
  /// A module has answered a tick, or repeated that: it is alive.
  void Heard(int module, int64_t now_us) { members_[module].heard_us = now_us; }
  /// What a module says that it has published on ACTUATOR and STATUS so far.
  void Published(int module, int64_t num_actuators, int64_t num_status);
  /// What a module is told that begins while the run goes on. `last_tick` is the last tick that
  /// its place in the run has answered.
  [[nodiscard]] morphbus::admit_t AdmissionOf(int module, int64_t last_tick) const;
  /// The number of a module's next incarnation, which begins now or with the next tick.
  uint32_t BeginIncarnation(int module) { return ++members_[module].incarnation; }

  /// The number of a member; -1 for others.
  [[nodiscard]] int NumberOf(const std::string& name) const;
  [[nodiscard]] const std::string& name(int number) const { return members_[number].name; }
  /// How many members there are, and how many of them are modules.
  [[nodiscard]] int size() const { return static_cast<int>(members_.size()); }
  [[nodiscard]] int num_modules() const { return static_cast<int>(expected_.modules.size()); }
  /// Modules that cannot say what their channels have carried, since they took the place of one
  /// that died: only the logger knows.
  [[nodiscard]] const std::set<std::string, std::less<>>& unvouched() const { return unvouched_; }
  /// Processes that were turned away without harm to the run, one sentence each (at most 16 are
  /// kept).
  [[nodiscard]] const std::vector<std::string>& turned_away() const { return turned_away_; }

 private:
  struct Member {
    std::string name;
    /// Random number of the process that speaks for it; 0: none yet.
    int64_t claim = 0;
    uint32_t incarnation = 1;  ///< How often it has begun.
    int64_t heard_us = 0;      ///< Wall time at which it was heard last.
    /// Of a module: how many ACTUATOR and STATUS it has published.
    int64_t num_actuators = 0, num_status = 0;
  };
  /// Empty, or why the process cannot speak for that member, as a sentence.
  [[nodiscard]] std::string Misfit(int number, const morphbus::hello_t& hello) const;
  /// Empty, or why the process may not take the place of the one that speaks for that member.
  [[nodiscard]] std::string WhyNoPlace(int number, const morphbus::hello_t& hello,
                                       const Standing& standing, int64_t now_us) const;
  /// Lists the process among those turned away. One that tries again and again is listed once.
  Welcome TurnAway(const std::string& why);

  ExpectedMembers expected_;
  bool realtime_;
  std::vector<Member> members_;
  TextTable<int> numbers_;  ///< By name.
  std::set<std::string, std::less<>> unvouched_;
  std::vector<std::string> turned_away_;
};

}  // namespace morphbus::bridge
