#include "vm/image/program.h"

namespace morphbus::vm {

namespace {

/// Where the members of each kind begin behind a role's head: those of the kinds before it lie
/// between.
const uint8_t* MembersOf(const uint8_t* role, int kind) {
  // A role's record has no directory: the sizes of its tables follow from their counts.
  const uint8_t* counts = role + image::kRoleCountsAt;
  const uint8_t* at = role + image::kRoleHeadBytes;
  for (int i = 0; i < kind; ++i) at += counts[i] * image::kRoleMemberBytes[i];
  return at;
}

}  // namespace

RoleInfo::RoleInfo(const uint8_t* at, const uint8_t* strings, const uint8_t* constants)
    : name(TextAt(strings, at)),
      parent(at[image::kRoleParentAt] == image::kNoParent ? int16_t{-1}
                                                          : int16_t{at[image::kRoleParentAt]}),
      abstract_role((at[image::kRoleDepthAt] & image::kAbstractBit) != 0),
      depth(at[image::kRoleDepthAt] & ~image::kAbstractBit),
      num_fields(at[image::kRoleCountsAt]),
      num_labels(at[image::kRoleCountsAt + 1]),
      num_requirements(at[image::kRoleCountsAt + 2]),
      num_startups(at[image::kRoleCountsAt + 3]),
      num_behaviors(at[image::kRoleCountsAt + 4]),
      num_commands(at[image::kRoleCountsAt + 5]),
      num_handlers(at[image::kRoleCountsAt + 6]),
      num_methods(at[image::kRoleCountsAt + 7]),
      fields(MembersOf(at, 0), constants),
      labels(MembersOf(at, 1)),
      requirements(MembersOf(at, 2)),
      startups(MembersOf(at, 3)),
      behaviors(MembersOf(at, 4)),
      commands(MembersOf(at, 5)),
      handlers(MembersOf(at, 6), constants),
      methods(MembersOf(at, 7)) {}

uint32_t RoleInfo::shared_fields() const {
  // Bit i stands for field i, as in the message that carries them.
  uint32_t mask = 0;
  for (int i = 0; i < num_fields; ++i) {
    if (fields.shared(i)) mask |= 1u << i;
  }
  return mask;
}

HandlerInfo HandlerTable::operator[](int i) const {
  // One byte holds the event, or which constant the period is, with a bit for early handlers.
  const uint8_t* at = at_ + static_cast<uint32_t>(i) * image::kHandlerBytes;
  HandlerInfo handler;
  handler.early = (at[0] & image::kEarlyBit) != 0;
  handler.function = image::ReadU16(at + 1);
  const int event = at[0] & ~image::kEarlyBit;
  handler.event = event < image::kFirstPeriod ? static_cast<Event>(event) : Event::kTimer;
  handler.period_us = kTimerUs;
  if (event < image::kFirstPeriod) return handler;
  // The verifier has found the period to be a constant in range.
  const int constant = event - image::kFirstPeriod;
  const Cell seconds{
      image::ReadU32(constants_ + static_cast<uint32_t>(constant) * image::kConstantBytes + 1)};
  handler.period_us = static_cast<int64_t>(static_cast<double>(seconds.AsFloat()) * 1e6 + 0.5);
  return handler;
}

// Invocations come from other modules and from people, so nothing is taken for granted.
bool VerifiedProgram::AcceptsArguments(int function, const Cell* arguments, int count) const {
  if (function < 0 || function >= num_functions_) return false;
  // Types alone are not enough: a float must be finite, a role one of the program's.
  const FunctionInfo info = this->function(function);
  if (count != info.num_arguments) return false;
  for (int i = 0; i < count; ++i) {
    if (!IsValueOf(info.local_types[i], arguments[i], num_roles_)) return false;
  }
  return true;
}

Text VerifiedProgram::text(int i) const {
  // The value is the place of the characters: offset and size, as in every text record.
  const uint32_t bits = constant(i).bits;
  return {reinterpret_cast<const char*>(bytes_ + image::kHeaderBytes + (bits & 0xffff)),
          static_cast<uint16_t>(bits >> 16)};
}

bool VerifiedProgram::SameButForParameters(const VerifiedProgram& other) const {
  if (run_size() != other.run_size()) return false;
  // Bytes are compared up to the next that may differ: the hash, and the values of parameters.
  uint32_t at = 0;
  const auto same_until = [&](uint32_t end, uint32_t next) {
    for (; at < end; ++at) {
      if (bytes_[at] != other.bytes_[at]) return false;
    }
    at = next;
    return true;
  };
  if (!same_until(image::kHashAt, image::kHashAt + 8)) return false;
  for (int i = 0; i < num_constants(); ++i) {
    // The type tells both programs' parameters, so it is compared with what stands before.
    const auto value = static_cast<uint32_t>(ConstantAt(i) + 1 - bytes_);
    if (is_parameter(i) && !same_until(value, value + 4)) return false;
  }
  return same_until(run_size(), run_size());
}

bool VerifiedProgram::IsA(int role, int ancestor) const {
  // Parents form a forest (the verifier checks depths), so this ends.
  while (role >= 0 && role != ancestor) {
    const uint8_t parent = bytes_[role_at_[role] + image::kRoleParentAt];
    role = parent == image::kNoParent ? -1 : parent;
  }
  return role >= 0;
}

}  // namespace morphbus::vm
