#pragma once
// The words that every program may use: the directions and axes behind '$', functions, what `self`
// offers, and what joints, connectors and sensors offer behind a dot. One table each.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "compiler/dynarole/types.h"
#include "vm/image/opcodes.h"

namespace morphbus::dynarole {

/// A direction or axis, which programs write behind '$'. Directions are those of the world: north,
/// up, east. An axis is a direction without its sense.
struct NamedDirection {
  const char* name;
  Type type;  ///< kDirection, kAxis, or kAny for `$ANY`, which is either.
  int value;  ///< The vm::Direction or vm::Axis.
};

/// All of them; names of parts of the module, which are behind '$' too, come from the keyword
/// table.
inline constexpr NamedDirection kDirections[] = {
    {"ANY", Type::kAny, 0},
    {"NORTH", Type::kDirection, static_cast<int>(vm::Direction::kNorth)},
    {"SOUTH", Type::kDirection, static_cast<int>(vm::Direction::kSouth)},
    {"EAST", Type::kDirection, static_cast<int>(vm::Direction::kEast)},
    {"WEST", Type::kDirection, static_cast<int>(vm::Direction::kWest)},
    {"UP", Type::kDirection, static_cast<int>(vm::Direction::kUp)},
    {"DOWN", Type::kDirection, static_cast<int>(vm::Direction::kDown)},
    {"NORTH_SOUTH", Type::kAxis, static_cast<int>(vm::Axis::kNorthSouth)},
    {"UP_DOWN", Type::kAxis, static_cast<int>(vm::Axis::kUpDown)},
    {"EAST_WEST", Type::kAxis, static_cast<int>(vm::Axis::kEastWest)},
};

/// The direction or axis of that name, null if there is none.
const NamedDirection* FindDirection(std::string_view name);

/// The function of the language that is two instructions, kMax and kMin.
inline constexpr const char* kClamp = "clamp";

/// A number that every program knows by its name, unless it has something of its own there.
inline constexpr std::string_view kPiName = "PI";
inline constexpr float kPi = 3.14159265f;

/// Which joints a call can move: any, revolute and continuous ones, or prismatic ones.
enum class Motion : uint8_t { kAny, kTurns, kSlides };

/// One form of a call or property: a row of a table that is built once. Forms of one name differ in
/// their numbers of arguments, by which the checker picks one.
struct Builtin {
  const char* name;
  /// A letter for the type of each argument, as in vm/image/opcodes.def, without the base.
  const char* arguments;
  /// The instruction that it is translated to, after the code of its arguments.
  vm::Opcode opcode;
  /// Whether it may stand without parentheses, as JOINT.AXIS does.
  bool property;
  /// The whole form as messages show it, such as "self.connected(direction)".
  const char* usage;
  /// What its first argument, a joint, must be able to do.
  Motion motion = Motion::kAny;
  /// The name of the call that does the same with joints that move in the other way.
  const char* counterpart = nullptr;
};

/// Forms of `self.NAME`: the paper's calls (Secs. III and V) and those that docs/dynarole.md adds.
/// Several may share a name (self.connected).
const std::vector<Builtin>& SelfBuiltins();
/// Functions of the language, which are called without a dot: mathematics, random, axis.
const std::vector<Builtin>& FunctionBuiltins();
/// Functions of a field that all neighbours in a set share, sum(SET.NAME): walks over them, with
/// code of their own. Of two numbers, min and max are in FunctionBuiltins.
const std::vector<Builtin>& NeighbourBuiltins();
/// Forms of `JOINT.NAME`, the raw actuator.
const std::vector<Builtin>& JointBuiltins();

/// `CONNECTOR.CONNECTED`.
const std::vector<Builtin>& ConnectorBuiltins();

/// Readings of a sensor that is named, `self.SENSOR.GET_DISTANCE()`, in the order of
/// vm::SensorKind.
const std::vector<Builtin>& SensorBuiltins();

/// Names of a table, each once and in its order, for suggestions where a program writes none of
/// them.
std::vector<std::string> NamesOf(const std::vector<Builtin>& builtins);
/// Names as messages list them: "a, b, c".
std::string Listed(const std::vector<std::string>& names);
/// The forms of that name as messages show them, "self.connected or self.connected(direction)";
/// empty if the table has none.
std::string UsagesOf(const std::vector<Builtin>& builtins, std::string_view name);
/// The forms of all names that begin with these letters, at least three, with "' or '" between
/// them.
std::string UsagesBeginning(const std::vector<Builtin>& builtins, const std::string& name);

}  // namespace morphbus::dynarole
