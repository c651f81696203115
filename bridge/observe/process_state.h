#pragma once
// What a process of a run has told of itself: the last word on everything, and what must be counted
// or put together of several messages.

#include <cstdint>
#include <deque>
#include <map>
#include <morphbus/fault_t.hpp>
#include <morphbus/health_t.hpp>
#include <morphbus/inspection_t.hpp>
#include <morphbus/status_t.hpp>
#include <morphbus/transform_t.hpp>
#include <optional>
#include <string>
#include <utility>

#include "bridge/wire/held_state.h"

namespace morphbus::bridge {

/// Puts the parts of one module's answers to inspections together, in whatever order they come.
class InspectionCollector {
 public:
  /// What is remembered: parts of the newest `ticks` ticks in which the module answered.
  explicit InspectionCollector(size_t ticks = 1) : most_ticks_(ticks) {}
  /// Takes a STATUS. What the module held, if this was the last part of an answer that was missing;
  /// nothing of it if the parts contradict each other.
  std::optional<HeldState> Take(const morphbus::status_t& status);

 private:
  size_t most_ticks_;
  std::map<int64_t, std::map<int, morphbus::inspection_t>> ticks_;
};

/// A module, the simulator or the logger, as a listener knows it. What is told by messages that
/// have not come is absent.
struct ProcessState {
  /// Of a module: its last STATUS, which is all there is to say of role, labels and tasks.
  std::optional<morphbus::status_t> status;
  /// Faults of its program, those among them that found no place in a message; and the newest 8,
  /// oldest first, with the sim times of their STATUS, µs.
  int64_t faults = 0;
  std::deque<std::pair<int64_t, morphbus::fault_t>> last_faults;
  /// What it held when it was inspected last, and the sim time of that, µs; -1: it never was.
  HeldState held;
  int64_t held_us = -1;
  /// By its last TRANSFORM: whether it knows where it is, whether the root has gone silent since,
  /// modules between the root and this one, and ticks since the root sent what its poses rest on.
  bool has_pose = false;
  bool pose_stale = false;
  int hops = 0;
  int64_t pose_age_ticks = 0;
  /// Its last ledger, and the processor time that it takes a second of wall time, 1: one core;
  /// absent before the second HEALTH.
  std::optional<morphbus::health_t> health;
  std::optional<double> cpu;
  /// Of a module in real time: how punctual it is, as the simulator tells it.
  std::optional<morphbus::lateness_t> lateness;

  /// Its role; empty while it has none, or has not told it.
  [[nodiscard]] std::string role() const { return status ? status->role_name : ""; }

  // The next message of the process, each once.
  void Take(morphbus::status_t&& message);
  void Take(const morphbus::transform_t& message);
  void Take(morphbus::health_t&& message);

 private:
  InspectionCollector inspection_;
  /// When `cpu` was measured last: wall time, and processor time used by then, µs.
  int64_t wall_us_ = 0, cpu_us_ = 0;
};

}  // namespace morphbus::bridge
