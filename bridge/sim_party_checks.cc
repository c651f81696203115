// What a SimParty refuses: processes that do not fit the run, and sensors that nobody could use.

#include <algorithm>
#include <cmath>
#include <string>

#include "bridge/sim_party.h"
#include "vm/limits.h"

namespace morphbus::bridge {
namespace {

bool AllFinite(const std::vector<double>& numbers) {
  return std::all_of(numbers.begin(), numbers.end(), [](double n) { return std::isfinite(n); });
}

std::string Hex(int64_t hash) {
  std::string text;
  for (int shift = 60; shift >= 0; shift -= 4) {
    text += "0123456789abcdef"[static_cast<uint64_t>(hash) >> shift & 15];
  }
  return text;
}

}  // namespace

std::string SimParty::WhyUnfit(int process, const morphbus::hello_t& hello) const {
  const auto differs = [&hello](const std::string& what, int64_t has, uint64_t needs) {
    return hello.process + " has another " + what + " (" + Hex(has) + ") than this run (" +
           Hex(static_cast<int64_t>(needs)) + ")";
  };
  if (static_cast<uint64_t>(hello.wire_hash) != WireHash()) {
    return differs("build of the wire types", hello.wire_hash, WireHash());
  }
  if (static_cast<uint64_t>(hello.header.model_hash) != options_.model_hash) {
    return differs("model", hello.header.model_hash, options_.model_hash);
  }
  if (static_cast<size_t>(process) >= options_.modules.size()) return {};
  const ExpectedModule& module = options_.modules[static_cast<size_t>(process)];
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

std::string SimParty::WhyUnusable() const {
  if (sensed_.size() != options_.modules.size()) {
    return "the simulator senses " + std::to_string(sensed_.size()) + " modules instead of " +
           std::to_string(options_.modules.size());
  }
  for (const morphbus::module_sensors_t& reading : sensed_) {
    if (!AllFinite(reading.joint_position_si)) {
      return "the simulation became unstable: " + reading.name + " has joints that are nowhere";
    }
    if (reading.num_docked > vm::kMaxNeighbours) {
      return reading.name + " has more than " + std::to_string(vm::kMaxNeighbours) +
             " mated connectors, the most a module can handle";
    }
  }
  for (const morphbus::body_pose_t& body : truth_) {
    if (!std::isfinite(body.position_m[0] + body.position_m[1] + body.position_m[2] +
                       body.orientation_wxyz[0] + body.orientation_wxyz[1] +
                       body.orientation_wxyz[2] + body.orientation_wxyz[3])) {
      return "the simulation became unstable: a body is nowhere";
    }
  }
  return {};
}

}  // namespace morphbus::bridge
