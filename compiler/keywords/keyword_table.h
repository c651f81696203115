#pragma once
// The keywords of all module types that a DynaRole program may meet, as its compiler looks them up.

#include <cstdint>
#include <string>
#include <vector>

#include "compiler/base/result.h"
#include "compiler/keywords/module_keywords.h"
#include "vm/image/program.h"

namespace morphbus::keywords {

/// One word of the language for a part of a module: the link, joint, connector or state variable
/// that each of the module types in `types` calls so.
struct Keyword {
  vm::KeywordKind kind = vm::KeywordKind::kLink;
  std::string spelling;     ///< As programs write it: LINK_CONNECTING_BAR, JOINT_1, C1, EXTENDED.
  std::string name;         ///< As images store it: without the LINK_ of a link.
  uint64_t types = 0;       ///< Bit i is set if module type i has it.
  bool takes_bool = false;  ///< State variables: some type sets it with a bool.
  bool takes_int = false;   ///< State variables: some type sets it with the number of a value.
  bool turns = false;       ///< Joints: it is revolute or continuous in some type.
  bool slides = false;      ///< Joints: it is prismatic in some type.
  /// Sensors: a bit, by vm::SensorKind, for each thing that it measures in some type.
  uint8_t measures = 0;
};

/// All keywords of all module types given, merged by kind and spelling: what one type calls C1 and
/// another calls C1 is one keyword, which every module binds to its own part when it loads a
/// program.
class KeywordTable {
 public:
  /// The table of these module types, which are numbered in this order. Fails for over 64 types, as
  /// Keyword::types has a bit for each.
  static Result<KeywordTable> Of(const std::vector<ModuleKeywords>& types);

  /// The keywords in the order in which the types have them, each where the first type has it.
  [[nodiscard]] const std::vector<Keyword>& all() const { return all_; }
  /// True if it was made of no module types, so that a program can use no keyword at all.
  [[nodiscard]] bool empty() const { return all_.empty(); }
  /// Index of the keyword in all(), -1 if no module type has it. `spelling` is compared as it is,
  /// capitals and all.
  [[nodiscard]] int Find(vm::KeywordKind kind, const std::string& spelling) const;
  /// Spellings of one kind, for suggestions.
  [[nodiscard]] std::vector<std::string> Spellings(vm::KeywordKind kind) const;

 private:
  /// Notes that module type number `type` has the keyword, and returns its entry, which is made if
  /// no type before had it; the reference is valid until the next call.
  Keyword& Add(int type, vm::KeywordKind kind, const std::string& spelling);

  std::vector<Keyword> all_;
};

}  // namespace morphbus::keywords
