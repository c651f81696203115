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
#include <morphbus/transform_t.hpp>
#include <vector>

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
