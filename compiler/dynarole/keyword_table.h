#pragma once
// The keywords that module types add to the language: links, joints, connectors and their states.

#include <cstdint>
#include <string>
#include <vector>

#include "vm/program.h"

namespace morphbus::dynarole {

struct Keyword {
  vm::KeywordKind kind = vm::KeywordKind::kLink;
  std::string spelling;  ///< As programs write it: LINK_CONNECTING_BAR, JOINT_1, C1, EXTENDED.
  std::string name;      ///< As images store it: without the LINK_ of a link.
  uint64_t types = 0;    ///< Bits of the module types that have it.
  /// State variables: set with a bool, or with the number of one of their values, as the module
  /// types that have them say.
  bool takes_bool = true;
  bool takes_int = false;
};

/// All keywords of all module types given, merged by kind and name.
class KeywordTable {
 public:
  /// Adds a keyword of module type number `type` (0...63). `takes_bool`: see Keyword.
  void Add(int type, vm::KeywordKind kind, const std::string& spelling, const std::string& name,
           bool takes_bool);

  [[nodiscard]] const std::vector<Keyword>& all() const { return all_; }
  /// Index of the keyword, -1 if no module type has it.
  [[nodiscard]] int Find(vm::KeywordKind kind, const std::string& spelling) const;
  /// Spellings of one kind, for suggestions.
  [[nodiscard]] std::vector<std::string> Spellings(vm::KeywordKind kind) const;
  /// Module types known; at most 64.
  std::vector<std::string> type_names;

 private:
  std::vector<Keyword> all_;
};

}  // namespace morphbus::dynarole
