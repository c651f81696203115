#include "vm/vm.h"

#include <new>

#include "vm/bodies.h"
#include "vm/context.h"
#include "vm/diffusion.h"
#include "vm/host.h"
#include "vm/mates.h"
#include "vm/motion.h"
#include "vm/roles.h"
#include "vm/scheduler.h"
#include "vm/spatial.h"

namespace morphbus::vm {

Vm::Vm(const VmConfig& config, const VerifiedKinematics& kinematics, const VerifiedProgram& program,
       VmState* state, Start start)
    : config_(config), kinematics_(kinematics), program_(&program), state_(*state) {
  // In place: the state is too large for the stack of a microcontroller.
  if (start == Start::kCold) new (state) VmState();
}

void Vm::Tick(const TickInput& input, TickOutput* output) {
  new (output) TickOutput();
  Context context{config_, kinematics_, *program_, state_, output};
  Host host(&context);
  const int64_t dt_us = state_.started ? input.sim_time_us - state_.sim_time_us : 0;
  state_.tick = input.tick;
  state_.sim_time_us = input.sim_time_us;

  // What the module senses and hears.
  Mail mail;
  UpdateMates(context, input, &mail);
  ReadMates(context, mail);
  UpdateSpatial(context, input, mail);
  UpdateBodies(context, mail);
  UpdateJoints(context, input, dt_us > 0 ? dt_us : 0);
  state_.started = true;

  // What it makes of that, and does.
  UpdateRole(context, host);
  ReceiveInvocations(context, mail);
  IssueRequests(context, input);
  RunTasks(context, host);

  FillCommands(context, output);
  FillMessage(context, &output->message);
  FillStatus(context, &output->status);
}

void Vm::FillMessage(Context& context, NeighbourMessage* message) {
  message->sender = config_.module_id;
  message->incarnation = config_.incarnation;
  message->tick = state_.tick;
  message->program_hash = program_->hash();
  message->role = state_.role.role;
  FillPose(context, message);
  FillDocked(context, message);
  DropAcknowledged(context);
  const int used = FillInvocations(context, message);
  FillBodies(context, (kMessageTailBytes - used) / kBodyEntryWireBytes, message);
}

void Vm::FillStatus(Context& context, StatusReport* status) {
  status->role = state_.role.role;
  status->frozen = state_.role.frozen;
  status->has_pose = state_.pose.has;
  status->pose_stale = state_.pose.stale;
  status->num_labels =
      state_.role.role < 0 ? uint8_t{0} : program_->role(state_.role.role).num_labels;
  for (int i = 0; i < kMaxLabels; ++i) status->labels[i] = state_.role.labels[i];
  for (int j = 0; j < kMaxJoints; ++j) status->signs[j] = state_.joints[j].sign;
  FillTasks(context, status);
  Digest digest;
  digest.Add(int{status->role});
  digest.Add(status->frozen);
  digest.Add(status->has_pose);
  digest.Add(status->pose_stale);
  for (const int8_t label : status->labels) digest.Add(int{label});
  for (const int8_t sign : status->signs) digest.Add(int{sign});
  status->changed =
      digest.value() != state_.reported || status->num_faults > 0 || status->faults_dropped > 0;
  state_.reported = digest.value();
}

void Vm::ReplaceProgram(const VerifiedProgram& program) {
  Context context{config_, kinematics_, *program_, state_, nullptr};
  LeaveRole(context);
  program_ = &program;
  state_.role = RoleState();
  for (int8_t& label : state_.role.labels) label = -1;
  state_.role.structure_since_tick = state_.role.roles_since_tick = state_.tick;
  // Roles are indices into the table of the program that is gone.
  for (MateRecord& mate : state_.mates) mate.role = -1;
}

RoleCheck Vm::CheckRole(int role) {
  Context context{config_, kinematics_, *program_, state_, nullptr};
  Host host(&context);
  return morphbus::vm::CheckRole(context, host, role, false);
}

}  // namespace morphbus::vm
