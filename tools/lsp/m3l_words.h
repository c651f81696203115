#pragma once
// The words of M3L for people who write it: what may stand in each kind of definition, and what it
// means, in a line (docs/m3l.md has the whole).

#include <span>
#include <string_view>

namespace morphbus::tools {

/// What an attribute's numbers measure, so that they can be told in SI units.
enum class ValueUnit { kNone, kLength, kAngle, kMass, kEffort, kSpeed, kTime };

/// An attribute that a kind of definition may have.
struct AttributeWord {
  /// The word of the definition: "module", "joint"; of a part of a hull "box".
  std::string_view definition;
  std::string_view name;
  /// How its value is written, as an editor's snippet: `[${1:-pi/2}, ${2:pi/2}]`. Empty for a flag.
  std::string_view value;
  /// What it means.
  std::string_view meaning;
  ValueUnit unit = ValueUnit::kNone;
};

/// All attributes, those of a definition in the order in which people write them.
std::span<const AttributeWord> AttributeWords();
/// The attribute of a definition; null if there is none of that name.
const AttributeWord* FindAttributeWord(std::string_view definition, std::string_view name);

/// A word with a snippet for what it begins, and what it means: definitions, parts of hulls,
/// functions, relations.
struct ModelWord {
  std::string_view word;
  std::string_view snippet;
  std::string_view meaning;
};
/// Where a statement begins.
std::span<const ModelWord> StatementWords();
/// Parts of hulls, which stand in `hull=`.
std::span<const ModelWord> HullWords();
/// Relations and connectives of conditions.
std::span<const ModelWord> ConditionWords();

}  // namespace morphbus::tools
