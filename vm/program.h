#pragma once
// A program image after verification: the only form in which the VM accepts a program.

#include <cstdint>

#include "vm/limits.h"
#include "vm/values.h"

namespace morphbus::vm {

/// Text inside the image; not NUL-terminated.
struct Text {
  const char* data = nullptr;
  uint16_t size = 0;
};

/// What a keyword of the module type's XML names.
enum class KeywordKind : uint8_t { kLink, kJoint, kConnector, kConnectorState };

/// A keyword, bound by name to a module type when an image is loaded.
struct KeywordInfo {
  KeywordKind kind = KeywordKind::kLink;
  Text name;  ///< In capitals, as in the program: CONNECTING_BAR, JOINT_1, C1, EXTENDED.
};

/// A function of the program: requirement, label, startup, behavior, command, handler, function.
struct FunctionInfo {
  Text name;                ///< e.g. "LegUpperHalf.move_thigh".
  uint32_t code_begin = 0;  ///< Byte offsets into the image.
  uint32_t code_size = 0;
  uint8_t num_arguments = 0;
  uint8_t num_locals = 0;    ///< Arguments included.
  uint8_t max_stack = 0;     ///< Operand cells, found by the verifier.
  uint8_t call_depth = 0;    ///< Frames below this one at most, found by the verifier.
  uint16_t total_cells = 0;  ///< Locals and operands of this and all it calls, at most.
  ValueType return_type = ValueType::kVoid;
  ValueType local_types[16] = {};
};

/// A label: evaluated by a function that returns a joint or a link.
struct LabelInfo {
  Text name;
  ValueType type = ValueType::kJoint;
  uint16_t function = 0;
};

struct RoutineInfo {
  Text name;
  uint16_t function = 0;
};

/// Events that a handler may run on.
enum class Event : uint8_t { kConnect, kDisconnect, kStall, kTimer };

struct HandlerInfo {
  Event event = Event::kConnect;
  uint16_t function = 0;
};

/// A role with all that it inherits; slots of fields, labels, commands are those of its base roles
/// followed by its own, so that code compiled for a base role runs under every subrole.
struct RoleInfo {
  Text name;
  int16_t parent = -1;  ///< Index of the role it extends; -1 for a direct child of Module.
  bool abstract_role = false;
  uint8_t num_fields = 0, num_labels = 0, num_requirements = 0, num_startups = 0;
  uint8_t num_behaviors = 0, num_commands = 0, num_handlers = 0, num_keywords = 0, num_methods = 0;
  Cell fields[kMaxFields];  ///< Initial values.
  ValueType field_types[kMaxFields] = {};
  LabelInfo labels[kMaxLabels];
  uint16_t requirements[kMaxRequirements] = {};  ///< Functions that return bool.
  RoutineInfo startups[kMaxRoutines];            ///< Base role's first, in declared order.
  RoutineInfo behaviors[kMaxRoutines];
  RoutineInfo commands[kMaxRoutines];  ///< Slot order.
  HandlerInfo handlers[kMaxRoutines];
  uint16_t methods[kMaxRoutines] = {};  ///< `function` members, slot order (dynamic dispatch).
  uint8_t keywords[kMaxKeywords] = {};  ///< Keywords that some code of the role needs.
};

/// Made only by the verifier (vm/verifier.h). Points into image bytes that the owner keeps alive
/// and unchanged; holds no heap memory.
class VerifiedProgram {
 public:
  [[nodiscard]] const uint8_t* bytes() const { return bytes_; }
  [[nodiscard]] uint32_t size() const { return size_; }
  [[nodiscard]] uint64_t hash() const { return hash_; }
  [[nodiscard]] uint32_t instruction_budget() const { return budget_; }
  [[nodiscard]] uint16_t settle_ticks() const { return settle_ticks_; }
  [[nodiscard]] int num_roles() const { return num_roles_; }
  [[nodiscard]] const RoleInfo& role(int i) const { return roles_[i]; }
  [[nodiscard]] int num_functions() const { return num_functions_; }
  [[nodiscard]] const FunctionInfo& function(int i) const { return functions_[i]; }
  [[nodiscard]] int num_keywords() const { return num_keywords_; }
  [[nodiscard]] const KeywordInfo& keyword(int i) const { return keywords_[i]; }
  /// Value i of the constant table (vm/image.h); inline because programs push constants often.
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

 private:
  friend class Verifier;
  const uint8_t* bytes_ = nullptr;
  uint32_t size_ = 0;
  uint64_t hash_ = 0;
  uint32_t budget_ = 0;
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
