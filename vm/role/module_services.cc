#include "vm/role/module_services.h"

#include "vm/role/motion.h"
#include "vm/run/mathematics.h"
#include "vm/space/bodies.h"
#include "vm/space/spatial.h"
#include "vm/spread/diffusion.h"

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

/// The first of `count` things whose name the keyword is; -1 if there is none.
template <class NameOf>
int FindNamed(Text keyword, int count, const NameOf& name_of) {
  for (int i = 0; i < count; ++i) {
    if (IsKeywordFor(keyword, name_of(i))) return i;
  }
  return -1;
}

/// Number of the connector's state variable that a keyword names; -1 if it has none.
int FindState(const KinConnector& connector, Text keyword) {
  return FindNamed(keyword, connector.num_states, [&](int i) { return connector.states[i].name; });
}

}  // namespace

// A keyword or label may name any joint of the type, also a fixed one.
bool ModuleServices::Moves(int joint) const {
  return joint >= 0 && joint < context_.kinematics.num_joints() &&
         context_.kinematics.joint(joint).kind != JointKind::kFixed;
}

// Handlers and keywords give connectors of the own type, but the verifier does not know the type.
bool ModuleServices::Exists(int connector) const {
  return connector >= 0 && connector < context_.kinematics.num_connectors();
}

bool ModuleServices::HasTold(int connector, int role) const {
  const int told = context_.state.neighbours[connector].shared_role;
  return told >= 0 && context_.program.IsA(told, role);
}

/// Sets the place of a fault to the instruction that runs.
void ModuleServices::SetPlaceOfCall(Fault* fault) const {
  if (running_ == nullptr || running_->stack.depth == 0) return;
  const Frame& frame = running_->stack.frames[running_->stack.depth - 1];
  SetPlace(context_.program, frame.function, frame.pc, fault);
}

/// A fault that does not end the task, at the instruction that runs.
void ModuleServices::ReportHere(Fault fault) {
  SetPlaceOfCall(&fault);
  Report(context_, fault);
}

/// A fault that ends the task, if one runs, at the instruction that runs.
OpResult ModuleServices::Refuse(const Fault& fault) {
  Fault told = fault;
  if (running_ != nullptr) SetEnded(*running_, &told);
  SetPlaceOfCall(&told);
  Report(context_, told);
  reported_ = true;
  OpResult result;
  result.fault = fault.code;
  return result;
}

OpResult ModuleServices::RefuseJoint(FaultCode code, int joint) {
  return Refuse({.code = code, .joint = static_cast<int8_t>(joint)});
}

/// Remembers the instruction that runs as the one that set the joint in motion.
void ModuleServices::NoteCall(int joint) {
  JointState& state = context_.state.joints[joint];
  Fault here;
  SetPlaceOfCall(&here);
  state.function = here.function;
  state.pc = here.pc;
}

// Sets are masks over own connectors, joints or links.
uint32_t ModuleServices::Connected(Direction d) {
  uint32_t mask = 0;
  for (int c = 0; c < context_.kinematics.num_connectors(); ++c) {
    if (context_.state.neighbours[c].sensor.docked && LiesTowards(context_, c, d)) mask |= 1u << c;
  }
  return mask;
}

uint32_t ModuleServices::ConnectedRole(Direction d, int role) {
  // A requirement that asks for roles is decided again when they change.
  read_roles_ = true;
  // Of those that lie there, the ones whose role is the wanted one or extends it stay.
  uint32_t mask = Connected(d);
  for (int c = 0; c < context_.kinematics.num_connectors(); ++c) {
    const int held = context_.state.neighbours[c].role;
    const bool plays = held >= 0 && role >= 0 && role < context_.program.num_roles() &&
                       context_.program.IsA(held, role);
    if (!plays) mask &= ~(1u << c);
  }
  return mask;
}

int ModuleServices::CountModules(uint32_t connector_mask) {
  // A module docked on several connectors counts once.
  int count = 0;
  uint32_t left = connector_mask & OwnConnectors();
  for (; left != 0; left &= ~FirstModule(left)) ++count;
  return count;
}

uint32_t ModuleServices::FirstModule(uint32_t connector_mask) {
  connector_mask &= OwnConnectors();
  if (connector_mask == 0) return 0;
  const auto module_at = [this](int c) { return context_.state.neighbours[c].sensor.mate_module; };
  const int first = __builtin_ctz(connector_mask);
  uint32_t mask = 1u << first;
  for (int c = first + 1; c < context_.kinematics.num_connectors(); ++c) {
    if (module_at(c) == module_at(first)) mask |= 1u << c;
  }
  return mask & connector_mask;
}

uint32_t ModuleServices::Telling(uint32_t connector_mask, int role) {
  if constexpr (!kHoldsAllInstructions) return 0;
  uint32_t mask = 0;
  for (int c = 0; c < context_.kinematics.num_connectors(); ++c) {
    if (HasTold(c, role)) mask |= 1u << c;
  }
  return mask & connector_mask;
}

uint32_t ModuleServices::Joints(Axis axis, int adjacent) {
  // Fixed joints are left out; `adjacent` counts the joints that touch one of the same bodies.
  uint32_t mask = 0;
  for (int j = 0; j < context_.kinematics.num_joints(); ++j) {
    if (Moves(j) && AdjacentOf(context_, j) == adjacent && LiesAlong(context_, j, axis)) {
      mask |= 1u << j;
    }
  }
  return mask;
}

uint32_t ModuleServices::Links(int degree) {
  uint32_t mask = 0;
  for (int i = 0; i < context_.kinematics.num_links(); ++i) {
    if (DegreeOf(context_, i) == degree) mask |= 1u << i;
  }
  return mask;
}

Axis ModuleServices::JointAxis(int joint) {
  if (joint < 0 || joint >= context_.kinematics.num_joints()) return Axis::kAny;
  // Axes and diagonals are 35 degrees and more apart, so at most one is within 15 degrees.
  for (int axis = 1; axis < kNumAxes; ++axis) {
    if (LiesAlong(context_, joint, static_cast<Axis>(axis))) return static_cast<Axis>(axis);
  }
  return Axis::kAny;
}

Axis ModuleServices::CenterAxis() {
  // Only a module with a single joint has a center.
  int only = -1;
  for (int j = 0; j < context_.kinematics.num_joints(); ++j) {
    if (!Moves(j)) continue;
    if (only >= 0) return Axis::kAny;
    only = j;
  }
  return JointAxis(only);
}

int ModuleServices::Keyword(int keyword) {
  // Keywords are bound by name, so one program serves modules of several types.
  const KeywordInfo info = context_.program.keyword(keyword);
  const VerifiedKinematics& kin = context_.kinematics;
  switch (info.kind) {
    case KeywordKind::kLink:
      return FindNamed(info.name, kin.num_links(), [&](int i) { return kin.link(i).name; });
    case KeywordKind::kJoint:
      return FindNamed(info.name, kin.num_joints(), [&](int i) { return kin.joint(i).name; });
    case KeywordKind::kConnector:
      return FindNamed(info.name, kin.num_connectors(),
                       [&](int i) { return kin.connector(i).name; });
    case KeywordKind::kConnectorState:
      for (int i = 0; i < kin.num_connectors(); ++i) {
        if (FindState(kin.connector(i), info.name) >= 0) return i;
      }
      break;
    case KeywordKind::kSensor:
      return FindNamed(info.name, kin.num_sensors(), [&](int i) { return kin.sensor(i).name; });
    case KeywordKind::kSensorKind:
      return FindNamed(info.name, kin.num_sensors(), [&](int i) {
        return kSensorKindNames[static_cast<int>(kin.sensor(i).kind)];
      });
  }
  return -1;
}

// Motion. Degrees and millimetres are those of the program, under the convention.
OpResult ModuleServices::SetJointAxis(int joint, int link, Axis axis) {
  if (!Moves(joint)) return RefuseJoint(FaultCode::kFixedJoint, joint);
  Fault fault;
  SetConvention(context_, joint, link, axis, &fault);
  return fault.code == FaultCode::kNone ? OpResult() : Refuse(fault);
}

OpResult ModuleServices::MoveTo(int joint, double asked, double sign, bool blocking) {
  // A target beyond the limits is reported, and the joint goes as far as it can.
  Fault fault;
  if (!SetTarget(context_, joint, asked, sign, &fault)) ReportHere(fault);
  NoteCall(joint);
  OpResult result;
  // A task waits only for what takes time; a joint that is there already costs no tick.
  if (blocking && running_ != nullptr && !IsAtRest(context_, joint)) {
    result.wait = true;
    running_->wait = WaitKind::kMotion;
    running_->wait_joint = static_cast<uint8_t>(joint);
  }
  return result;
}

/// kNone if the joint turns (rotary) or slides, as wanted; else the fault that says why not.
FaultCode ModuleServices::WhyNot(int joint, bool rotary) const {
  if (!Moves(joint)) return FaultCode::kFixedJoint;
  // Degrees and millimetres must not be mixed up: the program says which it means.
  const bool slides = context_.kinematics.joint(joint).kind == JointKind::kPrismatic;
  if (rotary) return slides ? FaultCode::kNotRotary : FaultCode::kNone;
  return slides ? FaultCode::kNone : FaultCode::kNotPrismatic;
}

/// Counts from the present target, so that 45 and 45 make 90 whatever the servo's error; a joint
/// that turns endlessly has no target, and counts from where it is.
OpResult ModuleServices::MoveBy(int joint, float by, bool rotary, bool blocking) {
  const FaultCode why_not = WhyNot(joint, rotary);
  if (why_not != FaultCode::kNone) return RefuseJoint(why_not, joint);
  // The sign turns the program's degrees into the actuator's, both ways.
  const JointState& state = context_.state.joints[joint];
  const double sign = SignOf(context_, joint);
  const double from = state.turning ? state.measured : state.target;
  return MoveTo(joint, sign * from + static_cast<double>(by), sign, blocking);
}

OpResult ModuleServices::SetDegrees(int joint, float degrees, bool blocking) {
  const FaultCode why_not = WhyNot(joint, true);
  if (why_not != FaultCode::kNone) return RefuseJoint(why_not, joint);
  return MoveTo(joint, static_cast<double>(degrees), SignOf(context_, joint), blocking);
}

OpResult ModuleServices::SetMillimetres(int joint, float mm, bool blocking) {
  const FaultCode why_not = WhyNot(joint, false);
  if (why_not != FaultCode::kNone) return RefuseJoint(why_not, joint);
  return MoveTo(joint, static_cast<double>(mm), SignOf(context_, joint), blocking);
}

OpResult ModuleServices::JointMillimetres(int joint, float* mm) {
  const FaultCode why_not = WhyNot(joint, false);
  if (why_not != FaultCode::kNone) return RefuseJoint(why_not, joint);
  *mm = static_cast<float>(SignOf(context_, joint) * context_.state.joints[joint].measured);
  return {};
}

OpResult ModuleServices::JointDegrees(int joint, float* degrees) {
  if (!Moves(joint)) return RefuseJoint(FaultCode::kFixedJoint, joint);
  // Where the joint is, not where it is to go.
  *degrees = static_cast<float>(SignOf(context_, joint) * context_.state.joints[joint].measured);
  return {};
}

OpResult ModuleServices::JointEffort(int joint, float* effort) {
  if (!Moves(joint)) return RefuseJoint(FaultCode::kFixedJoint, joint);
  // Adding zero makes -0 a plain 0, as people print it.
  *effort =
      static_cast<float>(SignOf(context_, joint)) * context_.state.joints[joint].effort + 0.0f;
  return {};
}

OpResult ModuleServices::JointVelocity(int joint, float* velocity) {
  if constexpr (!kHoldsAllInstructions) return {};
  if (!Moves(joint)) return RefuseJoint(FaultCode::kFixedJoint, joint);
  const double si = context_.input == nullptr ? 0 : context_.input->joint_velocity[joint];
  *velocity = static_cast<float>(SignOf(context_, joint) * si *
                                 UnitsPerSi(context_.kinematics.joint(joint))) +
              0.0f;
  return {};
}

OpResult ModuleServices::TurnContinuous(int joint, float degrees_per_s) {
  // Only a continuous joint can turn without end.
  if (!Moves(joint) || context_.kinematics.joint(joint).kind != JointKind::kContinuous) {
    return RefuseJoint(FaultCode::kNotContinuous, joint);
  }
  Fault fault;
  if (!Turn(context_, joint, static_cast<double>(degrees_per_s), SignOf(context_, joint), &fault)) {
    ReportHere(fault);
  }
  NoteCall(joint);
  return {};
}

// The raw actuator: no convention, and no waiting.
OpResult ModuleServices::SetPosition(int joint, float degrees) {
  if (!Moves(joint)) return RefuseJoint(FaultCode::kFixedJoint, joint);
  return MoveTo(joint, static_cast<double>(degrees), 1.0, false);
}

OpResult ModuleServices::GetPosition(int joint, float* degrees) {
  if (!Moves(joint)) return RefuseJoint(FaultCode::kFixedJoint, joint);
  *degrees = static_cast<float>(context_.state.joints[joint].measured);
  return {};
}

OpResult ModuleServices::SetConnectorState(int connector, int state_keyword, Cell value) {
  // The fault is complete before anything is checked, as every check refuses with it.
  Fault fault{.code = FaultCode::kNoSuchValue,
              .keyword = static_cast<int16_t>(state_keyword),
              .connector = static_cast<int8_t>(connector),
              .asked = static_cast<float>(value.AsInt())};
  if (!Exists(connector)) return Refuse(fault);
  // The state is found by name; its values are numbers from 0.
  const KinConnector& own = context_.kinematics.connector(connector);
  const int state = FindState(own, context_.program.keyword(state_keyword).name);
  // The limit is the number of values; 0 says that there is no such state.
  if (state >= 0) fault.limit = own.states[state].num_values;
  if (state < 0 || value.AsInt() < 0 || value.AsInt() >= own.states[state].num_values) {
    return Refuse(fault);
  }
  if (context_.output == nullptr) return {};
  // The order goes out with this tick's ACTUATOR.
  TickOutput& output = *context_.output;
  if (output.num_connector_commands == kMaxConnectors) {
    fault.code = FaultCode::kTooManyConnectorCommands;
    fault.limit = kMaxConnectors;
    return Refuse(fault);
  }
  // What the program asked for is known to exist, so numbers are enough.
  ConnectorCommand& command = output.connector_commands[output.num_connector_commands++];
  command.connector = static_cast<uint8_t>(connector);
  command.state = static_cast<uint8_t>(state);
  command.value = static_cast<uint8_t>(value.AsInt());
  context_.state.connector_values[connector][state] = command.value;
  return {};
}

OpResult ModuleServices::GetConnectorState(int connector, int state_keyword, int* value) {
  Fault fault{.code = FaultCode::kNoSuchValue,
              .keyword = static_cast<int16_t>(state_keyword),
              .connector = static_cast<int8_t>(connector)};
  // What was set last is told, as connectors do not sense their states.
  if (!Exists(connector)) return Refuse(fault);
  const int state = FindState(context_.kinematics.connector(connector),
                              context_.program.keyword(state_keyword).name);
  if (state < 0) return Refuse(fault);
  *value = context_.state.connector_values[connector][state];
  return {};
}

bool ModuleServices::Docked(int connector) {
  return Exists(connector) && context_.state.neighbours[connector].sensor.docked;
}

int64_t ModuleServices::RootTimeUs() {
  // All modules of a settled robot agree on the root's tick; its length is that of our own.
  const VmState& state = context_.state;
  // Unsigned, as a message may have said any tick.
  return static_cast<int64_t>(static_cast<uint64_t>(state.sim_time_us) +
                              static_cast<uint64_t>(state.pose.clock_ahead) *
                                  static_cast<uint64_t>(state.period_us));
}

int ModuleServices::Hops() { return context_.state.pose.has ? context_.state.pose.hops : 0; }

OpResult ModuleServices::Place(Axis axis, float* mm) {
  if constexpr (!kHoldsAllInstructions) return {};
  // A module takes no role before it knows where it is.
  // $ANY is no axis along which anything could be measured; its unit vector is 0.
  *mm = Dot(PlaceOf(context_), UnitOf(axis)) * 1000.0f + 0.0f;
  return {};
}

OpResult ModuleServices::Heading(float* degrees) {
  if constexpr (!kHoldsAllInstructions) return {};
  // The link that the pose came in by need not be level with the module as it stands at the
  // beginning, so that the first link counts.
  const Vec3 x_R = Rotate(context_.state.pose.X_RL[0].q, {1, 0, 0});
  // About up, north turns to west: R is +X north, +Y up, +Z east.
  *degrees = Mathematics(Opcode::kAtan2, -x_R.z, x_R.x);
  return {};
}

/// The numbers of a module are those of a counter, mixed with what makes its life another one.
float ModuleServices::Random() {
  // SplitMix64 (Steele, Lea and Flood 2014), whose output is even for counters too.
  const auto mix = [](uint64_t x) {
    x += 0x9e3779b97f4a7c15ULL;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
    return x ^ (x >> 31);
  };
  const uint64_t life =
      static_cast<uint64_t>(context_.config.module_id) << 32 | context_.config.incarnation;
  const uint64_t bits =
      mix(mix(mix(context_.config.random_seed) ^ life) ^ context_.state.random_count++);
  // The 24 highest bits are all that a float holds.
  return static_cast<float>(bits >> 40) * 0x1p-24f;
}

OpResult ModuleServices::Sleep(int64_t duration_us) {
  OpResult result;
  // A requirement cannot wait; the verifier does not let it try.
  if (running_ == nullptr) return result;
  result.wait = true;
  // No time at all still lets the other tasks run: the task goes on in the next tick.
  if (duration_us <= 0) {
    running_->wait = WaitKind::kNextTick;
    running_->wake_us = context_.state.tick;
  } else {
    running_->wait = WaitKind::kSleep;
    running_->wake_us = context_.state.sim_time_us + duration_us;
  }
  return result;
}

OpResult ModuleServices::Invoke(int role, int command_slot, const Cell* arguments, int count) {
  Fault fault;
  // The task goes on: an invocation that cannot be sent is reported, not waited for.
  if (!Issue(context_, role, command_slot, arguments, count, -1, &fault)) ReportHere(fault);
  return {};
}

OpResult ModuleServices::InvokeNear(uint32_t connector_mask, int role, int command_slot,
                                    const Cell* arguments, int count) {
  // One invocation for each module, once also where it is docked on several connectors.
  uint32_t left = connector_mask;
  for (int c = 0; c < context_.kinematics.num_connectors(); ++c) {
    if ((left >> c & 1u) == 0) continue;
    const ConnectorReading& sensor = context_.state.neighbours[c].sensor;
    for (int d = c; d < context_.kinematics.num_connectors(); ++d) {
      const ConnectorReading& other = context_.state.neighbours[d].sensor;
      if (other.docked && other.mate_module == sensor.mate_module) left &= ~(1u << d);
    }
    // A set may be older than the last undocking.
    if (!sensor.docked) continue;
    Fault fault;
    if (!Issue(context_, role, command_slot, arguments, count, sensor.mate_module, &fault)) {
      ReportHere(fault);
    }
  }
  return {};
}

OpResult ModuleServices::NeighbourField(uint32_t connector_mask, int role, int field, Cell* value) {
  const int modules = CountModules(connector_mask);
  if (modules != 1) {
    return Refuse({.code = FaultCode::kNotOneNeighbour, .measured = static_cast<float>(modules)});
  }
  // Shared fields are told in the order of their slots, which a subrole begins with.
  const RoleInfo info = context_.program.role(role);
  const int place = __builtin_popcount(info.shared_fields() & ((1u << field) - 1));
  int connector = -1;
  for (int c = 0; c < context_.kinematics.num_connectors(); ++c) {
    if ((connector_mask >> c & 1u) == 0) continue;
    connector = c;
    if (!HasTold(c, role)) continue;
    *value = context_.state.neighbours[c].shared[place];
    return {};
  }
  return Refuse({.code = FaultCode::kNothingShared, .connector = static_cast<int8_t>(connector)});
}

OpResult ModuleServices::Print(int text, const Cell* values, int count) {
  if (context_.output == nullptr) return {};
  StatusReport& status = context_.output->status;
  // A tick has room for a few lines; the others are counted, so that none is lost unseen.
  if (status.num_prints == kMaxPrintsPerTick) {
    if (status.prints_dropped < UINT16_MAX) ++status.prints_dropped;
    return {};
  }
  Fault here;
  SetPlaceOfCall(&here);
  PrintReport& print = status.prints[status.num_prints++];
  print.function = here.function;
  print.pc = here.pc;
  print.line = here.line;
  print.text = static_cast<uint16_t>(text);
  print.num_values = static_cast<uint8_t>(count);
  for (int i = 0; i < count; ++i) print.values[i] = values[i];
  return {};
}

}  // namespace morphbus::vm
