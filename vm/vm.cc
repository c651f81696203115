#include "vm/vm.h"

#include <new>

#include "vm/role/module_services.h"
#include "vm/role/motion.h"
#include "vm/role/roles.h"
#include "vm/role/scheduler.h"
#include "vm/run/context.h"
#include "vm/space/bodies.h"
#include "vm/space/neighbours.h"
#include "vm/space/spatial.h"
#include "vm/spread/diffusion.h"

namespace morphbus::vm {

Vm::Vm(const VmConfig& config, const VerifiedKinematics& kinematics, const VerifiedProgram& program,
       VmState* state, Start start)
    : config_(config), kinematics_(kinematics), program_(&program), state_(*state) {
  // In place: the state is too large for the stack of a microcontroller.
  if (start == Start::kCold) new (state) VmState();
}

void Vm::Tick(const TickInput& input, TickOutput* output) {
  // Outputs are written from scratch, so that they depend on state and input alone.
  new (output) TickOutput();
  Context context{config_, kinematics_, *program_, state_, output, observer_, &input};
  ModuleServices services(&context);
  // Before the first tick no time has passed.
  const int64_t dt_us = state_.started ? input.sim_time_us - state_.sim_time_us : 0;
  const int64_t ticks = state_.started ? input.tick - state_.tick : 0;
  // A gap of over half an hour tells nothing of the period; shorter ones need no division of 64
  // bits.
  if (ticks > 0 && dt_us > 0 && ticks <= INT32_MAX && dt_us <= INT32_MAX) {
    state_.period_us = static_cast<int32_t>(dt_us) / static_cast<int32_t>(ticks);
  }
  state_.tick = input.tick;
  state_.sim_time_us = input.sim_time_us;

  // What the module senses and hears.
  Inbox inbox;
  UpdateNeighbours(context, input, &inbox);
  ReadNeighbourMessages(context, inbox);
  UpdateSpatial(context, input, inbox);
  UpdateBodies(context, inbox);
  UpdateJoints(context, input, dt_us > 0 ? dt_us : 0);
  for (int i = 0; i < kMaxSensorValues; ++i) state_.sensor_values[i] = input.sensor_values[i];
  state_.started = true;

  // What it makes of that, and does.
  UpdateRole(context, services);
  ReceiveInvocations(context, inbox);
  IssueRequests(context, input);
  RunTasks(context, services);
  RememberKept(context);

  // What others are told of it: actuators, neighbours, people.
  FillCommands(context, output);
  FillMessage(context, &output->message);
  FillStatus(context, &output->status);
}

void Vm::FillMessage(Context& context, NeighbourMessage* message) {
  // Who speaks, and what it runs and plays.
  message->sender = config_.module_id;
  message->incarnation = config_.incarnation;
  message->tick = state_.tick;
  message->program_hash = program_->hash();
  message->role = state_.role.role;
  FillShared(message);
  // Poses and dockings always fit; invocations come before bodies, which can be told in turns.
  FillPose(context, message);
  FillDocked(context, message);
  DropAcknowledged(context);
  const int used = FillInvocations(context, message);
  FillBodies(context, (kMessageTailBytes - used) / kBodyEntryWireBytes, message);
}

void Vm::FillShared(NeighbourMessage* message) {
  // Shared fields are told in the order of their slots, by which neighbours know them.
  message->num_shared = 0;
  if (state_.role.role < 0) return;
  const RoleInfo role = program_->role(state_.role.role);
  for (int i = 0; i < role.num_fields; ++i) {
    if (!role.fields.shared(i)) continue;
    message->shared[message->num_shared++] = state_.role.fields[i];
  }
}

void Vm::FillTraces(StatusReport* status) const {
  if (kMaxTracedFields == 0 || state_.role.role < 0) return;
  const RoleInfo role = program_->role(state_.role.role);
  for (int i = 0; i < role.num_fields; ++i) {
    if (!role.fields.traced(i)) continue;
    status->traces[status->num_traces++] = {static_cast<uint8_t>(i), state_.role.fields[i]};
  }
}

void Vm::FillStatus(Context& context, StatusReport* status) {
  status->role = state_.role.role;
  status->frozen = state_.role.frozen;
  status->has_pose = state_.pose.has;
  status->pose_stale = state_.pose.stale;
  // A module without a role has no labels.
  status->num_labels =
      state_.role.role < 0 ? uint8_t{0} : program_->role(state_.role.role).num_labels;
  for (int i = 0; i < kMaxLabels; ++i) status->labels[i] = state_.role.labels[i];
  for (int j = 0; j < kMaxJoints; ++j) status->signs[j] = state_.joints[j].sign;
  FillTasks(context, status);
  FillTraces(status);
  // The digest of what people watch tells whether this tick is worth a STATUS. Tasks are no part of
  // it: they move on in nearly every tick.
  Digest digest;
  digest.Add(program_->hash(), status->role, status->frozen, status->has_pose, status->pose_stale);
  for (const int8_t label : status->labels) digest.Add(label);
  for (const int8_t sign : status->signs) digest.Add(sign);
  status->changed = digest.value() != state_.reported || status->num_faults > 0 ||
                    status->faults_dropped > 0 || status->num_prints > 0 || status->num_traces > 0;
  state_.reported = digest.value();
}

void Vm::ReplaceProgram(const VerifiedProgram& program) {
  Context context{config_, kinematics_, *program_, state_, nullptr};
  // What is no program's stays: the place, the neighbours, where joints are.
  CarryOver(context, program);
  program_ = &program;
}

bool Vm::RootTick(int64_t tick, int64_t* root_tick) const {
  return morphbus::vm::RootTick(state_, tick, root_tick);
}

RoleCheck Vm::CheckRole(int role) {
  Context context{config_, kinematics_, *program_, state_, nullptr};
  ModuleServices services(&context);
  return morphbus::vm::CheckRole(context, services, role, false);
}

Evaluation Vm::EvaluateAs(int role, int function) {
  Context context{config_, kinematics_, *program_, state_, nullptr};
  ModuleServices services(&context);
  return morphbus::vm::EvaluateAs(context, services, role, function);
}

}  // namespace morphbus::vm
