#include "vm/mates.h"

#include <cmath>
#include <initializer_list>

#include "vm/diffusion.h"
#include "vm/scheduler.h"

namespace morphbus::vm {

namespace {

bool IsSame(const MateRecord& mate, const ConnectorReading& reading) {
  if (!mate.docked || !reading.docked) return mate.docked == reading.docked;
  return mate.module == reading.mate_module && mate.mate_connector == reading.mate_connector &&
         mate.connection_type == reading.connection_type && mate.number == reading.number &&
         mate.is_member_b == reading.is_member_b;
}

MateRecord NewMate(const Context& context, int connector, const ConnectorReading& reading) {
  MateRecord mate;
  if (!reading.docked) return mate;
  mate.docked = true;
  mate.module = reading.mate_module;
  mate.mate_connector = reading.mate_connector;
  mate.connection_type = reading.connection_type;
  mate.number = reading.number;
  mate.is_member_b = reading.is_member_b;
  mate.heard_tick = context.state.tick;
  // A sensor that cannot say that the number is the mate's is believed if it fits no other way.
  KinConnection connection;
  for (const bool is_member_b : {reading.is_member_b, true}) {
    mate.known = context.kinematics.Find(reading.connection_type, reading.number, is_member_b,
                                         connector, &connection) &&
                 connection.mate_connector == reading.mate_connector;
    if (mate.known) break;
  }
  // At joint values 0 the links' frames are the module frames, so X_MN is also X_LK.
  if (mate.known) mate.X_LK = connection.X_MN;
  return mate;
}

bool IsUsable(const Context& context, const MateRecord& mate, const NeighbourMessage& message) {
  if (message.sender != mate.module || message.incarnation < mate.incarnation) return false;
  if (message.tick > context.state.tick + kMaxTickAhead) return false;
  if (message.num_links > kMaxLinks || message.num_docked > kMaxNeighbours ||
      message.num_body_entries > kMaxMessageBodyEntries ||
      message.num_invocations > kMaxMessageInvocations || message.num_acks > kMaxMessageAcks) {
    return false;
  }
  return message.incarnation > mate.incarnation || message.tick > mate.message_tick;
}

/// The mate's place (mean of its links' origins) in the frame of our docked link. Taken from the
/// mate's own poses relative to each other, so it does not matter how old they are in R.
void ReadPlace(const NeighbourMessage& message, const DockedLink& docked, MateRecord* mate) {
  mate->has_place = false;
  if (!message.has_pose || !mate->known || docked.link >= message.num_links) return;
  Vec3 sum;
  for (int i = 0; i < message.num_links; ++i) sum = Add(sum, message.X_RL[i].p);
  const float n = message.num_links;
  const Vec3 mean_R{sum.x / n, sum.y / n, sum.z / n};
  const PoseF X_KR = Inverse(message.X_RL[docked.link]);
  const Vec3 place_K = Add(X_KR.p, Rotate(X_KR.q, mean_R));
  mate->place_L = Add(mate->X_LK.p, Rotate(mate->X_LK.q, place_K));
  mate->has_place = std::isfinite(Norm(mate->place_L));
}

}  // namespace

void UpdateMates(Context& context, const TickInput& input, Mail* mail) {
  VmState& state = context.state;
  int num_docked = 0;
  for (int c = 0; c < context.kinematics.num_connectors(); ++c) {
    MateRecord& mate = state.mates[c];
    const ConnectorReading& reading = input.connectors[c];
    num_docked += reading.docked ? 1 : 0;
    if (!IsSame(mate, reading)) {
      if (state.started && mate.docked) RaiseEvent(context, Event::kDisconnect, c);
      if (state.started && reading.docked) RaiseEvent(context, Event::kConnect, c);
      mate = NewMate(context, c, reading);
      ForgetAcks(context, c);
    }
    const NeighbourMessage* message = input.messages[c];
    if (!mate.docked || message == nullptr || !IsUsable(context, mate, *message)) continue;
    if (message->incarnation != mate.incarnation) ForgetAcks(context, c);
    mate.incarnation = message->incarnation;
    mate.message_tick = message->tick;
    mate.heard_tick = state.tick;
    mail->from[c] = message;
  }
  if (num_docked > kMaxNeighbours && !state.neighbours_told) {
    Report(context, FaultCode::kCapacity);
  }
  state.neighbours_told = num_docked > kMaxNeighbours;
}

void ReadMates(Context& context, const Mail& mail) {
  for (int c = 0; c < context.kinematics.num_connectors(); ++c) {
    MateRecord& mate = context.state.mates[c];
    if (!mate.docked) continue;
    if (context.state.tick - mate.heard_tick > kSilentTicks) {
      mate.has_place = false;
      mate.role = -1;
    }
    const NeighbourMessage* message = mail.from[c];
    if (message == nullptr) continue;
    const bool same_program = message->program_hash == context.program.hash();
    mate.role =
        same_program && message->role < context.program.num_roles() ? message->role : int16_t{-1};
    const DockedLink* docked = DockedHere(context, *message, mate);
    mate.linked = docked != nullptr;
    if (docked == nullptr) {
      mate.has_place = false;
      continue;
    }
    mate.mate_body_link = docked->body_link;
    ReadPlace(*message, *docked, &mate);
  }
}

const DockedLink* DockedHere(const Context& context, const NeighbourMessage& message,
                             const MateRecord& mate) {
  for (int i = 0; i < message.num_docked; ++i) {
    const DockedLink& docked = message.docked[i];
    if (docked.connector == mate.mate_connector && docked.mate_module == context.config.module_id) {
      return &docked;
    }
  }
  return nullptr;
}

void FillDocked(Context& context, NeighbourMessage* message) {
  message->num_docked = 0;
  for (int c = 0; c < context.kinematics.num_connectors(); ++c) {
    if (!context.state.mates[c].docked || message->num_docked == kMaxNeighbours) continue;
    DockedLink& docked = message->docked[message->num_docked++];
    docked.connector = static_cast<uint8_t>(c);
    docked.link = context.kinematics.connector(c).link;
    docked.body_link = static_cast<uint8_t>(context.kinematics.BodyLink(docked.link));
    docked.mate_module = context.state.mates[c].module;
  }
}

uint32_t PresentMates(const Context& context) {
  uint32_t mask = 0;
  for (int c = 0; c < context.kinematics.num_connectors(); ++c) {
    const MateRecord& mate = context.state.mates[c];
    if (mate.docked && context.state.tick - mate.heard_tick <= kSilentTicks) mask |= 1u << c;
  }
  return mask;
}

}  // namespace morphbus::vm
