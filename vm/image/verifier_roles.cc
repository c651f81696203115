// The role table: everything inherited is written out in it, so each role must be checked to agree
// with the one it extends; code compiled for a role then runs under all its subroles.
#include "vm/image/image.h"
#include "vm/image/opcodes.h"
#include "vm/image/verifier.h"

namespace morphbus::vm {

using image::ReadU16;
using image::ReadU32;
using image::Section;
using image::SectionOf;
using image::SectionRange;

namespace {

/// Calls visit(function) for every function that a role refers to, inherited ones included.
template <class Visit>
void ForEachFunction(const RoleInfo& role, const Visit& visit) {
  for (int i = 0; i < role.num_labels; ++i) visit(role.labels[i]);
  for (int i = 0; i < role.num_requirements; ++i) visit(role.requirements[i]);
  for (int i = 0; i < role.num_startups; ++i) visit(role.startups[i]);
  for (int i = 0; i < role.num_behaviors; ++i) visit(role.behaviors[i]);
  for (int i = 0; i < role.num_commands; ++i) visit(role.commands[i]);
  for (int i = 0; i < role.num_handlers; ++i) visit(role.handlers[i].function);
  for (int i = 0; i < role.num_methods; ++i) visit(role.methods[i]);
}

}  // namespace

// Roles have no fixed size, so they are read one after the other; where the last one ends must be
// where the next section begins.
bool Verifier::CheckRoles() {
  const SectionRange range = SectionOf(bytes_, Section::kRoles);
  if (range.count > kMaxRoles) return Fail("too many roles", range.begin);
  out_.num_roles_ = static_cast<int>(range.count);
  uint32_t at = range.begin;
  for (int i = 0; i < out_.num_roles_; ++i) {
    if (!CheckRoleHead(i, &at)) return false;
  }
  if (at != SectionOf(bytes_, Section::kStates).begin) {
    return Fail("roles leave a gap or overlap", at);
  }
  if (!CheckParents()) return false;
  for (int i = 0; i < out_.num_roles_; ++i) {
    // Parents may stand behind their children, so agreement is checked once all are read.
    const RoleInfo role = out_.role(i);
    if (role.parent >= 0 && !CheckAgainstParent(role, out_.role(role.parent))) return false;
  }
  return CheckOwners();
}

// A role's name, parent and counts, and with them the size of what follows.
bool Verifier::CheckRoleHead(int index, uint32_t* at) {
  const uint32_t limit = SectionOf(bytes_, Section::kStates).begin;
  // The head must fit in front of the next section before any of it is read.
  const uint32_t head = *at;
  if (limit < head || limit - head < image::kRoleHeadBytes) return Fail("role is cut off", head);
  if (!CheckName(head)) return false;
  const uint8_t* counts = bytes_ + head + image::kRoleCountsAt;
  constexpr uint32_t kLimits[image::kRoleCounts] = {kMaxFields,   kMaxLabels,   kMaxRequirements,
                                                    kMaxRoutines, kMaxRoutines, kMaxRoutines,
                                                    kMaxRoutines, kMaxRoutines};
  for (int i = 0; i < image::kRoleCounts; ++i) {
    if (counts[i] > kLimits[i]) {
      return Fail("role has too many members", head + image::kRoleCountsAt);
    }
  }
  // Which role is extended is checked further below; here it only has to exist.
  const int parent = bytes_[head + image::kRoleParentAt];
  if (parent != image::kNoParent && parent >= out_.num_roles_) {
    return Fail("bad head of a role", head);
  }
  *at = head + image::kRoleHeadBytes;
  if (limit - *at < image::RoleBodyBytes(counts)) return Fail("role is cut off", head);
  // From here on the record can be read by its accessors; what they find is checked kind by kind,
  // in the order of the counts.
  out_.role_at_[index] = static_cast<uint16_t>(head);
  const RoleInfo role = out_.role(index);
  return CheckFields(role, at) && CheckLabels(role, at) &&
         CheckReferences(role.requirements, role.num_requirements, Member::kRequirement, at) &&
         CheckReferences(role.startups, role.num_startups, Member::kRoutine, at) &&
         CheckReferences(role.behaviors, role.num_behaviors, Member::kRoutine, at) &&
         CheckReferences(role.commands, role.num_commands, Member::kCommand, at) &&
         CheckHandlers(role, at) &&
         CheckReferences(role.methods, role.num_methods, Member::kMethod, at);
}

// The first value of a field is a constant, whose table has been checked; a text is no value.
bool Verifier::CheckFields(const RoleInfo& role, uint32_t* at) {
  int shared = 0;
  for (int i = 0; i < role.num_fields; ++i, *at += image::kFieldBytes) {
    const uint32_t constant = ReadU16(bytes_ + *at) & ~uint32_t{image::kSharedFieldBit};
    if (constant >= out_.num_constants_ ||
        out_.constant_type(static_cast<int>(constant)) == ValueType::kText) {
      return Fail("field without a first value", *at);
    }
    if (role.fields.shared(i)) ++shared;
  }
  return shared <= kMaxSharedFields || Fail("too many shared fields", *at);
}

// A label is found by a function without arguments that returns a joint or a link.
bool Verifier::CheckLabels(const RoleInfo& role, uint32_t* at) {
  for (int i = 0; i < role.num_labels; ++i, *at += image::kReferenceBytes) {
    if (role.labels[i] >= out_.num_functions_) return Fail("label of no function", *at);
    const FunctionInfo function = out_.function(role.labels[i]);
    const bool names_part =
        function.return_type == ValueType::kJoint || function.return_type == ValueType::kLink;
    if (!names_part || function.num_arguments != 0) {
      return Fail("label does not fit its function", *at);
    }
  }
  return true;
}

// Requirements return a bool; startups, behaviors and commands return nothing, and only commands
// have arguments; methods may have any signature.
bool Verifier::CheckReferences(const ReferenceTable& functions, int count, Member member,
                               uint32_t* at) {
  for (int i = 0; i < count; ++i, *at += image::kReferenceBytes) {
    if (functions[i] >= out_.num_functions_) return Fail("reference to no function", *at);
    if (member == Member::kMethod) continue;
    const FunctionInfo function = out_.function(functions[i]);
    if (member == Member::kRequirement) {
      if (function.return_type != ValueType::kBool || function.num_arguments != 0) {
        return Fail("requirement does not yield a bool", *at);
      }
      continue;
    }
    if (function.return_type != ValueType::kVoid ||
        function.num_arguments > (member == Member::kCommand ? kMaxArguments : 0)) {
      return Fail("routine has a result or too many arguments", *at);
    }
    // Arguments of commands travel, so only values that mean the same everywhere are allowed.
    for (int k = 0; k < function.num_arguments; ++k) {
      if (function.local_types[k] > ValueType::kRole) {
        return Fail("argument of a command cannot travel", *at);
      }
    }
  }
  return true;
}

// A handler answers a known event, or is a timer with a period of its own; it may take what the
// event is about, and returns nothing.
bool Verifier::CheckHandlers(const RoleInfo& role, uint32_t* at) {
  for (int i = 0; i < role.num_handlers; ++i, *at += image::kHandlerBytes) {
    const int event = bytes_[*at] & ~image::kEarlyBit;
    if (event >= image::kFirstPeriod && !CheckPeriod(event - image::kFirstPeriod, *at)) {
      return false;
    }
    const HandlerInfo handler = role.handlers[i];
    if (handler.function >= out_.num_functions_) return Fail("reference to no function", *at);
    const FunctionInfo function = out_.function(handler.function);
    constexpr ValueType kSubjects[] = {ValueType::kConnector, ValueType::kConnector,
                                       ValueType::kJoint, ValueType::kVoid};
    const ValueType subject = kSubjects[static_cast<int>(handler.event)];
    const bool takes_subject = function.num_arguments == 1 && subject != ValueType::kVoid &&
                               function.local_types[0] == subject;
    if (function.return_type != ValueType::kVoid ||
        (function.num_arguments != 0 && !takes_subject)) {
      return Fail("handler has a result or arguments that its event has not", *at);
    }
  }
  return true;
}

// A period is a constant, so that equal ones share it.
bool Verifier::CheckPeriod(int constant, uint32_t at) {
  if (static_cast<uint32_t>(constant) >= out_.num_constants_) return Fail("unknown event", at);
  const float seconds = out_.constant(constant).AsFloat();
  if (out_.constant_type(constant) != ValueType::kFloat || !(seconds >= kMinPeriodS) ||
      !(seconds <= kMaxPeriodS)) {
    return Fail("period of a timer is out of range", at);
  }
  return true;
}

// Each role says how deep it stands below Module; if every depth is one more than the parent's,
// there are no cycles. Afterwards ancestors_ answers IsA in one step.
bool Verifier::CheckParents() {
  for (int i = 0; i < out_.num_roles_; ++i) {
    const RoleInfo role = out_.role(i);
    const int expected = role.parent < 0 ? 0 : out_.role(role.parent).depth + 1;
    if (role.depth != expected) {
      return Fail("roles extend each other in a circle", SectionOf(bytes_, Section::kRoles).begin);
    }
  }
  PlantTree();
  return true;
}

// There are no circles any more, so every role is below one that extends none.
void Verifier::PlantTree() {
  for (int i = out_.num_roles_ - 1; i >= 0; --i) first_child_[i] = next_sibling_[i] = kNoRole;
  for (int i = out_.num_roles_ - 1; i >= 0; --i) {
    const int parent = out_.role(i).parent;
    if (parent < 0) continue;
    next_sibling_[i] = first_child_[parent];
    first_child_[parent] = static_cast<uint8_t>(i);
  }
  for (int top = 0; top < out_.num_roles_; ++top) {
    if (out_.role(top).parent >= 0) continue;
    for (int i = top; i >= 0; i = NextBelow(i, top)) {
      const int parent = out_.role(i).parent;
      ancestors_[i] = uint64_t{1} << i | (parent < 0 ? 0 : ancestors_[parent]);
    }
  }
}

int Verifier::NextBelow(int role, int top) const {
  if (first_child_[role] != kNoRole) return first_child_[role];
  while (role != top && next_sibling_[role] == kNoRole) role = out_.role(role).parent;
  return role == top ? -1 : next_sibling_[role];
}

// True if calls of the one function may reach the other.
bool Verifier::SameSignature(int function, int other) const {
  const FunctionInfo a = out_.function(function);
  const FunctionInfo b = out_.function(other);
  if (a.num_arguments != b.num_arguments || a.return_type != b.return_type) return false;
  for (int i = 0; i < a.num_arguments; ++i) {
    if (a.local_types[i] != b.local_types[i]) return false;
  }
  return true;
}

// Slots are shared: what a parent has in a slot, its subroles have there too, of the same type.
bool Verifier::CheckAgainstParent(const RoleInfo& role, const RoleInfo& parent) {
  const uint32_t at = SectionOf(bytes_, Section::kRoles).begin;
  // A role has all that it inherits, in the same slots, and its own behind it.
  if (role.num_fields < parent.num_fields || role.num_labels < parent.num_labels ||
      role.num_commands < parent.num_commands || role.num_methods < parent.num_methods) {
    return Fail("role lacks members of the role it extends", at);
  }
  for (int i = 0; i < parent.num_fields; ++i) {
    const bool same_sharing = role.fields.shared(i) == parent.fields.shared(i);
    if (role.fields.type(i) != parent.fields.type(i) || !same_sharing) {
      return Fail("inherited field differs", at);
    }
  }
  for (int i = 0; i < parent.num_labels; ++i) {
    if (!SameSignature(role.labels[i], parent.labels[i]))
      return Fail("inherited label differs", at);
  }
  for (int i = 0; i < parent.num_commands; ++i) {
    if (!SameSignature(role.commands[i], parent.commands[i])) {
      return Fail("inherited command has other arguments", at);
    }
  }
  for (int i = 0; i < parent.num_methods; ++i) {
    if (!SameSignature(role.methods[i], parent.methods[i])) {
      return Fail("inherited function has other types", at);
    }
  }
  return true;
}

// The role in whose braces the function stands.
int Verifier::OwnerOf(int function) const { return out_.function(function).role; }

// A function reads fields and labels by its owner's slots, so a role may use only functions of its
// own and of the roles that it extends, those that it inherits included.
bool Verifier::CheckOwners() {
  bool all = true;
  for (int i = 0; i < out_.num_roles_; ++i) {
    ForEachFunction(out_.role(i), [&](int function) {
      all = all && (ancestors_[i] >> OwnerOf(function) & 1) != 0;
    });
  }
  return all || Fail("role uses a function of an unrelated role",
                     SectionOf(bytes_, Section::kRoles).begin);
}

// Which keywords a role needs is found here and not read, so that it cannot be wrong.
void Verifier::CollectKeywords(int index) {
  uint64_t used = 0;
  ForEachFunction(out_.role(index), [&](int function) { used |= facts_[function].keywords; });
  out_.role_keywords_[index] = used;
}

}  // namespace morphbus::vm
