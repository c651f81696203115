// What a SimParticipant refuses: processes that do not fit the run, sensors that nobody could use,
// and a run of which not everybody tells the same.

#include <algorithm>
#include <cmath>
#include <string>

#include "bridge/lockstep/sim_participant.h"
#include "bridge/wire/arithmetic_hash.h"
#include "vm/limits.h"

namespace morphbus::bridge {
namespace {

/// Whether none of the numbers is infinite or no number.
template <class Numbers>
bool AllFinite(const Numbers& numbers) {
  return std::all_of(std::begin(numbers), std::end(numbers),
                     [](auto number) { return std::isfinite(number); });
}

}  // namespace

std::string SimParticipant::HelloError(int process, const morphbus::hello_t& hello) const {
  // All hashes are refused in the same words, with both values.
  const auto differs = [&hello](const std::string& what, int64_t has, uint64_t needs) {
    return hello.process + " has another " + what + " (" + HexText(static_cast<uint64_t>(has)) +
           ") than this run (" + HexText(needs) + ")";
  };
  // What every process must share: the wire types and the model.
  if (static_cast<uint64_t>(hello.wire_hash) != WireHash()) {
    return differs("build of the wire types", hello.wire_hash, WireHash());
  }
  // Who computes otherwise says other things of the same input, and no two such runs are the same.
  // In real time they are not anyway.
  if (!options_.realtime && static_cast<uint64_t>(hello.arithmetic_hash) != ArithmeticHash()) {
    return differs("arithmetic", hello.arithmetic_hash, ArithmeticHash()) +
           ": build it with the same options (docs/arithmetic.md), or run with --realtime";
  }
  if (static_cast<uint64_t>(hello.header.model_hash) != options_.model_hash) {
    return differs("model", hello.header.model_hash, options_.model_hash);
  }
  if (static_cast<size_t>(process) >= options_.modules.size()) return {};
  // What a module must be: of the type, with the images, that the robot has in its place.
  const ExpectedModule& module = options_.modules[process];
  if (hello.type_name != module.type_name) {
    return hello.process + " is a module of type " + hello.type_name + ", but the robot has a " +
           module.type_name + " there";
  }
  if (static_cast<uint64_t>(hello.kinematics_hash) != module.kinematics_hash) {
    return differs("kinematics image", hello.kinematics_hash, module.kinematics_hash);
  }
  if (options_.program_hash != 0 &&
      static_cast<uint64_t>(hello.header.program_hash) != options_.program_hash) {
    return differs("program", hello.header.program_hash, options_.program_hash);
  }
  return {};
}

std::string SimParticipant::WhyUnusable() const {
  if (sensed_.size() != options_.modules.size()) {
    return "the simulator senses " + std::to_string(sensed_.size()) + " modules instead of " +
           std::to_string(options_.modules.size());
  }
  // Readings that a receiver would refuse, or a module could not use.
  for (const morphbus::module_sensors_t& reading : sensed_) {
    if (!AllFinite(reading.joint_position_si)) {
      return "the simulation became unstable: " + reading.name + " has joints that are nowhere";
    }
    if (!AllFinite(reading.joint_effort_si)) {
      return "the simulation became unstable: " + reading.name +
             " exerts more than can be measured";
    }
    if (reading.num_docked > vm::kMaxNeighbours) {
      return reading.name + " has more than " + std::to_string(vm::kMaxNeighbours) +
             " mated connectors, the most a module can handle";
    }
  }
  // A sum is finite only if every term is.
  for (const morphbus::body_pose_t& body : truth_) {
    if (!std::isfinite(body.position_m[0] + body.position_m[1] + body.position_m[2] +
                       body.orientation_wxyz[0] + body.orientation_wxyz[1] +
                       body.orientation_wxyz[2] + body.orientation_wxyz[3])) {
      return "the simulation became unstable: a body is nowhere";
    }
  }
  for (const morphbus::contact_force_t& contact : contacts_) {
    if (!AllFinite(contact.force_n)) {
      return "the simulation became unstable: a link is pushed by more than can be measured";
    }
  }
  return {};
}

std::string SimParticipant::Disagreement() const {
  // A run that was stopped before it began moved nothing. In real time the log lacks what was lost.
  if (machine_.tick() == 0 || options_.realtime) return {};
  const bool told = options_.logger && reports_.back().complete();
  return told ? WhereTheLogDiffers(outcome_.totals, reports_.back().totals()) : std::string();
}

}  // namespace morphbus::bridge
