#pragma once
// What a module needs to compute a tick, gathered from SENSORS.

#include <cstdint>
#include <functional>
#include <morphbus/deploy_piece_t.hpp>
#include <morphbus/module_sensors_t.hpp>
#include <morphbus/sensors_t.hpp>
#include <string>
#include <utility>
#include <vector>

#include "bridge/lockstep/module/module_controller.h"
#include "vm/module_api.h"

namespace morphbus::bridge {

/// In real time what a neighbour said this many ticks ago is still better than nothing: so long its
/// late or lost messages are done without.
inline constexpr int kOldestUsefulTicks = 3;

/// The module that SENSORS is read for; readings of other ones are refused.
struct SensedModule {
  /// Name and number, as SENSORS tells them.
  std::string module;
  uint16_t module_id = 0;
  /// How many joints, connectors and values of sensors its type has.
  int num_joints = 0;
  int num_connectors = 0;
  int num_sensor_values = 0;
};

/// A module's own reading and the orders for it, as they came with the SENSORS of the tick that is
/// computed next.
class TickInputs {
 public:
  explicit TickInputs(SensedModule module) : module_(std::move(module)) {}

  /// Reads the module's own reading; false if it cannot be this module's.
  bool Read(const morphbus::module_sensors_t& reading, vm::TickInput* input) const;
  /// Takes a reading that Read accepted, and the orders that SENSORS has for this module besides,
  /// for the coming tick. Orders of the tick before are done with.
  void Take(const vm::TickInput& input, const morphbus::sensors_t& sensors);
  /// Adds the modules mated to this one by a reading, each once, in order of connectors.
  void AddMates(const vm::TickInput& input, std::vector<uint16_t>* mates) const;
  /// The same by the reading that was taken last.
  void AddMates(std::vector<uint16_t>* mates) const { AddMates(input_, mates); }

  /// Lets the controller compute the tick on what was taken.
  /// @param message_of  what a neighbour said in the tick before; null if that is not there.
  void Compute(int64_t tick, int64_t sim_time_us,
               const std::function<const vm::NeighbourMessage*(uint16_t mate)>& message_of,
               ModuleController* controller, vm::TickOutput* output);
  /// Whether STATUS of the tick that was computed last shall tell all that the module holds. The
  /// order holds for one tick, also in real time, where readings may fail to come.
  bool TakeInspection() { return std::exchange(inspected_, false); }

 private:
  SensedModule module_;
  vm::TickInput input_;
  std::vector<morphbus::deploy_piece_t> pieces_;  ///< Of a new program.
  bool inspected_ = false;
};

}  // namespace morphbus::bridge
