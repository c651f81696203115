#include "bridge/lockstep/sim/robot_readings.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>

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

void RobotReadings::Sense(SimulatedRobot* robot,
                          const std::function<morphbus::root_pose_t()>& root) {
  // All are of one moment: the physics stands still meanwhile.
  robot->Sense(&modules_);
  robot->Truth(&bodies_);
  robot->ContactForces(&contacts_);
  if (root) root_pose_ = root();
}

void RobotReadings::HideLost(const std::function<bool(int id)>& lost) {
  for (morphbus::module_sensors_t& reading : modules_) {
    // What a lost module's own connectors sense is not told, nor that another module is mated to
    // it.
    const bool gone = lost(reading.module_id);
    std::erase_if(reading.docked, [&](const morphbus::docked_connector_t& docked) {
      return gone || lost(docked.mate_module);
    });
    reading.num_docked = static_cast<int8_t>(reading.docked.size());
  }
}

std::string RobotReadings::WhyUnusable(size_t num_modules) const {
  // Every module waits for a reading of its own.
  if (modules_.size() != num_modules) {
    return "the simulator senses " + std::to_string(modules_.size()) + " modules instead of " +
           std::to_string(num_modules);
  }
  // Readings that a receiver would refuse, or a module could not use.
  for (const morphbus::module_sensors_t& reading : modules_) {
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
  // WORLD is refused by its receivers if a number in it is not finite, and the log would lack it.
  for (const morphbus::body_pose_t& body : bodies_) {
    if (!AllFinite(body.position_m) || !AllFinite(body.orientation_wxyz)) {
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

int RobotReadings::HopsFrom(size_t module) const {
  // Readings lie in order of modules; dockings name their mates by id.
  std::map<int16_t, size_t> place;
  for (size_t i = 0; i < modules_.size(); ++i) place[modules_[i].module_id] = i;
  // Breadth first, from the module outwards.
  std::vector<int> hops(modules_.size(), -1);
  std::vector<size_t> row = {module};
  if (module < hops.size()) hops[module] = 0;
  int most = 0;
  for (size_t next = 0; next < row.size() && row[next] < modules_.size(); ++next) {
    for (const morphbus::docked_connector_t& docked : modules_[row[next]].docked) {
      const auto mate = place.find(docked.mate_module);
      // A mate that has been reached before was reached by fewer dockings.
      if (mate == place.end() || hops[mate->second] >= 0) continue;
      most = hops[mate->second] = hops[row[next]] + 1;
      row.push_back(mate->second);
    }
  }
  return most;
}

}  // namespace morphbus::bridge
