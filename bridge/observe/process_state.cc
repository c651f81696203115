#include "bridge/observe/process_state.h"

#include <algorithm>
#include <iterator>
#include <vector>

namespace morphbus::bridge {

std::optional<HeldState> InspectionCollector::Take(const morphbus::status_t& status) {
  // No module has so much to tell.
  constexpr int kMostParts = 64;
  if (status.inspections.empty()) return std::nullopt;
  const morphbus::inspection_t& part = status.inspections.front();
  if (part.num_parts > kMostParts) return std::nullopt;
  // All parts of an answer are of one tick, by which they are told from those of another answer.
  std::map<int, morphbus::inspection_t>& known = ticks_[status.header.tick];
  known.insert_or_assign(part.part, part);
  const bool whole = std::ssize(known) == part.num_parts;
  std::vector<morphbus::inspection_t> parts;
  for (const auto& [number, each] : known) parts.push_back(each);
  // An answer of which a part was lost never becomes whole, and makes room for later ones.
  if (ticks_.size() > most_ticks_) ticks_.erase(ticks_.begin());
  return whole ? std::optional(JoinHeld(parts).value_or(HeldState())) : std::nullopt;
}

void ProcessState::Take(morphbus::status_t&& message) {
  const int64_t time_us = message.header.sim_time_us;
  if (std::optional<HeldState> whole = inspection_.Take(message)) {
    held = *std::move(whole);
    held_us = time_us;
  }
  constexpr size_t kKeptFaults = 8;
  // Faults for which a STATUS had no room count, though nothing else is known of them.
  faults += std::ssize(message.faults) + message.faults_dropped;
  for (const morphbus::fault_t& fault : message.faults) {
    last_faults.emplace_back(time_us, fault);
    if (last_faults.size() > kKeptFaults) last_faults.pop_front();
  }
  status = std::move(message);
}

void ProcessState::Take(const morphbus::transform_t& message) {
  has_pose = message.has_pose != 0;
  pose_stale = message.pose_stale != 0;
  hops = message.hops;
  // The root numbers its broadcasts by its ticks.
  pose_age_ticks = std::max<int64_t>(0, message.header.tick - message.root_sequence);
}

void ProcessState::Take(morphbus::health_t&& message) {
  // Both counters begin anew when the process does. Of two HEALTHs within a moment, as at a run's
  // end, the difference says nothing.
  constexpr int64_t kLeastUs = 200'000;
  const int64_t wall_us = message.wall_time_us - wall_us_;
  const int64_t used_us = message.cpu_us - cpu_us_;
  if (!health || wall_us < 0 || wall_us >= kLeastUs) {
    if (health && wall_us > 0 && used_us >= 0) {
      cpu = static_cast<double>(used_us) / static_cast<double>(wall_us);
    }
    wall_us_ = message.wall_time_us;
    cpu_us_ = message.cpu_us;
  }
  health = std::move(message);
}

}  // namespace morphbus::bridge
