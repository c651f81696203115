#include "vm/image/role_checker.h"

#include "vm/image/image.h"
#include "vm/image/table_checks.h"

namespace morphbus::vm {

using image::ReadU16;
using image::Section;
using image::SectionOf;

bool RoleChecker::FailTable(const char* message) {
  return error_.Fail(message, SectionOf(bytes_, Section::kRoles).begin);
}

// A role's name, parent and counts, and with them the size of what follows.
bool RoleChecker::CheckRecord(int index, uint32_t* at) {
  const uint32_t limit = SectionOf(bytes_, Section::kStates).begin;
  // The head must fit in front of the next section before any of it is read.
  const uint32_t head = *at;
  if (limit < head || limit - head < image::kRoleHeadBytes) {
    return error_.Fail("role is cut off", head);
  }
  if (!CheckName(program_, head, &error_)) return false;
  // A module has room for so many members of each kind and no more.
  const uint8_t* counts = bytes_ + head + image::kRoleCountsAt;
  constexpr uint32_t kLimits[image::kRoleCounts] = {kMaxFields,   kMaxLabels,   kMaxRequirements,
                                                    kMaxRoutines, kMaxRoutines, kMaxRoutines,
                                                    kMaxRoutines, kMaxRoutines};
  for (int i = 0; i < image::kRoleCounts; ++i) {
    if (counts[i] > kLimits[i]) {
      return error_.Fail("role has too many members", head + image::kRoleCountsAt);
    }
  }
  // Whether roles extend each other in a circle is checked further below; here the parent only has
  // to exist.
  const int parent = bytes_[head + image::kRoleParentAt];
  if (parent != image::kNoParent && parent >= program_.num_roles()) {
    return error_.Fail("bad head of a role", head);
  }
  *at = head + image::kRoleHeadBytes;
  if (limit - *at < image::RoleBodyBytes(counts)) return error_.Fail("role is cut off", head);
  // From here on the record can be read by its accessors; what they find is checked kind by kind,
  // in the order of the counts.
  const RoleInfo role = program_.role(index);
  return CheckFields(role, at) && CheckLabels(role, at) &&
         CheckReferences(role.requirements, role.num_requirements, Member::kRequirement, at) &&
         CheckReferences(role.startups, role.num_startups, Member::kRoutine, at) &&
         CheckReferences(role.behaviors, role.num_behaviors, Member::kRoutine, at) &&
         CheckReferences(role.commands, role.num_commands, Member::kCommand, at) &&
         CheckHandlers(role, at) &&
         CheckReferences(role.methods, role.num_methods, Member::kMethod, at);
}

// The first value of a field is a constant, whose table has been checked; a text is no value.
bool RoleChecker::CheckFields(const RoleInfo& role, uint32_t* at) {
  // All shared fields travel in one message.
  int shared = 0, traced = 0, kept = 0;
  for (int i = 0; i < role.num_fields; ++i, *at += image::kFieldBytes) {
    const int constant = ReadU16(bytes_ + *at) & image::kFieldConstantMask;
    if (constant >= program_.num_constants() ||
        program_.constant_type(constant) == ValueType::kText) {
      return error_.Fail("field without a first value", *at);
    }
    // What is kept is known by its name.
    const bool named = constant + 1 < program_.num_constants() &&
                       program_.constant_type(constant + 1) == ValueType::kText;
    if (role.fields.kept(i) &&
        (!kHoldsAllInstructions || !named || program_.constant_type(constant) > ValueType::kAxis)) {
      return error_.Fail(kHoldsAllInstructions ? "kept field without a name" : "kept field", *at);
    }
    if (role.fields.shared(i)) ++shared;
    if (role.fields.traced(i)) ++traced;
    if (role.fields.kept(i)) ++kept;
  }
  if (kept > kMaxKeptFields) return error_.Fail("too many kept fields", *at);
  if (traced > kMaxTracedFields) return error_.Fail("too many traced fields", *at);
  return shared <= kMaxSharedFields || error_.Fail("too many shared fields", *at);
}

// A label is found by a function without arguments that returns a joint or a link.
bool RoleChecker::CheckLabels(const RoleInfo& role, uint32_t* at) {
  for (int i = 0; i < role.num_labels; ++i, *at += image::kReferenceBytes) {
    if (role.labels[i] >= program_.num_functions()) {
      return error_.Fail("label of no function", *at);
    }
    const FunctionInfo function = program_.function(role.labels[i]);
    const bool names_part =
        function.return_type == ValueType::kJoint || function.return_type == ValueType::kLink;
    if (!names_part || function.num_arguments != 0) {
      return error_.Fail("label does not fit its function", *at);
    }
  }
  return true;
}

// Requirements return a bool; startups, behaviors and commands return nothing, and only commands
// have arguments; methods may have any signature.
bool RoleChecker::CheckReferences(const ReferenceTable& functions, int count, Member member,
                                  uint32_t* at) {
  for (int i = 0; i < count; ++i, *at += image::kReferenceBytes) {
    if (functions[i] >= program_.num_functions()) {
      return error_.Fail("reference to no function", *at);
    }
    if (member == Member::kMethod) continue;
    const FunctionInfo function = program_.function(functions[i]);
    if (member == Member::kRequirement) {
      if (function.return_type != ValueType::kBool || function.num_arguments != 0) {
        return error_.Fail("requirement does not yield a bool", *at);
      }
      continue;
    }
    if (function.return_type != ValueType::kVoid ||
        function.num_arguments > (member == Member::kCommand ? kMaxArguments : 0)) {
      return error_.Fail("routine has a result or too many arguments", *at);
    }
    // Arguments of commands travel, so only values that mean the same everywhere are allowed.
    for (int k = 0; k < function.num_arguments; ++k) {
      if (function.local_types[k] > ValueType::kRole) {
        return error_.Fail("argument of a command cannot travel", *at);
      }
    }
  }
  return true;
}

// A handler answers a known event, or is a timer with a period of its own; it may take what the
// event is about, and returns nothing.
bool RoleChecker::CheckHandlers(const RoleInfo& role, uint32_t* at) {
  for (int i = 0; i < role.num_handlers; ++i, *at += image::kHandlerBytes) {
    const int event = bytes_[*at] & ~image::kEarlyBit;
    if (event >= image::kFirstPeriod && !CheckPeriod(event - image::kFirstPeriod, *at)) {
      return false;
    }
    const HandlerInfo handler = role.handlers[i];
    if (handler.function >= program_.num_functions()) {
      return error_.Fail("reference to no function", *at);
    }
    const FunctionInfo function = program_.function(handler.function);
    // What a connector or joint did is told by naming it; a timer is about nothing.
    constexpr ValueType kSubjects[] = {ValueType::kConnector, ValueType::kConnector,
                                       ValueType::kJoint, ValueType::kVoid};
    const ValueType subject = kSubjects[static_cast<int>(handler.event)];
    const bool takes_subject = function.num_arguments == 1 && subject != ValueType::kVoid &&
                               function.local_types[0] == subject;
    if (function.return_type != ValueType::kVoid ||
        (function.num_arguments != 0 && !takes_subject)) {
      return error_.Fail("handler has a result or arguments that its event has not", *at);
    }
  }
  return true;
}

// A period is a constant, so that equal ones share it.
bool RoleChecker::CheckPeriod(int constant, uint32_t at) {
  // An event that is none would count as a period of a high number.
  if (constant >= program_.num_constants()) return error_.Fail("unknown event", at);
  const float seconds = program_.constant(constant).AsFloat();
  if (program_.constant_type(constant) != ValueType::kFloat || !(seconds >= kMinPeriodS) ||
      !(seconds <= kMaxPeriodS)) {
    return error_.Fail("period of a timer is out of range", at);
  }
  return true;
}

// Each role says how deep it stands below Module; if every depth is one more than the parent's,
// there are no cycles.
bool RoleChecker::CheckDepths() {
  // Parents may stand behind those that extend them: depths are compared when all are there.
  for (int i = 0; i < program_.num_roles(); ++i) {
    const RoleInfo role = program_.role(i);
    const int expected = role.parent < 0 ? 0 : program_.role(role.parent).depth + 1;
    if (role.depth != expected) return FailTable("roles extend each other in a circle");
  }
  return true;
}

bool RoleChecker::CheckInheritance() {
  // Parents may stand behind their children, so this waits until all have been read.
  for (int i = 0; i < program_.num_roles(); ++i) {
    const RoleInfo role = program_.role(i);
    if (role.parent >= 0 && !CheckAgainstParent(role, program_.role(role.parent))) return false;
  }
  return true;
}

bool RoleChecker::SameSignature(int function, int other) const {
  const FunctionInfo a = program_.function(function);
  const FunctionInfo b = program_.function(other);
  // Other locals do not matter to callers.
  if (a.num_arguments != b.num_arguments || a.return_type != b.return_type) return false;
  for (int i = 0; i < a.num_arguments; ++i) {
    if (a.local_types[i] != b.local_types[i]) return false;
  }
  return true;
}

bool RoleChecker::SameSignatures(const ReferenceTable& functions, const ReferenceTable& others,
                                 int count) const {
  for (int i = 0; i < count; ++i) {
    if (!SameSignature(functions[i], others[i])) return false;
  }
  return true;
}

bool RoleChecker::CheckAgainstParent(const RoleInfo& role, const RoleInfo& parent) {
  // A role has all that it inherits, in the same slots, and its own behind it.
  if (role.num_fields < parent.num_fields || role.num_labels < parent.num_labels ||
      role.num_commands < parent.num_commands || role.num_methods < parent.num_methods) {
    return FailTable("role lacks members of the role it extends");
  }
  // Code of the parent reads and sets these fields on modules that play the role.
  for (int i = 0; i < parent.num_fields; ++i) {
    const bool same_sharing = role.fields.shared(i) == parent.fields.shared(i) &&
                              role.fields.kept(i) == parent.fields.kept(i);
    if (role.fields.type(i) != parent.fields.type(i) || !same_sharing) {
      return FailTable("inherited field differs");
    }
  }
  if (!SameSignatures(role.labels, parent.labels, parent.num_labels)) {
    return FailTable("inherited label differs");
  }
  if (!SameSignatures(role.commands, parent.commands, parent.num_commands)) {
    return FailTable("inherited command has other arguments");
  }
  return SameSignatures(role.methods, parent.methods, parent.num_methods) ||
         FailTable("inherited function has other types");
}

bool RoleChecker::CheckOwners(const RoleTree& tree) {
  bool all = true;
  for (int i = 0; i < program_.num_roles(); ++i) {
    program_.role(i).ForEachFunction(
        [&](int function) { all = all && tree.IsA(i, program_.function(function).role); });
  }
  return all || FailTable("role uses a function of an unrelated role");
}

}  // namespace morphbus::vm
