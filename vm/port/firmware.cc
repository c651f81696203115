#include "vm/port/firmware.h"

namespace morphbus::vm {
namespace {

/// Of a frame's body: module and connector that speak.
constexpr int kHeaderBytes = 3;
/// A tick beyond this, 248 days of 20 ms, is not believed: no module could come back from it.
constexpr int64_t kMaxTick = int64_t{1} << 30;

}  // namespace

Firmware::Firmware(const VmConfig& config, const VerifiedKinematics& kinematics,
                   const VerifiedProgram& program, VmState* state, Hardware* hardware,
                   PackageStore* packages)
    : kinematics_(kinematics),
      module_(config.module_id),
      hardware_(*hardware),
      vm_(config, kinematics, program, state),
      programs_(program, &relay_state_, packages != nullptr ? packages : &no_packages_) {
  // The first tick is number 0.
  input_.tick = -1;
  programs_.Begin();
}

void Firmware::Listen() {
  uint8_t bytes[32];
  for (int c = 0; c < kinematics_.num_connectors(); ++c) {
    // A link that never falls silent does not keep the others waiting for ever.
    for (int taken = 0, count = 0; taken < kMaxFrameBytes; taken += count) {
      count = hardware_.Receive(c, bytes, sizeof bytes);
      if (count <= 0) break;
      for (int i = 0; i < count; ++i) {
        readers_[c].Put(bytes[i]);
        while (readers_[c].Next()) Hear(c);
      }
    }
  }
}

void Firmware::Hear(int connector) {
  // A frame says who speaks and over which connector, and then what.
  const uint8_t* body = readers_[connector].body();
  const int packet_size = readers_[connector].body_size() - kHeaderBytes;
  if (packet_size < 0) return;
  const auto module = static_cast<uint16_t>(body[0] | body[1] << 8);
  neighbours_[connector] = {
      .heard = true, .module = module, .connector = body[2], .silent_ticks = 0};
  // Without a packet it is a greeting.
  if (packet_size == 0) return;
  NeighbourMessage* message = pool_.RoomFor(connector, &input_);
  if (message == nullptr) return;
  input_.messages[connector] = nullptr;
  if (!ReadPacket(body + kHeaderBytes, packet_size, message)) return;
  input_.messages[connector] = message;
  if (message->tick > heard_tick_ && message->tick < kMaxTick) heard_tick_ = message->tick;
}

void Firmware::Tick(int64_t time_us) {
  // Messages from far ahead are not believed: a module that begins later leaps to its neighbours.
  input_.tick = lag() > kMaxTickAhead / 2 ? heard_tick_ : input_.tick + 1;
  input_.sim_time_us = time_us;
  for (int j = 0; j < kinematics_.num_joints(); ++j) {
    hardware_.ReadJoint(j, &input_.joint_position[j], &input_.joint_velocity[j]);
  }
  for (int c = 0; c < kinematics_.num_connectors(); ++c) {
    input_.connectors[c] = hardware_.ReadConnector(c, neighbours_[c]);
    // A robot that only passes by spreads no program here.
    if (!input_.connectors[c].docked) input_.messages[c] = nullptr;
  }
  // All that was sensed and heard makes one tick of the virtual machine.
  hardware_.ReadSensors(&input_);
  programs_.Tick(input_, &vm_, &output_);
  // What was heard counts in one tick.
  for (int c = 0; c < kinematics_.num_connectors(); ++c) {
    input_.messages[c] = nullptr;
    ++neighbours_[c].silent_ticks;
  }
  input_.num_requests = 0;
  input_.has_root_pose = false;
  for (int j = 0; j < kinematics_.num_joints(); ++j) hardware_.DriveJoint(j, output_.joints[j]);
  for (int i = 0; i < output_.num_connector_commands; ++i) {
    hardware_.DriveConnector(output_.connector_commands[i]);
  }
  SendAll(WritePacket(output_.message, frame_ + kFrameHeadBytes + kHeaderBytes));
}

void Firmware::SendAll(int packet_size) {
  for (int c = 0; c < kinematics_.num_connectors(); ++c) {
    uint8_t* header = frame_ + kFrameHeadBytes;
    header[0] = static_cast<uint8_t>(module_);
    header[1] = static_cast<uint8_t>(module_ >> 8);
    header[2] = static_cast<uint8_t>(c);
    hardware_.Send(c, frame_, WriteFrame(frame_, kHeaderBytes + packet_size));
  }
}

}  // namespace morphbus::vm
