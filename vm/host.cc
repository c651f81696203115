#include "vm/host.h"

#include <initializer_list>

#include "vm/bodies.h"
#include "vm/diffusion.h"
#include "vm/motion.h"
#include "vm/spatial.h"

namespace morphbus::vm {

namespace {

/// Keywords are names of the module type in capitals.
bool IsKeywordFor(Text keyword, Text name) {
  if (keyword.size != name.size) return false;
  for (int i = 0; i < name.size; ++i) {
    const char c = name.data[i];
    const char upper = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
    if (keyword.data[i] != upper) return false;
  }
  return true;
}

int FindState(const KinConnector& connector, Text keyword) {
  for (int i = 0; i < connector.num_states; ++i) {
    if (IsKeywordFor(keyword, connector.states[i].name)) return i;
  }
  return -1;
}

OpResult FaultOf(FaultCode code) {
  OpResult result;
  result.fault = code;
  return result;
}

}  // namespace

bool Host::IsJoint(int joint) const {
  return joint >= 0 && joint < context_.kinematics.num_joints() &&
         context_.kinematics.joint(joint).kind != JointKind::kFixed;
}

bool Host::Turns(int joint) const {
  return IsJoint(joint) && context_.kinematics.joint(joint).kind != JointKind::kPrismatic;
}

/// A fault that does not end the task, at the instruction that runs.
void Host::ReportHere(Fault fault) {
  if (running_ != nullptr && running_->stack.depth > 0) {
    const Frame& frame = running_->stack.frames[running_->stack.depth - 1];
    fault.function = static_cast<int16_t>(frame.function);
    fault.line = static_cast<uint16_t>(context_.program.LineOf(frame.function, frame.pc));
  }
  Report(context_, fault);
}

uint32_t Host::Connected(Direction d) {
  uint32_t mask = 0;
  for (int c = 0; c < context_.kinematics.num_connectors(); ++c) {
    if (context_.state.mates[c].docked && LiesTowards(context_, c, d)) mask |= 1u << c;
  }
  return mask;
}

uint32_t Host::ConnectedRole(Direction d, int role) {
  read_roles_ = true;
  uint32_t mask = Connected(d);
  for (int c = 0; c < context_.kinematics.num_connectors(); ++c) {
    const int mates = context_.state.mates[c].role;
    const bool plays = mates >= 0 && role >= 0 && role < context_.program.num_roles() &&
                       context_.program.IsA(mates, role);
    if (!plays) mask &= ~(1u << c);
  }
  return mask;
}

int Host::CountModules(uint32_t connector_mask) {
  int count = 0;
  for (int c = 0; c < context_.kinematics.num_connectors(); ++c) {
    if ((connector_mask >> c & 1u) == 0) continue;
    bool seen = false;
    for (int d = 0; d < c; ++d) {
      seen = seen || ((connector_mask >> d & 1u) != 0 &&
                      context_.state.mates[d].module == context_.state.mates[c].module);
    }
    if (!seen) ++count;
  }
  return count;
}

uint32_t Host::Joints(Axis axis, int adjacent) {
  uint32_t mask = 0;
  for (int j = 0; j < context_.kinematics.num_joints(); ++j) {
    if (IsJoint(j) && AdjacentOf(context_, j) == adjacent && LiesAlong(context_, j, axis)) {
      mask |= 1u << j;
    }
  }
  return mask;
}

uint32_t Host::Links(int degree) {
  uint32_t mask = 0;
  for (int i = 0; i < context_.kinematics.num_links(); ++i) {
    if (DegreeOf(context_, i) == degree) mask |= 1u << i;
  }
  return mask;
}

Axis Host::JointAxis(int joint) {
  if (joint < 0 || joint >= context_.kinematics.num_joints()) return Axis::kAny;
  for (const Axis axis : {Axis::kNorthSouth, Axis::kUpDown, Axis::kEastWest}) {
    if (LiesAlong(context_, joint, axis)) return axis;
  }
  return Axis::kAny;
}

Axis Host::CenterAxis() {
  int only = -1;
  for (int j = 0; j < context_.kinematics.num_joints(); ++j) {
    if (!IsJoint(j)) continue;
    if (only >= 0) return Axis::kAny;
    only = j;
  }
  return JointAxis(only);
}

int Host::Keyword(int keyword) {
  const KeywordInfo& info = context_.program.keyword(keyword);
  const VerifiedKinematics& kin = context_.kinematics;
  switch (info.kind) {
    case KeywordKind::kLink:
      for (int i = 0; i < kin.num_links(); ++i) {
        if (IsKeywordFor(info.name, kin.link(i).name)) return i;
      }
      break;
    case KeywordKind::kJoint:
      for (int i = 0; i < kin.num_joints(); ++i) {
        if (IsKeywordFor(info.name, kin.joint(i).name)) return i;
      }
      break;
    case KeywordKind::kConnector:
      for (int i = 0; i < kin.num_connectors(); ++i) {
        if (IsKeywordFor(info.name, kin.connector(i).name)) return i;
      }
      break;
    case KeywordKind::kConnectorState:
      for (int i = 0; i < kin.num_connectors(); ++i) {
        if (FindState(kin.connector(i), info.name) >= 0) return i;
      }
      break;
  }
  return -1;
}

OpResult Host::SetJointAxis(int joint, int link, Axis axis) {
  if (!IsJoint(joint)) return FaultOf(FaultCode::kBadState);
  Fault fault;
  SetConvention(context_, joint, link, axis, &fault);
  if (fault.code != FaultCode::kNone) {
    ReportHere(fault);
    reported_ = true;
  }
  return FaultOf(fault.code);
}

OpResult Host::MoveTo(int joint, double target, bool blocking) {
  Fault fault;
  if (!SetTarget(context_, joint, target, &fault)) ReportHere(fault);
  OpResult result;
  if (blocking && running_ != nullptr && !IsAtRest(context_, joint)) {
    result.wait = true;
    running_->wait = WaitKind::kMotion;
    running_->wait_joint = static_cast<uint8_t>(joint);
  }
  return result;
}

OpResult Host::RotateDegrees(int joint, float degrees, bool blocking) {
  if (!Turns(joint)) return FaultOf(FaultCode::kBadState);
  const JointState& state = context_.state.joints[joint];
  const double from = state.turning ? state.measured : state.target;
  return MoveTo(joint, from + SignOf(context_, joint) * static_cast<double>(degrees), blocking);
}

OpResult Host::SetDegrees(int joint, float degrees, bool blocking) {
  if (!Turns(joint)) return FaultOf(FaultCode::kBadState);
  return MoveTo(joint, SignOf(context_, joint) * static_cast<double>(degrees), blocking);
}

OpResult Host::JointDegrees(int joint, float* degrees) {
  if (!IsJoint(joint)) return FaultOf(FaultCode::kBadState);
  *degrees = static_cast<float>(SignOf(context_, joint) * context_.state.joints[joint].measured);
  return {};
}

OpResult Host::TurnContinuous(int joint, float degrees_per_s) {
  if (!IsJoint(joint) || context_.kinematics.joint(joint).kind != JointKind::kContinuous) {
    return FaultOf(FaultCode::kNotContinuous);
  }
  Fault fault;
  const double velocity = SignOf(context_, joint) * static_cast<double>(degrees_per_s);
  if (!Turn(context_, joint, velocity, &fault)) ReportHere(fault);
  return {};
}

OpResult Host::MoveMillimetres(int joint, float mm) {
  if (!IsJoint(joint) || Turns(joint)) return FaultOf(FaultCode::kNotPrismatic);
  const double from = context_.state.joints[joint].target;
  return MoveTo(joint, from + SignOf(context_, joint) * static_cast<double>(mm), true);
}

OpResult Host::SetPosition(int joint, float degrees) {
  if (!IsJoint(joint)) return FaultOf(FaultCode::kBadState);
  return MoveTo(joint, static_cast<double>(degrees), false);
}

OpResult Host::GetPosition(int joint, float* degrees) {
  if (!IsJoint(joint)) return FaultOf(FaultCode::kBadState);
  *degrees = static_cast<float>(context_.state.joints[joint].measured);
  return {};
}

OpResult Host::SetConnectorState(int connector, int state_keyword, Cell value) {
  if (connector < 0 || connector >= context_.kinematics.num_connectors()) {
    return FaultOf(FaultCode::kBadState);
  }
  const KinConnector& own = context_.kinematics.connector(connector);
  const int state = FindState(own, context_.program.keyword(state_keyword).name);
  if (state < 0) return FaultOf(FaultCode::kMissingKeyword);
  if (value.AsInt() < 0 || value.AsInt() >= own.states[state].num_values) {
    return FaultOf(FaultCode::kBadState);
  }
  if (context_.output == nullptr) return {};
  TickOutput& output = *context_.output;
  if (output.num_connector_commands == kMaxConnectors) return FaultOf(FaultCode::kCapacity);
  ConnectorCommand& command = output.connector_commands[output.num_connector_commands++];
  command.connector = static_cast<uint8_t>(connector);
  command.state = static_cast<uint8_t>(state);
  command.value = static_cast<uint8_t>(value.AsInt());
  return {};
}

OpResult Host::Sleep(int64_t duration_us) {
  OpResult result;
  if (running_ == nullptr) return result;
  result.wait = true;
  if (duration_us <= 0) {
    running_->wait = WaitKind::kNextTick;
    running_->wake_us = context_.state.tick;
  } else {
    running_->wait = WaitKind::kSleep;
    running_->wake_us = context_.state.sim_time_us + duration_us;
  }
  return result;
}

OpResult Host::Invoke(int role, int command_slot, const Cell* arguments, int count) {
  const FaultCode code = Issue(context_, role, command_slot, arguments, count);
  if (code != FaultCode::kNone) {
    Fault fault;
    fault.code = code;
    ReportHere(fault);
  }
  return {};
}

}  // namespace morphbus::vm
