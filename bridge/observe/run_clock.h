#pragma once
// Where a run is, and what people did to it, by its CLOCK.

#include <array>
#include <cstdint>
#include <morphbus/sim_clock_t.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace morphbus::bridge {

struct ControlCommand;

/// The commands that a CLOCK names, in their order: they take effect in its tick. Those of a later
/// version that cannot be read here are left out; as text they stand in the CLOCK.
std::vector<ControlCommand> CommandsIn(const morphbus::sim_clock_t& clock);

/// A force with which somebody pushes a link for a while.
struct Push {
  std::string module, link;            ///< Their names; without a link the body of the module.
  std::array<double, 3> force_W = {};  ///< N; north, up, east.
  int64_t until_us = 0;                ///< Sim time.
};

/// Follows a run by the CLOCKs that a listener hears, in their order. Everything but what commands
/// did is as the last CLOCK has it.
class RunClock {
 public:
  /// Takes a CLOCK, with the commands that take effect in its tick. One of a later version that
  /// cannot be read here does nothing.
  void Take(const morphbus::sim_clock_t& clock);
  /// The last CLOCK came once more, as it does twice a second while the run holds still. The end is
  /// repeated, too, so that nobody misses it, and is no standstill.
  void Repeat() { repeats_ += ended_ ? 0 : 1; }

  /// The tick, and its sim time, microseconds; -1 and 0 before the first CLOCK.
  [[nodiscard]] int64_t tick() const { return tick_; }
  [[nodiscard]] int64_t time_us() const { return time_us_; }
  /// Length of a tick, microseconds of sim time.
  [[nodiscard]] int32_t tick_us() const { return tick_us_; }
  /// Whether the run has a simulated world.
  [[nodiscard]] bool has_world() const { return has_world_; }
  /// Whether the run holds still: by a command or, for who did not hear it, by its CLOCK.
  [[nodiscard]] bool paused() const { return paused_ || repeats_ >= kRepeatsOfStandstill; }
  /// The speed that a command asked for (times real time; 0: as fast as possible); none before.
  [[nodiscard]] const std::optional<double>& speed() const { return speed_; }
  /// What pushes in the tick of the last CLOCK.
  [[nodiscard]] const std::vector<Push>& pushes() const { return pushes_; }
  /// Modules that the run goes on without.
  [[nodiscard]] const std::set<std::string, std::less<>>& lost() const { return lost_; }
  /// Whether CLOCK has told of the end, and why.
  [[nodiscard]] bool ended() const { return ended_; }
  [[nodiscard]] const std::string& end_reason() const { return end_reason_; }

 private:
  static constexpr int kRepeatsOfStandstill = 2;
  /// Of pushes at one time; a run that says more is no use to anybody.
  static constexpr size_t kMostPushes = 1000;
  void TakePush(const ControlCommand& command);

  int64_t tick_ = -1;
  int64_t time_us_ = 0;
  int32_t tick_us_ = 0;
  bool has_world_ = false;
  bool paused_ = false;
  int repeats_ = 0;  ///< Of the last CLOCK. One may only have come twice.
  std::optional<double> speed_;
  std::vector<Push> pushes_;
  std::set<std::string, std::less<>> lost_;
  bool ended_ = false;
  std::string end_reason_;
};

}  // namespace morphbus::bridge
