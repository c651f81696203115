#pragma once
// A program image after verification: the only form in which the VM accepts a program.

#include <cstdint>

#include "vm/image/values.h"
#include "vm/limits.h"

namespace morphbus::vm {

/// A text inside the image, which must outlive it; it is not NUL-terminated.
struct Text {
  const char* data = nullptr;
  uint16_t size = 0;
};

/// What a keyword of the module type's XML names: a part of the module, or a state of a connector.
enum class KeywordKind : uint8_t { kLink, kJoint, kConnector, kConnectorState };

/// A keyword, bound by name to a module type when an image is loaded.
struct KeywordInfo {
  KeywordKind kind = KeywordKind::kLink;
  /// The name in capitals, as in the program: CONNECTING_BAR, JOINT_1, C1, EXTENDED.
  Text name;
};

/// A function of the program: requirement, label, startup, behavior, command, handler, function.
struct FunctionInfo {
  /// The name with that of its role, e.g. "LegUpperHalf.move_thigh".
  Text name;
  /// Where its code lies: the offset in the image and the size (bytes).
  uint32_t code_begin = 0;
  uint32_t code_size = 0;
  /// How many of its locals are arguments.
  uint8_t num_arguments = 0;
  /// How many locals it has, arguments included.
  uint8_t num_locals = 0;
  /// The most operand cells that it needs, found by the verifier.
  uint8_t max_stack = 0;
  /// The most frames below this one, found by the verifier.
  uint8_t call_depth = 0;
  /// The most cells that the locals and operands of this function and all it calls need.
  uint16_t total_cells = 0;
  /// The type of its result, and those of its locals.
  ValueType return_type = ValueType::kVoid;
  ValueType local_types[16] = {};
};

/// A label: a name for one own joint or link, found by a function that returns it.
struct LabelInfo {
  Text name;
  ValueType type = ValueType::kJoint;
  uint16_t function = 0;
};

/// A startup, behavior or command.
struct RoutineInfo {
  Text name;
  uint16_t function = 0;
};

/// Events that a handler may run on.
enum class Event : uint8_t { kConnect, kDisconnect, kStall, kTimer };

/// A handler: it is known by its event and has no name.
struct HandlerInfo {
  Event event = Event::kConnect;
  uint16_t function = 0;
};

/// A role with all that it inherits; slots of fields, labels, commands are those of its base roles
/// followed by its own, so that code compiled for a base role runs under every subrole.
struct RoleInfo {
  Text name;
  /// The index of the role that it extends; -1 for a direct child of Module.
  int16_t parent = -1;
  /// True if no module plays it, only roles that extend it.
  bool abstract_role = false;
  /// How many entries of the tables below are in use.
  uint8_t num_fields = 0, num_labels = 0, num_requirements = 0, num_startups = 0;
  uint8_t num_behaviors = 0, num_commands = 0, num_handlers = 0, num_keywords = 0, num_methods = 0;
  /// The fields' values when the role is taken.
  Cell fields[kMaxFields];
  /// The fields' types.
  ValueType field_types[kMaxFields] = {};
  /// The labels; resolving one runs its function.
  LabelInfo labels[kMaxLabels];
  /// The functions that must all return true for the role to be taken.
  uint16_t requirements[kMaxRequirements] = {};
  /// The startups, those of the base role first, each in declared order.
  RoutineInfo startups[kMaxRoutines];
  /// The behaviors, which repeat while the role is held.
  RoutineInfo behaviors[kMaxRoutines];
  /// The commands by slot, which invocations name.
  RoutineInfo commands[kMaxRoutines];
  /// The handlers, which run on events.
  HandlerInfo handlers[kMaxRoutines];
  /// The `function` members by slot; calls go through it (dynamic dispatch).
  uint16_t methods[kMaxRoutines] = {};
  /// The keywords that some code of the role needs; a module type without one cannot take it.
  uint8_t keywords[kMaxKeywords] = {};
};

/// Made only by the verifier (vm/image/verifier.h). Points into image bytes that the owner keeps
/// alive and unchanged; holds no heap memory.
class VerifiedProgram {
 public:
  /// The image itself; size() is 0 while there is no verified image.
  [[nodiscard]] const uint8_t* bytes() const { return bytes_; }
  [[nodiscard]] uint32_t size() const { return size_; }
  /// The hash that names the program among modules (image::HashOf).
  [[nodiscard]] uint64_t hash() const { return hash_; }
  /// Cost units that all tasks of a module may use in one tick.
  [[nodiscard]] uint32_t instruction_budget() const { return budget_; }
  /// Ticks for which the surroundings must be the same before roles are decided on them.
  [[nodiscard]] uint16_t settle_ticks() const { return settle_ticks_; }
  /// Roles, functions and keywords by their numbers in the image.
  [[nodiscard]] int num_roles() const { return num_roles_; }
  [[nodiscard]] const RoleInfo& role(int i) const { return roles_[i]; }
  [[nodiscard]] int num_functions() const { return num_functions_; }
  [[nodiscard]] const FunctionInfo& function(int i) const { return functions_[i]; }
  [[nodiscard]] int num_keywords() const { return num_keywords_; }
  [[nodiscard]] const KeywordInfo& keyword(int i) const { return keywords_[i]; }
  /// Type and value i of the constant table (vm/image/image.h); inline because programs push
  /// constants often.
  [[nodiscard]] ValueType constant_type(int i) const {
    return static_cast<ValueType>(bytes_[constants_begin_ + static_cast<uint32_t>(i) * 5]);
  }
  [[nodiscard]] Cell constant(int i) const {
    const uint8_t* p = bytes_ + constants_begin_ + static_cast<uint32_t>(i) * 5 + 1;
    return Cell{p[0] | static_cast<uint32_t>(p[1]) << 8 | static_cast<uint32_t>(p[2]) << 16 |
                static_cast<uint32_t>(p[3]) << 24};
  }
  /// Name of the source file it was compiled from.
  [[nodiscard]] Text source_name() const { return source_name_; }
  /// True if these are acceptable arguments of a function: right count, each a value of its type.
  /// For invocations, whose arguments come from other modules.
  [[nodiscard]] bool AcceptsArguments(int function, const Cell* arguments, int count) const;
  /// True if `role` is `ancestor` or extends it, directly or not.
  [[nodiscard]] bool IsA(int role, int ancestor) const;
  /// Source line (1-based) of an instruction, 0 if unknown. `pc` is a byte offset in the function.
  [[nodiscard]] int LineOf(int function, uint32_t pc) const;
  /// Source line of the first code that stands in a role itself, 0 if there is none. An image has
  /// no lines of declarations; this one lies in the role's braces.
  [[nodiscard]] int LineOfRole(int role) const;

 private:
  // The verifier fills these in; the first two are what the rest points into.
  friend class Verifier;
  const uint8_t* bytes_ = nullptr;
  uint32_t size_ = 0;
  uint64_t hash_ = 0;
  uint32_t budget_ = 0;
  // Counts and begins of the sections, as in the image's header.
  uint16_t settle_ticks_ = 0;
  int num_roles_ = 0, num_functions_ = 0, num_keywords_ = 0;
  uint32_t constants_begin_ = 0, num_constants_ = 0;
  uint32_t code_begin_ = 0, lines_begin_ = 0, num_lines_ = 0;
  Text source_name_;
  RoleInfo roles_[kMaxRoles];
  FunctionInfo functions_[kMaxFunctions];
  KeywordInfo keywords_[kMaxKeywords];
};

}  // namespace morphbus::vm
