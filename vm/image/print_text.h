#pragma once
// Texts of `print` as images hold them. A value has its place in the text: its type's letter
// (vm/image/value_types.def) between braces, as in "knee {j} at {f}". A brace of the text itself
// stands twice: "{{".

#include "vm/image/program.h"

namespace morphbus::vm {

/// The values that a text has places for, in their order.
struct PrintPlaces {
  /// How many there are; 0 for a text that is printed as it stands.
  int count = 0;
  /// Their types, by which values are taken from the stack and written.
  ValueType types[kMaxPrintValues] = {};
};

/// Finds the places of a text; false if one is of no type that can be printed, if there are more
/// than kMaxPrintValues, or if a brace stands alone.
constexpr bool FindPlaces(Text text, PrintPlaces* places) {
  *places = {};
  for (int i = 0; i < text.size; ++i) {
    if (text.data[i] != '{') continue;
    // A brace that stands twice is one of the text.
    if (i + 1 < text.size && text.data[i + 1] == '{') {
      ++i;
      continue;
    }
    // Else it opens a place, which is one letter and the brace that closes it.
    if (i + 2 >= text.size || text.data[i + 2] != '}') return false;
    const ValueType type = TypeOfLetter(text.data[i + 1]);
    // Values that have a text. Sets have none, nor have texts themselves.
    const bool printable =
        (type > ValueType::kVoid && type <= ValueType::kLink) || type == ValueType::kConnector;
    if (!printable || places->count == kMaxPrintValues) return false;
    places->types[places->count++] = type;
    i += 2;
  }
  return true;
}

}  // namespace morphbus::vm
