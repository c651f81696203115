#include "vm/spread/diffusion.h"

#include "vm/run/task_queue.h"
#include "vm/space/neighbours.h"

namespace morphbus::vm {

namespace {

/// True if the invocation is one of this origin's, in this incarnation.
bool IsFrom(const Invocation& invocation, const OriginRecord& origin) {
  return invocation.origin == origin.module && invocation.origin_incarnation == origin.incarnation;
}

/// Where the record of an origin is, or where it belongs: records are sorted by module and
/// incarnation, so that those of all lives of one module stand side by side.
int Place(const DiffusionState& d, uint16_t module, uint32_t incarnation) {
  int i = 0;
  while (i < d.num_origins &&
         (d.origins[i].module < module ||
          (d.origins[i].module == module && d.origins[i].incarnation < incarnation))) {
    ++i;
  }
  return i;
}

/// The record of an origin; nullptr if it was not heard of.
OriginRecord* Find(DiffusionState* d, uint16_t module, uint32_t incarnation) {
  const int i = Place(*d, module, incarnation);
  const bool found = i < d->num_origins && d->origins[i].module == module &&
                     d->origins[i].incarnation == incarnation;
  return found ? &d->origins[i] : nullptr;
}

/// True while an invocation of this origin is under way here.
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

/// A record for an origin not heard of before; nullptr if there is no room for one.
OriginRecord* Learn(Context& context, uint16_t module, uint32_t incarnation, uint32_t have) {
  DiffusionState& d = context.state.diffusion;
  if (d.num_origins == kMaxOrigins && !ForgetOldLife(&d)) return nullptr;
  // Records stay sorted, so that all modules tell of origins in the same order.
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

/// Takes one invocation out; the order of the others stays.
void DropKept(DiffusionState* d, int at) {
  for (int i = at; i + 1 < d->num_kept; ++i) d->kept[i] = d->kept[i + 1];
  --d->num_kept;
}

/// The function of a role's command; -1 if there is no such command.
int16_t CommandFunction(const VerifiedProgram& program, int role, int command) {
  if (role >= program.num_roles() || command >= program.role(role).num_commands) return -1;
  return static_cast<int16_t>(program.role(role).commands[command]);
}

/// Runs it here if the role held is meant; under any other image, or without the role, it is only
/// passed on.
void Deliver(Context& context, const Invocation& invocation) {
  // Roles and commands are numbers of one program; under another they mean nothing.
  const VerifiedProgram& program = context.program;
  const int own = context.state.role.role;
  if (!MeansTheSame(context, invocation.program_hash) || own < 0) return;
  // One that is for another module is only passed on.
  if (invocation.target >= 0 && invocation.target != context.config.module_id) return;
  if (invocation.role >= program.num_roles() || !program.IsA(own, invocation.role)) return;
  if (invocation.command >= program.role(invocation.role).num_commands) return;
  QueueCommand(context, invocation.command, invocation.arguments, invocation.num_arguments);
}

/// Notes on which connectors the neighbour has said that it has what is kept here.
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

/// Of an origin that no neighbour has told us of before, we begin with the oldest that any
/// neighbour keeps.
void LearnOrigins(Context& context, const NeighbourMessage& message) {
  for (int a = 0; a < message.num_acks; ++a) {
    const InvocationAck& ack = message.acks[a];
    // Of our own invocations we know more; and a floor beyond the next id is nonsense.
    const bool own = ack.origin == context.config.module_id &&
                     ack.origin_incarnation == context.config.incarnation;
    if (own || ack.floor == 0 || ack.floor > ack.id + 1) continue;
    OriginRecord* origin = Find(&context.state.diffusion, ack.origin, ack.origin_incarnation);
    if (origin == nullptr) {
      if (Learn(context, ack.origin, ack.origin_incarnation, ack.floor - 1) == nullptr) {
        Report(context, {.code = FaultCode::kTooManyOrigins, .limit = kMaxOrigins});
      }
    } else if (origin->learned_tick == context.state.tick && ack.floor - 1 < origin->have) {
      origin->have = ack.floor - 1;
    }
  }
}

/// Where neighbours keep only later ones than we lack, the row is broken (we were cut off while
/// those passed); after kSilentTicks no neighbour will bring them any more, and we go on behind the
/// gap.
void MendGaps(Context& context, const Inbox& inbox) {
  DiffusionState& d = context.state.diffusion;
  for (int i = 0; i < d.num_origins; ++i) {
    OriginRecord& origin = d.origins[i];
    uint32_t lowest = 0;  // Lowest id beyond a gap that a neighbour offers.
    for (int c = 0; c < context.kinematics.num_connectors(); ++c) {
      const NeighbourMessage* message = inbox.from[c];
      if (message == nullptr) continue;
      for (int a = 0; a < message->num_acks; ++a) {
        const InvocationAck& ack = message->acks[a];
        if (ack.origin != origin.module || ack.origin_incarnation != origin.incarnation) continue;
        // A gap: the neighbour has more than we do, and what it still keeps begins behind the next
        // one.
        if (ack.id <= origin.have || ack.floor <= origin.have + 1) continue;
        // Of several offers the one that skips least.
        if (lowest == 0 || ack.floor < lowest) lowest = ack.floor;
      }
    }
    // No neighbour offers anything beyond a gap: the next one may still come.
    if (lowest == 0) continue;
    if (origin.gap_since_tick < 0) origin.gap_since_tick = context.state.tick;
    if (context.state.tick - origin.gap_since_tick <= kSilentTicks) continue;
    origin.have = lowest - 1;
    origin.gap_since_tick = -1;
  }
}

/// Takes the next invocation of each origin, and no other, so that they run in order, once.
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
  Fault fault{
      .code = FaultCode::kInvocationGivenUp, .measured = kSilentTicks, .limit = kMaxInvocations};
  // Kept ones are in the order in which they came. The command is named only if it is of our own
  // program.
  const Invocation& oldest = d.kept[0].invocation;
  if (MeansTheSame(context, oldest.program_hash)) {
    fault.function = CommandFunction(context.program, oldest.role, oldest.command);
  }
  DropKept(&d, 0);
  Report(context, fault);
}

}  // namespace

void ReceiveInvocations(Context& context, const Inbox& inbox) {
  // A neighbour that is another one now, or has started anew, has acknowledged nothing.
  DiffusionState& d = context.state.diffusion;
  for (int i = 0; i < d.num_kept; ++i) d.kept[i].acked_connectors &= ~inbox.changed;
  for (int c = 0; c < context.kinematics.num_connectors(); ++c) {
    if (inbox.from[c] != nullptr) TakeAcks(context, c, *inbox.from[c]);
  }
  // First make room, then take more.
  DropAcknowledged(context);
  // All floors of a new origin are compared before any of its invocations is taken.
  for (int c = 0; c < context.kinematics.num_connectors(); ++c) {
    if (inbox.from[c] != nullptr) LearnOrigins(context, *inbox.from[c]);
  }
  MendGaps(context, inbox);
  for (int c = 0; c < context.kinematics.num_connectors(); ++c) {
    if (inbox.from[c] != nullptr) TakeInvocations(context, c, *inbox.from[c]);
  }
  RelieveJam(context);
}

bool Issue(Context& context, int role, int command, const Cell* arguments, int count, int target,
           Fault* fault) {
  DiffusionState& d = context.state.diffusion;
  // Half of the store stays free for what others send.
  constexpr int kMostOwn = kMaxInvocations / 2;
  // The fault is prepared before each test that may fail, and cleared once all have passed.
  fault->code = FaultCode::kInvocationNotSent;
  fault->limit = kMostOwn;
  if (d.num_kept >= kMostOwn) return false;
  fault->code = FaultCode::kTooManyOrigins;
  fault->limit = kMaxOrigins;
  const uint16_t self = context.config.module_id;
  // An issuer is an origin like any other, one that has all its own invocations.
  OriginRecord* origin = Find(&d, self, context.config.incarnation);
  if (origin == nullptr) origin = Learn(context, self, context.config.incarnation, 0);
  if (origin == nullptr) return false;
  fault->code = FaultCode::kNone;
  // It is kept until all neighbours have it, and runs here at once if the role is meant.
  KeptInvocation& kept = d.kept[d.num_kept++];
  kept = KeptInvocation();
  Invocation& invocation = kept.invocation;
  invocation.origin = self;
  invocation.origin_incarnation = context.config.incarnation;
  invocation.id = origin->have = d.own_id = d.own_id + 1;
  invocation.program_hash = context.program.hash();
  invocation.target = target;
  invocation.role = static_cast<uint16_t>(role);
  invocation.command = static_cast<uint8_t>(command);
  invocation.num_arguments = static_cast<uint8_t>(count);
  for (int i = 0; i < count; ++i) invocation.arguments[i] = arguments[i];
  Deliver(context, invocation);
  return true;
}

void IssueRequests(Context& context, const TickInput& input) {
  const VerifiedProgram& program = context.program;
  for (int i = 0; i < input.num_requests && i < kMaxRequests; ++i) {
    // A request comes from a person and may name anything.
    const InvokeRequest& request = input.requests[i];
    Fault fault;
    fault.code = FaultCode::kBadInvocation;
    if (MeansTheSame(context, request.program_hash)) {
      fault.function = CommandFunction(program, request.role, request.command);
    }
    const bool fits =
        program.AcceptsArguments(fault.function, request.arguments, request.num_arguments);
    if (fits && Issue(context, request.role, request.command, request.arguments,
                      request.num_arguments, -1, &fault)) {
      continue;
    }
    Report(context, fault);
  }
}

void DropAcknowledged(Context& context) {
  DiffusionState& d = context.state.diffusion;
  // Neighbours that have been silent for long hold nothing up.
  const uint32_t present = PresentNeighbours(context);
  for (int i = d.num_kept - 1; i >= 0; --i) {
    if ((present & ~d.kept[i].acked_connectors) == 0) DropKept(&d, i);
  }
}

int FillInvocations(Context& context, NeighbourMessage* message) {
  DiffusionState& d = context.state.diffusion;
  // An acknowledgement tells up to which id all are here, and from which on they are kept.
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
  // Oldest first, so that of each origin the lowest id that a neighbour lacks comes before later
  // ones.
  for (int i = 0; i < d.num_kept && message->num_invocations < kMaxMessageInvocations; ++i) {
    message->invocations[message->num_invocations++] = d.kept[i].invocation;
  }
  return message->num_acks * kAckWireBytes + message->num_invocations * kInvocationWireBytes;
}

}  // namespace morphbus::vm
