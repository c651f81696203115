#pragma once
// The words of DynaRole for people who write it: what begins roles, members and statements, and
// what the language offers, each in a line (docs/dynarole.md has the whole).

#include <span>
#include <string_view>

namespace morphbus::tools {

/// Where a word may stand.
enum class WordPlace { kProgram, kRole, kTask, kValue };

/// A word of the language with a snippet for what it begins, and what it means.
struct ProgramWord {
  WordPlace place;
  std::string_view word;
  std::string_view snippet;
  std::string_view meaning;
};
std::span<const ProgramWord> ProgramWords();

/// What a function, a direction or something of `self` does, by its name as it is written; empty if
/// there is none of that name.
std::string_view BuiltinMeaning(std::string_view name);

}  // namespace morphbus::tools
