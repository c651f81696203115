#include "vm/space/neighbours.h"

#include <initializer_list>

#include "vm/run/task_queue.h"

namespace morphbus::vm {

namespace {

/// What is known of a neighbour before it is heard: what the sensor says, and the transform of that
/// connection.
NeighbourRecord NewNeighbour(const Context& context, int connector,
                             const ConnectorReading& reading) {
  NeighbourRecord neighbour;
  if (!reading.docked) return neighbour;
  neighbour.sensor = reading;
  neighbour.heard_tick = context.state.tick;
  // A sensor that cannot say that the number is the neighbour's is believed if it fits no other
  // way.
  KinConnection connection;
  for (const bool is_member_b : {reading.is_member_b, true}) {
    neighbour.known = context.kinematics.Find(reading.connection_type, reading.number, is_member_b,
                                              connector, &connection) &&
                      connection.mate_connector == reading.mate_connector;
    if (neighbour.known) break;
  }
  // At joint values 0 the links' frames are the module frames, so X_MN is also X_LK.
  if (neighbour.known) neighbour.X_LK = connection.X_MN;
  return neighbour;
}

/// True if a message is from this neighbour, newer than the last one, not from an earlier life of
/// it, and within the capacities.
bool IsUsable(const Context& context, const NeighbourRecord& neighbour,
              const NeighbourMessage& message) {
  if (message.sender != neighbour.sensor.mate_module || message.incarnation < neighbour.incarnation)
    return false;
  if (message.tick > context.state.tick + kMaxTickAhead) return false;
  if (message.num_links > kMaxLinks || message.num_docked > kMaxNeighbours ||
      message.num_body_entries > kMaxMessageBodyEntries ||
      message.num_invocations > kMaxMessageInvocations || message.num_acks > kMaxMessageAcks ||
      message.num_shared > kMaxSharedFields) {
    return false;
  }
  return message.incarnation > neighbour.incarnation || message.tick > neighbour.message_tick;
}

/// The neighbour's role in our program; -1 if it says none. Roles are numbers of one program; what
/// was said under the one before counts for a while by the roles' names.
int16_t RoleIn(const Context& context, const NeighbourMessage& message) {
  const VerifiedProgram& program = context.program;
  if (message.role < 0) return -1;
  if (MeansTheSame(context, message.program_hash)) {
    return message.role < program.num_roles() ? message.role : int16_t{-1};
  }
  const ProgramSwitch& last = context.state.program_switch;
  const bool before = last.previous_hash != 0 && message.program_hash == last.previous_hash &&
                      message.role < kMaxRoles && context.state.tick - last.tick <= kSilentTicks;
  return before ? last.renamed[message.role] : int16_t{-1};
}

/// The neighbour's place (mean of its links' origins) in the frame of our docked link. Taken from
/// the neighbour's own poses relative to each other, so it does not matter how old they are in R.
void ReadPlace(const NeighbourMessage& message, const DockedLink& docked,
               NeighbourRecord* neighbour) {
  neighbour->has_place = false;
  if (!message.has_pose || !neighbour->known || docked.link >= message.num_links) return;
  // Its place in R by its own poses, taken into the frame K of its docked link and from there to
  // ours, L.
  const Vec3 mean_R = MeanOrigin(message.X_RL, message.num_links);
  const PoseF X_KR = Inverse(message.X_RL[docked.link]);
  const Vec3 place_K = Add(X_KR.p, Rotate(X_KR.q, mean_R));
  neighbour->place_L = Add(neighbour->X_LK.p, Rotate(neighbour->X_LK.q, place_K));
  neighbour->has_place = IsFinite(Norm(neighbour->place_L));
}

/// The neighbour's role. One that has just begun anew takes none before its surroundings have
/// settled, which says nothing about what it is: until it takes one, what it played before counts,
/// kSilentTicks long at most.
void ReadRole(const Context& context, const NeighbourMessage& message, NeighbourRecord* neighbour) {
  const int16_t role = RoleIn(context, message);
  const bool begins =
      neighbour->anew_tick >= 0 && context.state.tick - neighbour->anew_tick <= kSilentTicks;
  if (role < 0 && begins) return;
  neighbour->role = role;
  neighbour->anew_tick = -1;
}

/// The neighbour's shared fields. Where its role counts though it says none under our program,
/// since it goes over to it or begins anew, what is known of them counts as well.
void ReadShared(const Context& context, const NeighbourMessage& message,
                NeighbourRecord* neighbour) {
  const VerifiedProgram& program = context.program;
  const bool says = MeansTheSame(context, message.program_hash) && message.role >= 0 &&
                    message.role < program.num_roles();
  if (says || neighbour->role < 0) neighbour->shared_role = -1;
  if (!says) return;
  const RoleInfo role = program.role(message.role);
  // As many values as the role has shared fields, or the message is of another layout.
  if (message.num_shared != __builtin_popcount(role.shared_fields())) return;
  // Messages may say anything; what is no value of its type is not believed.
  int told = 0;
  for (int i = 0; i < role.num_fields; ++i) {
    if (!role.fields.shared(i)) continue;
    neighbour->shared[told] = message.shared[told];
    if (!IsValueOf(role.fields.type(i), message.shared[told], program.num_roles())) return;
    ++told;
  }
  neighbour->shared_role = message.role;
}

}  // namespace

void UpdateNeighbours(Context& context, const TickInput& input, Inbox* inbox) {
  VmState& state = context.state;
  int num_docked = 0;
  for (int c = 0; c < context.kinematics.num_connectors(); ++c) {
    NeighbourRecord& neighbour = state.neighbours[c];
    const ConnectorReading& reading = input.connectors[c];
    num_docked += reading.docked ? 1 : 0;
    // Another neighbour, or none: what was known of the last one goes.
    const bool docked = neighbour.sensor.docked;
    if (docked != reading.docked || (docked && neighbour.sensor != reading)) {
      if (state.started && docked) RaiseEvent(context, Event::kDisconnect, c);
      if (state.started && reading.docked) RaiseEvent(context, Event::kConnect, c);
      neighbour = NewNeighbour(context, c, reading);
      inbox->changed |= 1u << c;
    }
    // A message counts only if the sensor agrees about which module is docked.
    const NeighbourMessage* message = input.messages[c];
    if (!neighbour.sensor.docked || message == nullptr || !IsUsable(context, neighbour, *message))
      continue;
    if (message->incarnation != neighbour.incarnation) {
      inbox->changed |= 1u << c;
      neighbour.anew_tick = neighbour.incarnation == 0 ? int64_t{-1} : state.tick;
    }
    neighbour.incarnation = message->incarnation;
    neighbour.message_tick = message->tick;
    neighbour.heard_tick = state.tick;
    inbox->from[c] = message;
  }
  // Beyond the capacity the others are not told of; the fault is reported once.
  if (num_docked > kMaxNeighbours && !state.neighbours_told) {
    Report(context, {.code = FaultCode::kTooManyNeighbours,
                     .measured = static_cast<float>(num_docked),
                     .limit = kMaxNeighbours});
  }
  state.neighbours_told = num_docked > kMaxNeighbours;
}

void ReadNeighbourMessages(Context& context, const Inbox& inbox) {
  for (int c = 0; c < context.kinematics.num_connectors(); ++c) {
    NeighbourRecord& neighbour = context.state.neighbours[c];
    if (!neighbour.sensor.docked) continue;
    // Of one that is silent for long neither place nor role is believed any more.
    if (context.state.tick - neighbour.heard_tick > kSilentTicks) {
      neighbour.has_place = false;
      neighbour.role = -1;
      neighbour.shared_role = -1;
    }
    const NeighbourMessage* message = inbox.from[c];
    if (message == nullptr) continue;
    ReadRole(context, *message, &neighbour);
    ReadShared(context, *message, &neighbour);
    const DockedLink* docked = DockedHere(context, *message, neighbour);
    // Until it says which of its links is docked here, the body and the place are unknown.
    neighbour.linked = docked != nullptr;
    if (docked == nullptr) {
      neighbour.has_place = false;
      continue;
    }
    neighbour.neighbour_body_link = docked->body_link;
    ReadPlace(*message, *docked, &neighbour);
  }
}

const DockedLink* DockedHere(const Context& context, const NeighbourMessage& message,
                             const NeighbourRecord& neighbour) {
  for (int i = 0; i < message.num_docked; ++i) {
    const DockedLink& docked = message.docked[i];
    if (docked.connector == neighbour.sensor.mate_connector &&
        docked.mate_module == context.config.module_id) {
      return &docked;
    }
  }
  return nullptr;
}

void FillDocked(Context& context, NeighbourMessage* message) {
  message->num_docked = 0;
  for (int c = 0; c < context.kinematics.num_connectors(); ++c) {
    const ConnectorReading& sensor = context.state.neighbours[c].sensor;
    if (!sensor.docked || message->num_docked == kMaxNeighbours) continue;
    DockedLink& docked = message->docked[message->num_docked++];
    docked.connector = static_cast<uint8_t>(c);
    docked.link = context.kinematics.connector(c).link;
    docked.body_link = static_cast<uint8_t>(context.kinematics.BodyLink(docked.link));
    docked.mate_module = sensor.mate_module;
  }
}

uint32_t PresentNeighbours(const Context& context) {
  uint32_t mask = 0;
  for (int c = 0; c < context.kinematics.num_connectors(); ++c) {
    const NeighbourRecord& neighbour = context.state.neighbours[c];
    if (neighbour.sensor.docked && context.state.tick - neighbour.heard_tick <= kSilentTicks)
      mask |= 1u << c;
  }
  return mask;
}

}  // namespace morphbus::vm
