#pragma once
// Ticks of one module as bytes: what it sensed and heard, and what it said. The host writes them
// from a run's log, an emulated microcontroller reads the inputs and must write the same outputs.
// Source lines are left out: a microcontroller tells functions and offsets in them, from which
// tools find the lines.

#include <cstdint>
#include <cstring>
#include <initializer_list>

#include "vm/module_api.h"
#include "vm/spread/packet.h"

namespace morphbus::test {

/// Appends numbers to a buffer of fixed size.
class ByteWriter {
 public:
  explicit ByteWriter(uint8_t* out) : out_(out) {}
  template <class Number>
  void Put(Number number) {
    std::memcpy(out_ + size_, &number, sizeof number);
    size_ += static_cast<int>(sizeof number);
  }
  void Packet(const vm::NeighbourMessage& message) {
    const int size = vm::WritePacket(message, out_ + size_ + 2);
    Put(static_cast<uint16_t>(size));
    size_ += size;
  }
  /// A message without what is said of programs, which is not the VM's: no piece goes with it, and
  /// the news before the piece's size are blank.
  void PacketOfVm(const vm::NeighbourMessage& message) {
    constexpr int kNewsBytes = 30, kSizeBytes = 2;
    Packet(message);
    std::memset(out_ + size_ - kSizeBytes - kNewsBytes, 0, kNewsBytes);
  }
  [[nodiscard]] int size() const { return size_; }

 private:
  uint8_t* out_;
  int size_ = 0;
};

/// Reads what ByteWriter wrote on a machine of the same byte order; the files are our own.
class ByteReader {
 public:
  explicit ByteReader(const uint8_t* bytes) : at_(bytes) {}
  template <class Number>
  Number Get() {
    Number number;
    std::memcpy(&number, at_, sizeof number);
    at_ += sizeof number;
    return number;
  }
  template <class Number>
  void To(Number* number) {
    *number = Get<Number>();
  }
  const uint8_t* Bytes(int count) {
    at_ += count;
    return at_ - count;
  }

 private:
  const uint8_t* at_;
};

inline void PutPose(const vm::PoseF& X, ByteWriter* out) {
  for (const float part : {X.p.x, X.p.y, X.p.z, X.q.w, X.q.x, X.q.y, X.q.z}) out->Put(part);
}
inline void GetPose(ByteReader* in, vm::PoseF* X) {
  for (float* part : {&X->p.x, &X->p.y, &X->p.z, &X->q.w, &X->q.x, &X->q.y, &X->q.z}) in->To(part);
}

/// Writes an input; joints and connectors are those of the module's type.
inline void PutInput(const vm::TickInput& input, int joints, int connectors, ByteWriter* out) {
  out->Put(input.tick);
  out->Put(input.sim_time_us);
  for (int j = 0; j < joints; ++j) out->Put(input.joint_position[j]);
  for (int j = 0; j < joints; ++j) out->Put(input.joint_velocity[j]);
  for (int j = 0; j < joints; ++j) out->Put(input.joint_effort[j]);
  out->Put(uint8_t{input.has_root_pose});
  out->Put(input.root_link);
  PutPose(input.X_RL_root, out);
  for (int c = 0; c < connectors; ++c) {
    const vm::ConnectorReading& reading = input.connectors[c];
    out->Put(static_cast<uint8_t>((reading.docked ? 1 : 0) | (reading.is_member_b ? 2 : 0)));
    out->Put(reading.mate_module);
    out->Put(reading.mate_connector);
    out->Put(reading.connection_type);
    out->Put(reading.number);
  }
  for (int c = 0; c < connectors; ++c) {
    if (input.messages[c] != nullptr) {
      out->Packet(*input.messages[c]);
    } else {
      out->Put(uint16_t{0});
    }
  }
}

/// Reads it; messages go to `messages`, of which there are `capacity`. False if one of them is none
/// in this profile, or if there are too many.
inline bool GetInput(ByteReader* in, int joints, int connectors, vm::NeighbourMessage* messages,
                     int capacity, vm::TickInput* input) {
  in->To(&input->tick);
  in->To(&input->sim_time_us);
  for (int j = 0; j < joints; ++j) in->To(&input->joint_position[j]);
  for (int j = 0; j < joints; ++j) in->To(&input->joint_velocity[j]);
  for (int j = 0; j < joints; ++j) in->To(&input->joint_effort[j]);
  input->has_root_pose = in->Get<uint8_t>() != 0;
  in->To(&input->root_link);
  GetPose(in, &input->X_RL_root);
  for (int c = 0; c < connectors; ++c) {
    vm::ConnectorReading& reading = input->connectors[c];
    const auto flags = in->Get<uint8_t>();
    reading.docked = (flags & 1) != 0;
    reading.is_member_b = (flags & 2) != 0;
    in->To(&reading.mate_module);
    in->To(&reading.mate_connector);
    in->To(&reading.connection_type);
    in->To(&reading.number);
  }
  int used = 0;
  for (int c = 0; c < connectors; ++c) {
    input->messages[c] = nullptr;
    const int size = in->Get<uint16_t>();
    if (size == 0) continue;
    const uint8_t* bytes = in->Bytes(size);
    if (used == capacity || !vm::ReadPacket(bytes, size, &messages[used])) return false;
    input->messages[c] = &messages[used++];
  }
  return true;
}

inline void PutFault(const vm::Fault& fault, ByteWriter* out) {
  out->Put(static_cast<uint8_t>(fault.code));
  for (const int16_t index : {fault.role, fault.rival_role, fault.function, fault.keyword}) {
    out->Put(index);
  }
  out->Put(fault.pc);
  for (const int8_t part : {fault.joint, fault.link, fault.connector}) out->Put(part);
  for (const float number : {fault.asked, fault.measured, fault.limit}) out->Put(number);
  out->Put(static_cast<uint8_t>(fault.asked_axis));
  out->Put(fault.ended_task);
  out->Put(fault.task_function);
  for (const float part : {fault.direction_R.x, fault.direction_R.y, fault.direction_R.z}) {
    out->Put(part);
  }
}

/// Everything that a tick says: message, commands, status.
inline void PutOutput(const vm::TickOutput& output, int joints, ByteWriter* out) {
  out->PacketOfVm(output.message);
  for (int j = 0; j < joints; ++j) {
    out->Put(static_cast<uint8_t>(output.joints[j].mode));
    out->Put(output.joints[j].target);
    out->Put(output.joints[j].speed);
  }
  out->Put(output.num_connector_commands);
  for (int i = 0; i < output.num_connector_commands; ++i) {
    const vm::ConnectorCommand& command = output.connector_commands[i];
    for (const uint8_t part : {command.connector, command.state, command.value}) out->Put(part);
  }
  const vm::StatusReport& status = output.status;
  out->Put(uint8_t{status.changed});
  out->Put(status.role);
  for (const bool flag : {status.frozen, status.has_pose, status.pose_stale}) {
    out->Put(uint8_t{flag});
  }
  out->Put(status.num_labels);
  for (int i = 0; i < status.num_labels; ++i) out->Put(status.labels[i]);
  for (int j = 0; j < joints; ++j) out->Put(status.signs[j]);
  out->Put(status.num_tasks);
  for (int i = 0; i < status.num_tasks; ++i) {
    out->Put(static_cast<uint8_t>(status.tasks[i].kind));
    out->Put(status.tasks[i].function);
    out->Put(status.tasks[i].pc);
  }
  out->Put(status.ended_behaviors);
  out->Put(uint8_t{status.startup_ended});
  out->Put(status.num_faults);
  out->Put(status.faults_dropped);
  for (int i = 0; i < status.num_faults; ++i) PutFault(status.faults[i], out);
  out->Put(status.num_prints);
  out->Put(status.prints_dropped);
  for (int i = 0; i < status.num_prints; ++i) {
    const vm::PrintReport& print = status.prints[i];
    out->Put(print.function);
    out->Put(print.pc);
    out->Put(print.text);
    out->Put(print.num_values);
    for (int k = 0; k < print.num_values; ++k) out->Put(print.values[k].bits);
  }
}

/// What a module is told at its start (vm::VmConfig).
inline void PutConfig(const vm::VmConfig& config, ByteWriter* out) {
  out->Put(config.module_id);
  out->Put(config.incarnation);
  out->Put(uint8_t{config.is_root});
  out->Put(config.root_link);
  PutPose(config.X_RL_root, out);
  out->Put(config.grace_ticks);
  out->Put(config.random_seed);
}
inline void GetConfig(ByteReader* in, vm::VmConfig* config) {
  in->To(&config->module_id);
  in->To(&config->incarnation);
  config->is_root = in->Get<uint8_t>() != 0;
  in->To(&config->root_link);
  GetPose(in, &config->X_RL_root);
  in->To(&config->grace_ticks);
  in->To(&config->random_seed);
}

}  // namespace morphbus::test
