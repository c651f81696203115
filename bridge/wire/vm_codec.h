#pragma once
// Between the VM's plain structs (vm/module_api.h) and the wire types. The VM knows no message
// types and no LCM, so that it can run where neither exists; nowhere else are fields of one
// made from those of the other. Incoming messages have passed Decode, so their numbers are in
// range.

#include <cstdint>
#include <morphbus/actuator_t.hpp>
#include <morphbus/invoke_request_t.hpp>
#include <morphbus/module_sensors_t.hpp>
#include <morphbus/root_pose_t.hpp>
#include <morphbus/sensors_t.hpp>
#include <morphbus/status_t.hpp>
#include <morphbus/transform_t.hpp>
#include <string>
#include <vector>

#include "bridge/wire/held_state.h"
#include "bridge/wire/wire_limits.h"
#include "compiler/base/result.h"
#include "vm/module_api.h"

namespace morphbus::bridge {

/// The neighbour message as transform_t, header left to the outbox. Always under kMaxPayloadBytes.
void ToTransform(const vm::NeighbourMessage& message, morphbus::transform_t* out);

/// The reverse, of a message that Decode accepted; tick and program hash come from its header.
void FromTransform(const morphbus::transform_t& message, vm::NeighbourMessage* out);

/// The neighbour message as the bytes of a transform_t whose header names nothing but its tick and
/// program: for hosts that carry messages themselves.
void EncodeTransform(const vm::NeighbourMessage& message, std::vector<uint8_t>* out);
/// The reverse, of any bytes. Fails for those that Decode refuses.
Result<void> DecodeTransform(const uint8_t* data, size_t size, vm::NeighbourMessage* out);

/// Commands of one tick. `status_count`: STATUS messages published so far, this tick's included.
void ToActuator(const vm::TickOutput& output, uint16_t module_id, int num_joints,
                int64_t status_count, morphbus::actuator_t* out);

/// The module's own reading as the VM's input (tick, time and messages are left alone). Fails if
/// the numbers of joints, connectors or sensor values do not fit the module's type.
Result<void> FromSensors(const morphbus::module_sensors_t& reading, int num_joints,
                         int num_connectors, int num_sensor_values, vm::TickInput* out);

/// Names behind a StatusReport's numbers, as text.
struct StatusNames {
  /// The module's type in the model.
  std::string type_name;
  std::string role_name;                    ///< Of the report's role; empty without one.
  std::vector<std::string> label_names;     ///< Of its label slots.
  std::vector<bool> label_is_joint;         ///< Else a link.
  std::vector<std::string> task_functions;  ///< By entry of tasks.
};

/// Longest name in a STATUS, bytes; longer ones are cut at a character.
inline constexpr size_t kMaxStatusName = 48;

/// The report as one message, or as several if its faults, or `held`, do not fit into one. Labels
/// always fit; tasks that do not are counted in tasks_omitted. Every message repeats all but the
/// faults, prints and what is held, so that each can be read alone.
/// @param held  what the module holds besides, if it was asked to tell; else null.
std::vector<morphbus::status_t> ToStatus(const vm::StatusReport& report, const StatusNames& names,
                                         uint16_t module_id, uint32_t incarnation, int num_joints,
                                         const HeldState* held = nullptr);

/// Whether what STATUS has among its printed lines is the value of a traced field: no function
/// printed it, and its text is the slot of the field in the role.
inline bool IsTrace(const morphbus::print_t& print) {
  return print.function_index < 0 && print.num_values == 1;
}
/// Such a value.
vm::TraceReport FromTrace(const morphbus::print_t& print);

/// A printed line of a STATUS that Decode accepted, to be worded by vm::PrintText.
vm::PrintReport FromPrint(const morphbus::print_t& print);

/// A fault of a STATUS that Decode accepted, to be worded by vm::FaultSentence.
vm::Fault FromFault(const morphbus::fault_t& fault);

/// An invocation from outside, on its way to the module that shall issue it.
void ToRequest(const vm::InvokeRequest& request, uint16_t module_id,
               morphbus::invoke_request_t* out);

/// The pose of link `link` of the root as its sensor measures it.
void ToRootPose(uint16_t module_id, uint8_t link, const vm::PoseF& X_RL,
                morphbus::root_pose_t* out);

/// What SENSORS has for a module besides its reading: adds invocations to issue and the measured
/// pose of its link to `input`, and has `pieces` be those of a new program. Returns whether it
/// shall tell in STATUS of this tick what it holds.
bool FromOrders(const morphbus::sensors_t& sensors, uint16_t module_id, vm::TickInput* input,
                std::vector<morphbus::deploy_piece_t>* pieces);

/// Splits modules into SENSORS parts: indices of the modules of each part, in order, such that no
/// part can exceed kMaxPayloadBytes whatever gets docked, asked for or deployed. `most_docked`: of
/// each module, the number of its connectors.
std::vector<std::vector<size_t>> SplitSensors(
    const std::vector<morphbus::module_sensors_t>& modules, const std::vector<int>& most_docked);

/// How many bodies, and as many contact forces besides, fit into one part of WORLD.
size_t WorldLinksPerPart();

}  // namespace morphbus::bridge
