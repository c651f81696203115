#include "tools/lsp/program_words.h"

namespace morphbus::tools {
namespace {

/// The words of the grammar by the place where they begin something, with what is inserted for
/// them. Directions of an example are escaped: an editor would take `$NORTH` for a place to fill
/// in.
constexpr ProgramWord kWords[] = {
    // What stands outside roles.
    {WordPlace::kProgram, "role", "role ${1:Name} extends ${2:Module} {\n  $0\n}",
     "what a module can be: requirements, labels, and what it then does"},
    {WordPlace::kProgram, "abstract role", "abstract role ${1:Name} extends ${2:Module} {\n  $0\n}",
     "a role that only others extend"},
    {WordPlace::kProgram, "import", "import \"${1:lib.dyn}\";",
     "what another file declares counts as if it stood here"},
    {WordPlace::kProgram, "const", "const ${1:name} = ${2:1};", "a value known at compile time"},
    {WordPlace::kProgram, "function", "function ${1:name}() {\n  $0\n}",
     "a function that every role has"},
    {WordPlace::kProgram, "enum", "enum ${1:Name} { ${2:FIRST}, ${3:SECOND} }",
     "ints with names, each one more than the one before"},
    // Members of a role.
    {WordPlace::kRole, "enum", "enum ${1:Name} { ${2:FIRST}, ${3:SECOND} }",
     "ints with names, each one more than the one before"},
    {WordPlace::kProgram, "param", "param ${1:name} = ${2:30.0} in [${3:0}, ${4:90}];",
     "a number that a run may choose"},
    {WordPlace::kRole, "require", "require ${1:self.connected(\\$NORTH) == 1};",
     "what must hold for a module to take the role"},
    {WordPlace::kRole, "label", "label ${1:name} = ${2:self.joints(\\$UP_DOWN, 2)};",
     "a name for a joint or a link, found by how the robot is built"},
    {WordPlace::kRole, "startup", "startup ${1:start}() {\n  $0\n}", "runs when the role is taken"},
    {WordPlace::kRole, "behavior", "behavior ${1:move}() {\n  $0\n}",
     "repeats as long as the role is held"},
    {WordPlace::kRole, "command", "command ${1:name}() {\n  $0\n}",
     "runs when a module invokes it, on all that play the role"},
    {WordPlace::kRole, "handler", "handler ${1:on_stall}() {\n  $0\n}",
     "runs on an event: on_connect, on_disconnect, on_stall, on_timer, or `every` so many seconds"},
    {WordPlace::kRole, "function", "function ${1:name}() {\n  $0\n}", "is called by the others"},
    {WordPlace::kRole, "shared", "shared ${1:name} = ${2:0.0};",
     "a field that neighbours may read"},
    {WordPlace::kRole, "kept", "kept ${1:name} = ${2:0};",
     "a field whose value outlives a change of role or program"},
    {WordPlace::kRole, "trace", "trace ${1:field};", "tells the field's value in every tick"},
    {WordPlace::kRole, "const", "const ${1:name} = ${2:1};", "a value known at compile time"},
    {WordPlace::kRole, "param", "param ${1:name} = ${2:30.0} in [${3:0}, ${4:90}];",
     "a number that a run may choose"},
    // Statements.
    {WordPlace::kTask, "if", "if (${1:condition}) {\n  $0\n}",
     "runs the block if the condition holds"},
    {WordPlace::kTask, "else", "else {\n  $0\n}", "runs the block if the condition does not hold"},
    {WordPlace::kTask, "switch", "switch (${1:value}) {\n  case ${2:1}:\n    $0\n  default:\n}",
     "runs the block of the case that fits; none goes on into the next"},
    {WordPlace::kTask, "while", "while (${1:condition}) {\n  $0\n}",
     "repeats while the condition holds"},
    {WordPlace::kTask, "for", "for (var ${1:i} = 0; $1 < ${2:3}; $1 += 1) {\n  $0\n}",
     "counts rounds"},
    {WordPlace::kTask, "for in", "for (${1:n} in self.connected(\\$ANY, \\$${2:Role})) {\n  $0\n}",
     "a round for each neighbour that plays the role"},
    {WordPlace::kTask, "var", "var ${1:name} = ${2:0};", "a variable of the block"},
    {WordPlace::kTask, "return", "return;", "ends the routine"},
    {WordPlace::kTask, "break", "break;", "leaves the innermost loop"},
    {WordPlace::kTask, "continue", "continue;", "goes on with the loop's next round"},
    {WordPlace::kTask, "print", "print(\"${1:text}\", ${2:value});",
     "a line with the module, its role, the time and the source line"},
    {WordPlace::kTask, "super", "super.${1:name}();", "calls what this member replaces"},
    // What stands for a value.
    {WordPlace::kValue, "self", "self.", "the module that runs the program"},
    {WordPlace::kValue, "true", "true", "the bool"},
    {WordPlace::kValue, "false", "false", "the bool"},
    {WordPlace::kValue, "sizeof", "sizeof(${1:set})",
     "how many members a set or elements an array has"},
};

/// A form of the language (compiler/dynarole/builtins.h) in one sentence, as hovers and lists show
/// it.
struct Meaning {
  std::string_view name;
  std::string_view meaning;
};

constexpr Meaning kMeanings[] = {
    // What `self` has.
    {"connected",
     "the neighbours; with a direction those that lie towards it, at least 15° out of the plane "
     "square to it; with a role those that also play it"},
    {"joints", "the own joint, or joints, along the axis with n adjacent joints"},
    {"links", "the own link, or links, whose body has n joints"},
    {"center", "the axis along which the only joint of a one-joint module lies"},
    {"setJointAxis",
     "from now on positive values turn the link, relative to the joint's other link, "
     "counter-clockwise about the axis"},
    {"jointRotateDegrees",
     "turns by so many degrees from the present target; returns when it has arrived"},
    {"jointRotateDegreesNonBlocking",
     "turns by so many degrees from the present target; returns at once"},
    {"jointSetDegrees", "turns to so many degrees; returns when it has arrived"},
    {"jointSetDegreesNonBlocking", "turns to so many degrees; returns at once"},
    {"jointDegrees", "the present angle, in degrees"},
    {"jointVelocity",
     "how fast the joint moves under the convention: degrees or millimetres a second"},
    {"jointEffort", "what the motor exerted in the last tick: N·m, of a prismatic joint N"},
    {"turnContinuous", "turns endlessly at so many degrees a second"},
    {"jointMoveMillimetres",
     "moves a prismatic joint by so many millimetres; returns when it has arrived"},
    {"jointMoveMillimetresNonBlocking",
     "moves a prismatic joint by so many millimetres; returns at once"},
    {"jointSetMillimetres",
     "moves a prismatic joint to so many millimetres; returns when it has arrived"},
    {"jointSetMillimetresNonBlocking",
     "moves a prismatic joint to so many millimetres; returns at once"},
    {"jointMillimetres", "where a prismatic joint is, in millimetres"},
    {"sleepds", "waits so many tenths of a second of simulated time"},
    {"sleepcs", "waits so many hundredths of a second of simulated time"},
    {"time", "the root's time in seconds, a float"},
    {"ms", "the root's time in whole milliseconds, an int"},
    {"hops", "the number of connections between this module and the root"},
    {"id",
     "the number of the module; what a program does with it no longer follows from its place"},
    {"role", "the role that the module plays"},
    {"place", "where the module is along an axis of the robot frame, in millimetres"},
    {"heading", "degrees by which the module is turned about up in the robot frame"},
    {"distance",
     "millimetres to what the own distance sensor sees that looks most nearly that way; its range "
     "if nothing"},
    {"contact", "whether something touches an own contact sensor that looks that way"},
    {"tilt", "degrees by which the robot frame is turned about the axis against gravity"},
    {"sin", "the sine of degrees"},
    {"cos", "the cosine of degrees"},
    {"tan", "the tangent of degrees"},
    {"asin", "the angle in degrees whose sine is x"},
    {"acos", "the angle in degrees whose cosine is x"},
    {"atan2", "the angle in degrees of the point (x, y)"},
    {"sqrt", "the square root"},
    {"abs", "the amount without its sign"},
    {"min", "the lesser of two numbers, or the least value of a field over neighbours"},
    {"max", "the greater of two numbers, or the greatest value of a field over neighbours"},
    {"sum", "the sum of a field over all neighbours in a set that have told it"},
    {"count", "how many neighbours in a set have told their fields, or have a bool true"},
    {"any", "whether a neighbour in a set has the bool true"},
    {"all", "whether no neighbour in a set has the bool false"},
    {"floor", "the greatest whole number that is not above x, an int"},
    {"round", "the nearest whole number, halves away from zero, an int"},
    {"int", "the number without what stands behind its point, as an int"},
    {"float", "the number as a float"},
    {"sign", "1 of what is above 0, -1 of what is below, else 0"},
    {"exp", "e to the power of x"},
    {"log", "the natural logarithm"},
    {"pow", "x to the power of y"},
    {"clamp", "x, or the end of the range that it is beyond"},
    {"PI", "3.14159265"},
    {"random", "a number drawn evenly from the range, the same in each run with the same seed"},
    {"axis", "the axis along a direction"},
    {"AXIS", "the axis along which the joint lies"},
    {"SET_POSITION", "the raw actuator: degrees without the convention"},
    {"GET_POSITION", "the raw actuator: degrees without the convention"},
    {"CONNECTED", "whether something is docked to the connector"},
    {"GET_DISTANCE", "millimetres to what the sensor sees"},
    {"GET_CONTACT", "whether something touches the sensor"},
    {"GET_TILT", "degrees between the sensor's direction and straight up"},
    {"print", "a line with the module, its role, the time and the source line"},
    {"sizeof", "how many members a set or elements an array has"},
    // Directions and axes: robot frames are NUE, +X north, +Y up, +Z east.
    {"$ANY", "every direction, or every axis"},
    {"$NORTH", "the direction +X of the robot frame"},
    {"$SOUTH", "the direction -X of the robot frame"},
    {"$EAST", "the direction +Z of the robot frame"},
    {"$WEST", "the direction -Z of the robot frame"},
    {"$UP", "the direction +Y of the robot frame"},
    {"$DOWN", "the direction -Y of the robot frame"},
    {"$NORTH_SOUTH", "the axis X of the robot frame; to turn about it means about north"},
    {"$UP_DOWN", "the axis Y of the robot frame; to turn about it means about up"},
    {"$EAST_WEST", "the axis Z of the robot frame; to turn about it means about east"},
};

}  // namespace

std::span<const ProgramWord> ProgramWords() { return kWords; }

std::string_view BuiltinMeaning(std::string_view name) {
  for (const Meaning& meaning : kMeanings) {
    if (meaning.name == name) return meaning.meaning;
  }
  return {};
}

}  // namespace morphbus::tools
