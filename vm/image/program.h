#pragma once
// A program image after verification: the only form in which the VM accepts a program.

#include <cstdint>

#include "vm/image/image.h"
#include "vm/image/values.h"
#include "vm/limits.h"

namespace morphbus::vm {

/// A text inside the image, which must outlive it; it is not NUL-terminated.
struct Text {
  const char* data = nullptr;
  uint16_t size = 0;
};

/// The text whose record is at `at`, in the strings that begin at `strings`.
inline Text TextAt(const uint8_t* strings, const uint8_t* at) {
  return {reinterpret_cast<const char*>(strings) + image::ReadU16(at), at[2]};
}

/// What a keyword of the module type's XML names: a part of the module, a state of a connector, or
/// any sensor that measures something (kSensorKindNames).
enum class KeywordKind : uint8_t {
  kLink,
  kJoint,
  kConnector,
  kConnectorState,
  kSensor,
  kSensorKind,
};

/// What a sensor measures.
enum class SensorKind : uint8_t { kDistance, kContact, kTilt };
/// The keywords of kind kSensorKind, in the order of SensorKind: a role that asks for a sensor by
/// where it looks needs one of these.
inline constexpr Text kSensorKindNames[] = {
    {"DISTANCE_SENSOR", 15}, {"CONTACT_SENSOR", 14}, {"TILT_SENSOR", 11}};

/// A keyword, bound by name to a module type when an image is loaded.
struct KeywordInfo {
  KeywordKind kind = KeywordKind::kLink;
  /// The name in capitals, as in the program: CONNECTING_BAR, JOINT_1, C1, EXTENDED.
  Text name;
};

/// Types that functions share, straight out of the image.
class TypeTable {
 public:
  /// `at`: the first type's byte in the image.
  explicit TypeTable(const uint8_t* at = nullptr) : at_(at) {}
  /// Type i; how many there are the function says.
  ValueType operator[](int i) const { return static_cast<ValueType>(at_[i]); }

 private:
  const uint8_t* at_;
};

/// A function of the program: requirement, label, startup, behavior, command, handler, function.
/// Read from its record where it is asked for.
struct FunctionInfo {
  /// Where its code lies: the offset in the image and the size (bytes).
  uint32_t code_begin = 0;
  uint32_t code_size = 0;
  /// The role in whose braces it stands.
  uint8_t role = 0;
  /// How many of its locals are arguments.
  uint8_t num_arguments = 0;
  /// How many locals it has, arguments included.
  uint8_t num_locals = 0;
  /// The type of its result, and those of its locals.
  ValueType return_type = ValueType::kVoid;
  TypeTable local_types;
};

/// Numbers of functions in a role's record.
class ReferenceTable {
 public:
  explicit ReferenceTable(const uint8_t* at) : at_(at) {}
  /// The number of function i of the table.
  uint16_t operator[](int i) const { return image::ReadU16(at_ + 2 * i); }

 private:
  const uint8_t* at_;
};

/// The values of fields when the role is taken, and their types, in a role's record.
class FieldTable {
 public:
  FieldTable(const uint8_t* at, const uint8_t* constants) : at_(at), constants_(constants) {}
  /// The value that field i begins with, and its type.
  Cell operator[](int i) const { return Cell{image::ReadU32(ConstantOf(i) + 1)}; }
  [[nodiscard]] ValueType type(int i) const {
    return static_cast<ValueType>(*ConstantOf(i) & ~image::kParameterBit);
  }
  /// True if neighbours may read the field.
  [[nodiscard]] bool shared(int i) const { return HasBit(i, image::kSharedFieldBit); }
  /// True if its value outlives a change of role or program.
  [[nodiscard]] bool kept(int i) const { return HasBit(i, image::kKeptFieldBit); }
  /// The number of the constant that is the name of a kept field.
  [[nodiscard]] int name_constant(int i) const { return ConstantNumber(i) + 1; }
  /// True if its value is told in every tick.
  [[nodiscard]] bool traced(int i) const { return HasBit(i, image::kTracedFieldBit); }

 private:
  /// The record of the constant that field i begins with: a byte for its type, four for its value.
  [[nodiscard]] const uint8_t* ConstantOf(int i) const {
    return constants_ + static_cast<uint32_t>(ConstantNumber(i)) * image::kConstantBytes;
  }
  [[nodiscard]] int ConstantNumber(int i) const {
    return image::ReadU16(at_ + 2 * i) & image::kFieldConstantMask;
  }
  [[nodiscard]] bool HasBit(int i, int bit) const {
    return (image::ReadU16(at_ + 2 * i) & bit) != 0;
  }
  const uint8_t* at_;
  const uint8_t* constants_;
};

/// Events that a handler may run on: a neighbour docks or leaves, a joint gets stuck on its way, or
/// a timer's period is over.
enum class Event : uint8_t { kConnect, kDisconnect, kStall, kTimer };

/// A handler: it is known by its event and has no name.
struct HandlerInfo {
  Event event = Event::kConnect;
  /// True if it runs during startup too.
  bool early = false;
  /// The number of the function that it runs.
  uint16_t function = 0;
  /// Of a timer: how often it runs (µs).
  int64_t period_us = 0;
};

/// The handlers in a role's record.
class HandlerTable {
 public:
  HandlerTable(const uint8_t* at, const uint8_t* constants) : at_(at), constants_(constants) {}
  /// Handler i, put together from its record and the constant that its period is.
  HandlerInfo operator[](int i) const;

 private:
  const uint8_t* at_;
  const uint8_t* constants_;
};

/// A file that a program imports and has code from.
struct ImportedFile {
  /// As it lies from the folder of the program's own file.
  Text name;
  /// Its first line as LineOf counts it.
  int first_line = 0;
};

/// A parameter of the program: a constant whose value a run may choose.
struct ParameterInfo {
  /// Its number among the constants.
  int constant = 0;
  /// As `run --set` names it: alone, or with the role in which it stands, "Leg.swing".
  Text name;
  /// An int or a float; all four values are of it.
  ValueType type = ValueType::kVoid;
  /// The value of this image, and that of the source.
  Cell value = {}, source_value = {};
  /// The range that the source allows, both ends included.
  Cell least = {}, most = {};
};

/// A role with all that it inherits; slots of fields, labels, commands are those of its base roles
/// followed by its own, so that code compiled for a base role runs under every subrole. Its tables
/// are read straight out of the image.
struct RoleInfo {
  /// Reads the record at `at`; `strings` and `constants` are where those sections begin.
  RoleInfo(const uint8_t* at, const uint8_t* strings, const uint8_t* constants);

  /// As the program calls it.
  Text name;
  /// The index of the role that it extends; -1 for a direct child of Module.
  int16_t parent;
  /// True if no module plays it, only roles that extend it.
  bool abstract_role;
  /// How many roles it extends.
  uint8_t depth;
  /// How many entries the tables below have.
  uint8_t num_fields, num_labels, num_requirements, num_startups;
  uint8_t num_behaviors, num_commands, num_handlers, num_methods;
  /// The fields' values when the role is taken, and their types.
  FieldTable fields;
  /// The labels; resolving one runs its function, which returns the joint or link.
  ReferenceTable labels;
  /// The functions that must all return true for the role to be taken.
  ReferenceTable requirements;
  /// The startups, those of the base role first, each in declared order.
  ReferenceTable startups;
  /// The behaviors, which repeat while the role is held.
  ReferenceTable behaviors;
  /// The commands by slot, which invocations name.
  ReferenceTable commands;
  /// The handlers, which run on events.
  HandlerTable handlers;
  /// The `function` members by slot; calls go through it (dynamic dispatch).
  ReferenceTable methods;

  /// A bit for each field that neighbours may read.
  [[nodiscard]] uint32_t shared_fields() const;
  /// Calls visit(function) for every function that the role refers to, inherited ones included.
  template <class Visit>
  void ForEachFunction(const Visit& visit) const {
    for (int i = 0; i < num_labels; ++i) visit(labels[i]);
    for (int i = 0; i < num_requirements; ++i) visit(requirements[i]);
    for (int i = 0; i < num_startups; ++i) visit(startups[i]);
    for (int i = 0; i < num_behaviors; ++i) visit(behaviors[i]);
    for (int i = 0; i < num_commands; ++i) visit(commands[i]);
    for (int i = 0; i < num_handlers; ++i) visit(handlers[i].function);
    for (int i = 0; i < num_methods; ++i) visit(methods[i]);
  }
};

/// Made only by the verifier (vm/image/verifier.h). Points into image bytes that the owner keeps
/// alive and unchanged, also flash, and reads its tables straight out of them; holds no heap
/// memory.
class VerifiedProgram {
 public:
  /// The image itself, with its notes if it has any; size() is 0 while there is no verified image.
  [[nodiscard]] const uint8_t* bytes() const { return bytes_; }
  [[nodiscard]] uint32_t size() const { return size_; }
  /// Bytes of the part that modules run, which is all that a module must hold.
  [[nodiscard]] uint32_t run_size() const { return image::ReadU32(bytes_ + image::kSizeAt); }
  /// The hash that names the program among modules (image::HashOf).
  [[nodiscard]] uint64_t hash() const { return hash_; }
  /// Cost units that all tasks of a module may use in one tick.
  [[nodiscard]] uint32_t instruction_budget() const { return budget_; }
  /// Ticks for which the surroundings must be the same before roles are decided on them.
  [[nodiscard]] uint16_t settle_ticks() const { return settle_ticks_; }
  /// Roles, functions and keywords by their numbers in the image.
  [[nodiscard]] int num_roles() const { return num_roles_; }
  [[nodiscard]] RoleInfo role(int i) const {
    return {bytes_ + role_at_[i], bytes_ + image::kHeaderBytes, bytes_ + constants_begin_};
  }
  /// A bit for each keyword that some code of the role needs; a module type without one cannot take
  /// it.
  [[nodiscard]] uint64_t keywords_of_role(int i) const { return role_keywords_[i]; }
  [[nodiscard]] int num_functions() const { return num_functions_; }
  /// Inline because programs call functions often.
  [[nodiscard]] FunctionInfo function(int i) const {
    const uint8_t* at =
        bytes_ + functions_begin_ + static_cast<uint32_t>(i) * image::kFunctionBytes;
    const uint32_t begin = image::ReadU16(at);
    const uint32_t end =
        i + 1 < num_functions_ ? image::ReadU16(at + image::kFunctionBytes) : code_size_;
    const uint32_t signature = image::ReadU16(at + image::kFunctionSignatureAt);
    return {code_begin_ + begin,
            end - begin,
            at[image::kFunctionRoleAt],
            static_cast<uint8_t>(signature >> 4 & 31),
            static_cast<uint8_t>(signature >> 9 & 31),
            static_cast<ValueType>(signature & 15),
            TypeTable(bytes_ + types_begin_ + image::ReadU16(at + image::kFunctionTypesAt))};
  }
  [[nodiscard]] int num_keywords() const { return num_keywords_; }
  [[nodiscard]] KeywordInfo keyword(int i) const {
    const uint8_t* at = bytes_ + keywords_begin_ + static_cast<uint32_t>(i) * image::kKeywordBytes;
    return {static_cast<KeywordKind>(at[0]), TextAt(bytes_ + image::kHeaderBytes, at + 1)};
  }
  /// Type and value i of the constant table (vm/image/image.h); inline because programs push
  /// constants often.
  [[nodiscard]] ValueType constant_type(int i) const {
    return static_cast<ValueType>(ConstantAt(i)[0] & ~image::kParameterBit);
  }
  [[nodiscard]] Cell constant(int i) const { return Cell{image::ReadU32(ConstantAt(i) + 1)}; }
  /// Constant i, which is a text.
  [[nodiscard]] Text text(int i) const;
  /// True if constant i is a parameter, whose value a run may choose.
  [[nodiscard]] bool is_parameter(int i) const {
    return (ConstantAt(i)[0] & image::kParameterBit) != 0;
  }
  /// How many constants there are.
  [[nodiscard]] int num_constants() const { return static_cast<int>(num_constants_); }
  /// True if these are acceptable arguments of a function: right count, each a value of its type.
  /// For invocations, whose arguments come from other modules.
  [[nodiscard]] bool AcceptsArguments(int function, const Cell* arguments, int count) const;
  /// True if the programs have the same code and differ in values of parameters at most: what one
  /// has begun the other one can go on with.
  [[nodiscard]] bool SameButForParameters(const VerifiedProgram& other) const;
  /// True if `role` is `ancestor` or extends it, directly or not.
  [[nodiscard]] bool IsA(int role, int ancestor) const;

  // The notes, for people (vm/image/notes.cc). Without them names are empty and lines 0.
  [[nodiscard]] bool has_notes() const { return notes_ != nullptr; }
  /// Name of the source file it was compiled from.
  [[nodiscard]] Text source_name() const;
  /// The name of a function with that of its role, e.g. "LegUpperHalf.move_thigh"; that of a label
  /// is the label's, and so on.
  [[nodiscard]] Text function_name(int function) const;
  /// The same without the role's.
  [[nodiscard]] Text member_name(int function) const;
  /// The name of a field, by its slot in the role.
  [[nodiscard]] Text field_name(int role, int field) const;
  /// The name of a parameter or variable of a function.
  [[nodiscard]] Text local_name(int function, int local) const;
  /// How many parameters the notes describe, and parameter i of them, in the order of the
  /// constants.
  [[nodiscard]] int num_parameters() const;
  [[nodiscard]] ParameterInfo parameter(int i) const;
  /// How many imported files have code of the program, and file i of them, in the order of their
  /// lines.
  [[nodiscard]] int num_imported_files() const;
  [[nodiscard]] ImportedFile imported_file(int i) const;
  /// Source line (1-based) of an instruction, 0 if unknown. `pc` is a byte offset in the function.
  /// Lines are counted on from file to file: that of an imported one is told by source_places.h.
  [[nodiscard]] int LineOf(int function, uint32_t pc) const;
  /// Source line of the first code that stands in a role itself, 0 if there is none. An image has
  /// no lines of declarations; this one lies in the role's braces, and is counted as by LineOf.
  [[nodiscard]] int LineOfRole(int role) const;

 private:
  /// The record of constant i: a byte for its type, four for its value.
  [[nodiscard]] const uint8_t* ConstantAt(int i) const {
    return bytes_ + constants_begin_ + static_cast<uint32_t>(i) * image::kConstantBytes;
  }

  // The verifier fills these in; the first two are what the rest points into.
  friend class Verifier;
  const uint8_t* bytes_ = nullptr;
  uint32_t size_ = 0;
  uint64_t hash_ = 0;
  uint32_t budget_ = 0;
  // Counts and begins of the sections, as in the image's header.
  uint16_t settle_ticks_ = 0;
  int num_roles_ = 0, num_functions_ = 0, num_keywords_ = 0;
  uint32_t keywords_begin_ = 0, constants_begin_ = 0, num_constants_ = 0;
  uint32_t types_begin_ = 0, functions_begin_ = 0, code_begin_ = 0, code_size_ = 0;
  /// The notes, and where their lines begin in them; null without notes.
  const uint8_t* notes_ = nullptr;
  uint32_t lines_begin_ = 0, num_lines_ = 0;
  /// Where each role's record begins in the image, and the keywords that it needs.
  uint16_t role_at_[kMaxRoles] = {};
  uint64_t role_keywords_[kMaxRoles] = {};
};

}  // namespace morphbus::vm
