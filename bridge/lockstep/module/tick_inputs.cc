#include "bridge/lockstep/module/tick_inputs.h"

#include <algorithm>

#include "bridge/wire/own_sensors.h"
#include "bridge/wire/vm_codec.h"

namespace morphbus::bridge {

bool TickInputs::Read(const morphbus::module_sensors_t& reading, vm::TickInput* input) const {
  // A reading of another name or shape belongs to another module, or to another model.
  return reading.name == module_.module &&
         FromSensors(reading, module_.num_joints, module_.num_connectors, module_.num_sensor_values,
                     input);
}

void TickInputs::Take(const vm::TickInput& input, const morphbus::sensors_t& sensors) {
  input_ = input;
  // Orders hold for the tick that they came with, but for an inspection that is still to be
  // answered.
  inspected_ = FromOrders(sensors, module_.module_id, &input_, &pieces_) || inspected_;
}

void TickInputs::AddMates(const vm::TickInput& input, std::vector<uint16_t>* mates) const {
  for (int c = 0; c < module_.num_connectors; ++c) {
    const vm::ConnectorReading& connector = input.connectors[c];
    if (!connector.docked || connector.mate_module == module_.module_id) continue;
    // Several connectors may be mated to the same module.
    if (std::ranges::count(*mates, connector.mate_module) > 0) continue;
    mates->push_back(connector.mate_module);
  }
}

void TickInputs::Compute(
    int64_t tick, int64_t sim_time_us,
    const std::function<const vm::NeighbourMessage*(uint16_t mate)>& message_of,
    ModuleController* controller, vm::TickOutput* output) {
  input_.tick = tick;
  input_.sim_time_us = sim_time_us;
  for (int c = 0; c < module_.num_connectors; ++c) {
    // Before tick 0 no module had said anything, and a module that is docked to itself needs no
    // message.
    const vm::ConnectorReading& connector = input_.connectors[c];
    const bool mate = connector.docked && connector.mate_module != module_.module_id && tick > 0;
    input_.messages[c] = mate ? message_of(connector.mate_module) : nullptr;
  }
  // New programs are taken before the tick that they came with is computed.
  for (const morphbus::deploy_piece_t& piece : pieces_) controller->TakePiece(piece);
  controller->Tick(input_, output);
}

}  // namespace morphbus::bridge
