#pragma once
// When a program that is deployed goes out, and when all modules go over to it.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "vm/spread/program_relay.h"

namespace morphbus::tools {

/// The times of a run's deployments, one after the other. The robot must never be of two minds: of
/// two programs that are under way at once all modules go over to the same one.
class DeploymentSchedule {
 public:
  /// What is known of the run beforehand.
  struct Run {
    int64_t tick_us = 0;    ///< Length of a tick, microseconds of sim time.
    int64_t num_ticks = 0;  ///< Of the whole run; -1: until it is stopped.
    bool realtime = false;  ///< Messages come late or not at all.
    double loss = 0;        ///< Share of messages that are lost, from 0 up to but not with 1.
  };
  /// A deployment that is to be done at a tick, as far as its times depend on it.
  struct Order {
    int64_t tick = 0;
    std::optional<double> at;   ///< When all are to go over to it, seconds of sim time, if asked.
    size_t image_bytes = 0;     ///< Size of the program's image.
    int hops = 0;               ///< Dockings between the module that gets it and the furthest one.
    bool last_is_whole = true;  ///< The program before this one has gone out whole.
    /// It gives the program before this one another value of a parameter, and so comes no earlier.
    bool sets = false;
  };
  /// When a program is given to its module, piece by piece, and when all modules go over to it.
  struct Times {
    int64_t from_tick = 0;
    int64_t switch_tick = 0;
  };

  explicit DeploymentSchedule(const Run& run) : run_(run) {}

  /// The times of a deployment: the one that it names, or one by which all have it. Where an
  /// earlier program waits for its time, and some would go over to that one before they hear of
  /// this one, this one is given to its module only then.
  [[nodiscard]] Times Plan(const Order& order) const;
  /// Empty, or why the time that it names cannot be kept, as a sentence for people.
  /// @param endless  the run's end does not count.
  [[nodiscard]] std::string WhyNot(const Order& order, bool endless) const;
  /// Notes that it is done with these times; returns what heads the package. The later command
  /// wins, also where its module has not heard of the earlier one.
  vm::PackageHead Begin(const Order& order, const Times& times);

  /// Whether modules may still be going over to the last program at a tick.
  [[nodiscard]] bool UnderWay(int64_t tick) const;

  /// Sim time at which a tick begins, seconds.
  [[nodiscard]] double SecondsOf(int64_t tick) const;

 private:
  /// The ticks from the first piece of a program until all have it.
  [[nodiscard]] int64_t TicksToAll(const Order& order) const;

  Run run_;
  // Of the last deployment: its number (modules start with version 1, so the first one has the
  // number 2), and its tick; and the tick of the last one that went out whole.
  uint32_t last_number_ = 1;
  int64_t last_switch_tick_ = -1, whole_switch_tick_ = -1;
};

}  // namespace morphbus::tools
