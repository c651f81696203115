#include "vm/image/print_line.h"

#include <array>
#include <cstdio>

#include "vm/image/image_texts.h"
#include "vm/image/print_text.h"

namespace morphbus::vm {
namespace {

/// Six digits, as C writes them; the locale of numbers is C's everywhere here.
std::string FloatText(float value) {
  std::array<char, 32> text = {};
  std::snprintf(text.data(), text.size(), "%.6g", static_cast<double>(value));
  return text.data();
}

/// A part of the module by its name, or by its number where that is not known.
template <class NameOf>
std::string PartText(int index, int count, const NameOf& name_of) {
  // A value may come from another program or module type, of which this one has no such part.
  return index >= 0 && index < count ? ToString(name_of(index)) : std::to_string(index);
}

}  // namespace

std::string ValueText(const VerifiedProgram& program, const VerifiedKinematics* kin, ValueType type,
                      Cell cell) {
  // What a cell means its type alone says.
  const int index = cell.AsInt();
  switch (type) {
    case ValueType::kBool:
      return cell.AsBool() ? "true" : "false";
    case ValueType::kFloat:
      return FloatText(cell.AsFloat());
    case ValueType::kDirection:
      return cell.bits < kNumDirections ? kDirectionRows[cell.bits].name : std::to_string(index);
    case ValueType::kAxis:
      return cell.bits < kNumAxes ? kAxisRows[cell.bits].name : std::to_string(index);
    // Roles are the program's, parts the module type's.
    case ValueType::kRole:
      return PartText(index, program.num_roles(), [&](int i) { return program.role(i).name; });
    case ValueType::kJoint:
      return PartText(index, kin != nullptr ? kin->num_joints() : 0,
                      [&](int i) { return kin->joint(i).name; });
    case ValueType::kLink:
      return PartText(index, kin != nullptr ? kin->num_links() : 0,
                      [&](int i) { return kin->link(i).name; });
    case ValueType::kConnector:
      return PartText(index, kin != nullptr ? kin->num_connectors() : 0,
                      [&](int i) { return kin->connector(i).name; });
    default:
      return std::to_string(index);
  }
}

std::string PrintText(const VerifiedProgram& program, const VerifiedKinematics* kinematics,
                      int text, const Cell* values, int count) {
  // Numbers come from messages, perhaps of another program.
  PrintPlaces places;
  const bool known = text >= 0 && text < program.num_constants() &&
                     program.constant_type(text) == ValueType::kText &&
                     FindPlaces(program.text(text), &places) && places.count == count;
  // What cannot be put into its place is shown all the same.
  std::string line;
  if (!known) {
    for (int i = 0; i < count; ++i) line += (i > 0 ? " " : "") + std::to_string(values[i].AsInt());
    return line;
  }
  // From one brace to the next the text stands as it is.
  const Text characters = program.text(text);
  int next = 0;
  for (int i = 0; i < characters.size; ++i) {
    line += characters.data[i];
    if (characters.data[i] != '{') continue;
    // A brace that stands twice is one; any other holds the place of a value.
    if (characters.data[i + 1] == '{') {
      ++i;
      continue;
    }
    // The brace was taken over with the characters; the value stands in its place.
    line.pop_back();
    line += ValueText(program, kinematics, places.types[next], values[next]);
    ++next;
    i += 2;
  }
  return line;
}

}  // namespace morphbus::vm
