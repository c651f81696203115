#pragma once
// The names of a text: what each one means, where that is declared, and everywhere else it stands.
// The compilers of both languages fill it in for editors (m3l/name_index.h, dynarole/name_index.h).

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "compiler/source/source_text.h"

namespace morphbus::source {

/// The kinds of things that have names.
enum class NameKind : uint8_t {
  // Of M3L.
  kModule,
  kPoint,
  /// Sub-points of one name in one module are one thing: conditions name them for all connectors.
  kSubpoint,
  /// An attribute of a module's connectors, likewise.
  kAttribute,
  kLink,
  kAxis,
  kJoint,
  kSensor,
  kConnection,
  /// A member of a connection, `MTRAN a`.
  kMember,
  /// The connector of a member, `a.point p`.
  kBinder,
  kRobot,
  /// A module of a robot, `MTRAN m1`.
  kInstance,
  // Of both languages.
  kConstant,
  // Of DynaRole.
  kParameter,
  kRole,
  kField,
  kLabel,
  kStartup,
  kBehavior,
  kCommand,
  kHandler,
  kFunction,
  /// A variable of a routine, or one that it is called with.
  kVariable,
  /// An enumeration, whose values are constants.
  kEnumeration,
  /// A part of a module type, by its keyword: `JOINT_1`, `LINK_BAR`, `C1`.
  kKeyword,
  /// What the language itself offers.
  kBuiltin,
};

/// A thing that has a name.
struct NamedThing {
  NameKind kind = NameKind::kModule;
  std::string name;
  /// All of its first declaration, name included; a file of -1 for what no text declares.
  Span extent{-1, 0, 0};
  /// The thing that it is a part of: of a joint its module, of a field its role; -1 for none.
  int owner = -1;
  /// The module of an instance, member or binder; the role that a role extends; -1 for none.
  int base = -1;
  /// One line for people, without the kind: "speed: float = 30", "sin(degrees)".
  std::string summary;
  /// Of a role: the conditions of its own requirements, as they are written.
  std::vector<std::string> requirements = {};
};

/// A place where a name stands.
struct NameUse {
  Span span;
  /// Index into NameTable::things.
  int thing = -1;
  /// Whether the thing is declared here. Some things are declared in several places, such as a
  /// function that subroles replace; the first is the one to show.
  bool declares = false;
};

/// A type that nobody wrote.
struct InferredType {
  /// The name that it belongs to.
  Span span;
  /// "float"
  std::string type;
};

/// All names of a compilation.
struct NameTable {
  std::vector<NamedThing> things;
  /// In the order of their places, once Sort was called.
  std::vector<NameUse> uses;
  std::vector<InferredType> inferred;

  /// Adds a thing without a place; returns its index.
  int Add(NameKind kind, std::string name, int owner = -1);
  /// Adds a thing and where it is declared.
  int Declare(NameKind kind, const std::string& name, const Span& span, int owner = -1);
  /// Notes that `thing` stands at `span`; -1, and an empty span, are left out.
  void Use(const Span& span, int thing, bool declares = false);
  /// Puts the uses into the order of their places, each once.
  void Sort();

  /// The use at, or that ends at, the byte `offset` of a file; null if there is none.
  [[nodiscard]] const NameUse* At(int file, size_t offset) const;
  /// The first part of `owner` of this kind and name; -1 if there is none.
  [[nodiscard]] int Find(NameKind kind, const std::string& name, int owner = -1) const;
};

}  // namespace morphbus::source
