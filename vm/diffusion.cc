#include "vm/diffusion.h"

#include "vm/mates.h"
#include "vm/scheduler.h"

namespace morphbus::vm {

namespace {

bool IsFrom(const Invocation& invocation, const OriginRecord& origin) {
  return invocation.origin == origin.module && invocation.origin_incarnation == origin.incarnation;
}

/// First and one past the last of an origin's records are neighbours, since they are sorted.
int Place(const DiffusionState& d, uint16_t module, uint32_t incarnation) {
  int i = 0;
  while (i < d.num_origins &&
         (d.origins[i].module < module ||
          (d.origins[i].module == module && d.origins[i].incarnation < incarnation))) {
    ++i;
  }
  return i;
}

OriginRecord* Find(DiffusionState* d, uint16_t module, uint32_t incarnation) {
  const int i = Place(*d, module, incarnation);
  const bool found = i < d->num_origins && d->origins[i].module == module &&
                     d->origins[i].incarnation == incarnation;
  return found ? &d->origins[i] : nullptr;
}

bool IsKept(const DiffusionState& d, const OriginRecord& origin) {
  for (int i = 0; i < d.num_kept; ++i) {
    if (IsFrom(d.kept[i].invocation, origin)) return true;
  }
  return false;
}

/// Frees a record of an earlier life of some module; false if there is none.
bool ForgetOldLife(DiffusionState* d) {
  for (int i = 0; i + 1 < d->num_origins; ++i) {
    if (d->origins[i].module != d->origins[i + 1].module || IsKept(*d, d->origins[i])) continue;
    for (int k = i; k + 1 < d->num_origins; ++k) d->origins[k] = d->origins[k + 1];
    --d->num_origins;
    return true;
  }
  return false;
}

OriginRecord* Learn(Context& context, uint16_t module, uint32_t incarnation, uint32_t have) {
  DiffusionState& d = context.state.diffusion;
  if (d.num_origins == kMaxOrigins && !ForgetOldLife(&d)) {
    Report(context, FaultCode::kCapacity);
    return nullptr;
  }
  const int at = Place(d, module, incarnation);
  for (int i = d.num_origins; i > at; --i) d.origins[i] = d.origins[i - 1];
  ++d.num_origins;
  d.origins[at] = OriginRecord();
  d.origins[at].module = module;
  d.origins[at].incarnation = incarnation;
  d.origins[at].have = have;
  d.origins[at].learned_tick = context.state.tick;
  return &d.origins[at];
}

void DropKept(DiffusionState* d, int at) {
  for (int i = at; i + 1 < d->num_kept; ++i) d->kept[i] = d->kept[i + 1];
  --d->num_kept;
}

/// Runs it here if the role held is meant; under any other image, or without the role, it is only
/// passed on.
void Deliver(Context& context, const Invocation& invocation) {
  const VerifiedProgram& program = context.program;
  const int own = context.state.role.role;
  if (invocation.program_hash != program.hash() || own < 0) return;
  if (invocation.role >= program.num_roles() || !program.IsA(own, invocation.role)) return;
  if (invocation.command >= program.role(invocation.role).num_commands) return;
  QueueCommand(context, invocation.command, invocation.arguments, invocation.num_arguments);
}

void TakeAcks(Context& context, int c, const NeighbourMessage& message) {
  DiffusionState& d = context.state.diffusion;
  for (int a = 0; a < message.num_acks; ++a) {
    const InvocationAck& ack = message.acks[a];
    for (int i = 0; i < d.num_kept; ++i) {
      const Invocation& kept = d.kept[i].invocation;
      if (kept.origin == ack.origin && kept.origin_incarnation == ack.origin_incarnation &&
          kept.id <= ack.id) {
        d.kept[i].acked_connectors |= 1u << c;
      }
    }
  }
}

/// Of an origin that nobody has told us of before, we begin with the oldest that any mate keeps.
void LearnOrigins(Context& context, const NeighbourMessage& message) {
  for (int a = 0; a < message.num_acks; ++a) {
    const InvocationAck& ack = message.acks[a];
    const bool own = ack.origin == context.config.module_id &&
                     ack.origin_incarnation == context.config.incarnation;
    if (own || ack.floor == 0 || ack.floor > ack.id + 1) continue;
    OriginRecord* origin = Find(&context.state.diffusion, ack.origin, ack.origin_incarnation);
    if (origin == nullptr) {
      Learn(context, ack.origin, ack.origin_incarnation, ack.floor - 1);
    } else if (origin->learned_tick == context.state.tick && ack.floor - 1 < origin->have) {
      origin->have = ack.floor - 1;
    }
  }
}

/// Where mates keep only later ones than we lack, the row is broken (we were cut off while those
/// passed); after kSilentTicks nobody will bring them any more, and we go on behind the gap.
void MendGaps(Context& context, const Mail& mail) {
  DiffusionState& d = context.state.diffusion;
  for (int i = 0; i < d.num_origins; ++i) {
    OriginRecord& origin = d.origins[i];
    uint32_t lowest = 0;  // Lowest id beyond a gap that a mate offers.
    for (int c = 0; c < context.kinematics.num_connectors(); ++c) {
      const NeighbourMessage* message = mail.from[c];
      if (message == nullptr) continue;
      for (int a = 0; a < message->num_acks; ++a) {
        const InvocationAck& ack = message->acks[a];
        if (ack.origin != origin.module || ack.origin_incarnation != origin.incarnation) continue;
        if (ack.id <= origin.have || ack.floor <= origin.have + 1) continue;
        if (lowest == 0 || ack.floor < lowest) lowest = ack.floor;
      }
    }
    if (lowest == 0) continue;
    if (origin.gap_since_tick < 0) origin.gap_since_tick = context.state.tick;
    if (context.state.tick - origin.gap_since_tick <= kSilentTicks) continue;
    origin.have = lowest - 1;
    origin.gap_since_tick = -1;
  }
}

void TakeInvocations(Context& context, int c, const NeighbourMessage& message) {
  DiffusionState& d = context.state.diffusion;
  for (int i = 0; i < message.num_invocations; ++i) {
    const Invocation& invocation = message.invocations[i];
    OriginRecord* origin = Find(&d, invocation.origin, invocation.origin_incarnation);
    if (origin == nullptr || invocation.id != origin->have + 1) continue;
    if (invocation.num_arguments > kMaxArguments) continue;
    // Without room it is not acknowledged, and comes again.
    if (d.num_kept == kMaxInvocations) continue;
    origin->have = invocation.id;
    origin->gap_since_tick = -1;
    KeptInvocation& kept = d.kept[d.num_kept++];
    kept.invocation = invocation;
    kept.acked_connectors = 1u << c;
    Deliver(context, invocation);
  }
}

/// Two modules whose stores are full of what the other cannot take would wait for ever: after a
/// while the oldest goes, and the loss is told.
void RelieveJam(Context& context) {
  DiffusionState& d = context.state.diffusion;
  if (d.num_kept < kMaxInvocations) {
    d.full_since_tick = -1;
    return;
  }
  if (d.full_since_tick < 0) d.full_since_tick = context.state.tick;
  if (context.state.tick - d.full_since_tick <= kSilentTicks) return;
  d.full_since_tick = -1;
  DropKept(&d, 0);
  Report(context, FaultCode::kQueueOverflow);
}

}  // namespace

void ReceiveInvocations(Context& context, const Mail& mail) {
  for (int c = 0; c < context.kinematics.num_connectors(); ++c) {
    if (mail.from[c] != nullptr) TakeAcks(context, c, *mail.from[c]);
  }
  // First make room, then take more.
  DropAcknowledged(context);
  for (int c = 0; c < context.kinematics.num_connectors(); ++c) {
    if (mail.from[c] != nullptr) LearnOrigins(context, *mail.from[c]);
  }
  MendGaps(context, mail);
  for (int c = 0; c < context.kinematics.num_connectors(); ++c) {
    if (mail.from[c] != nullptr) TakeInvocations(context, c, *mail.from[c]);
  }
  RelieveJam(context);
}

FaultCode Issue(Context& context, int role, int command, const Cell* arguments, int count) {
  DiffusionState& d = context.state.diffusion;
  if (count < 0 || count > kMaxArguments) return FaultCode::kCapacity;
  // Half of the store stays free for what others send.
  if (d.num_kept >= kMaxInvocations / 2) return FaultCode::kQueueOverflow;
  const uint16_t self = context.config.module_id;
  OriginRecord* origin = Find(&d, self, context.config.incarnation);
  if (origin == nullptr) origin = Learn(context, self, context.config.incarnation, 0);
  if (origin == nullptr) return FaultCode::kCapacity;
  KeptInvocation& kept = d.kept[d.num_kept++];
  kept = KeptInvocation();
  Invocation& invocation = kept.invocation;
  invocation.origin = self;
  invocation.origin_incarnation = context.config.incarnation;
  invocation.id = origin->have = d.own_id = d.own_id + 1;
  invocation.program_hash = context.program.hash();
  invocation.role = static_cast<uint16_t>(role);
  invocation.command = static_cast<uint8_t>(command);
  invocation.num_arguments = static_cast<uint8_t>(count);
  for (int i = 0; i < count; ++i) invocation.arguments[i] = arguments[i];
  Deliver(context, invocation);
  return FaultCode::kNone;
}

void IssueRequests(Context& context, const TickInput& input) {
  const VerifiedProgram& program = context.program;
  for (int i = 0; i < input.num_requests && i < kMaxRequests; ++i) {
    const InvokeRequest& request = input.requests[i];
    Fault fault;
    fault.code = FaultCode::kBadState;
    const bool known = request.program_hash == program.hash() &&
                       request.role < program.num_roles() &&
                       request.command < program.role(request.role).num_commands;
    if (known) {
      fault.function =
          static_cast<int16_t>(program.role(request.role).commands[request.command].function);
      if (program.AcceptsArguments(fault.function, request.arguments, request.num_arguments)) {
        fault.code =
            Issue(context, request.role, request.command, request.arguments, request.num_arguments);
      }
    }
    if (fault.code != FaultCode::kNone) Report(context, fault);
  }
}

void ForgetAcks(Context& context, int connector) {
  DiffusionState& d = context.state.diffusion;
  for (int i = 0; i < d.num_kept; ++i) d.kept[i].acked_connectors &= ~(1u << connector);
}

void DropAcknowledged(Context& context) {
  DiffusionState& d = context.state.diffusion;
  const uint32_t present = PresentMates(context);
  for (int i = d.num_kept - 1; i >= 0; --i) {
    if ((present & ~d.kept[i].acked_connectors) == 0) DropKept(&d, i);
  }
}

int FillInvocations(Context& context, NeighbourMessage* message) {
  DiffusionState& d = context.state.diffusion;
  message->num_acks = 0;
  message->num_invocations = 0;
  const auto add_ack = [&](const OriginRecord& origin) {
    InvocationAck& ack = message->acks[message->num_acks++];
    ack.origin = origin.module;
    ack.origin_incarnation = origin.incarnation;
    ack.id = origin.have;
    ack.floor = origin.have + 1;
    for (int i = d.num_kept - 1; i >= 0; --i) {
      if (IsFrom(d.kept[i].invocation, origin)) ack.floor = d.kept[i].invocation.id;
    }
  };
  // Origins with something under way first; the others fill up in turn.
  uint64_t told = 0;
  for (int i = 0; i < d.num_origins && message->num_acks < kMaxMessageAcks; ++i) {
    if (!IsKept(d, d.origins[i])) continue;
    add_ack(d.origins[i]);
    told |= uint64_t{1} << i;
  }
  for (int k = 0; k < d.num_origins && message->num_acks < kMaxMessageAcks; ++k) {
    const int i = (d.next_ack + k) % d.num_origins;
    if ((told >> i & 1u) != 0) continue;
    add_ack(d.origins[i]);
  }
  if (d.num_origins > 0) {
    d.next_ack = static_cast<uint8_t>((d.next_ack + 1) % d.num_origins);
  }
  // Oldest first, so that of each origin the lowest id that somebody lacks comes before later ones.
  for (int i = 0; i < d.num_kept && message->num_invocations < kMaxMessageInvocations; ++i) {
    message->invocations[message->num_invocations++] = d.kept[i].invocation;
  }
  return message->num_acks * kAckWireBytes + message->num_invocations * kInvocationWireBytes;
}

}  // namespace morphbus::vm
