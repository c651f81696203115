#include "tools/lsp/m3l_words.h"

#include <algorithm>

namespace morphbus::tools {
namespace {

constexpr AttributeWord kAttributes[] = {
    {"module", "unit", "${1:0.05}", "metres per model unit (default 1)"},
    {"module", "on_loss", "\"${1|limp,hold|}\"",
     "what its joints do once the module is dead: \"limp\" or \"hold\" (default \"limp\")"},
    {"point", "coords", "(${1:0}, ${2:0}, ${3:0})",
     "its place in the module's frame, in model units", ValueUnit::kLength},
    {"point", "connector", "", "it is a place where modules are mated"},
    {"point", "normal", "(${1:0}, ${2:0}, ${3:1})",
     "a direction, for parallel and antiparallel; of a connector the way out of the module"},
    {"link", "grouping", "(${1})", "names of the points that are on the link"},
    {"link", "hull", "convex(${1}.point)", "its shape: one convex part or several, joined by +"},
    {"link", "visual", "box(size=(${1:1}, ${2:1}, ${3:1}))",
     "how it looks: shapes as in hull, and meshes as they are, joined by + (default: its hull)"},
    {"link", "colour", "\"#${1:4d78a8}\"",
     "of what is seen of it (default: that of its module or role)"},
    {"link", "mass", "${1:0.1}", "its mass in kg (default: volume of the parts times 500 kg/m³)",
     ValueUnit::kMass},
    {"link", "friction", "${1:0.8}",
     "Coulomb friction where it touches something, 0 to 10 (default: that of the world)"},
    {"link", "mass_spread", "${1:0.02}",
     "by how much its mass differs from module to module: a standard deviation, as a fraction of "
     "the mass, 0 to 0.3"},
    {"axis", "origin", "(${1:0}, ${2:0}, ${3:0})", "a point on the axis, in model units",
     ValueUnit::kLength},
    {"axis", "direction", "(${1:0}, ${2:0}, ${3:1})",
     "the way it points; positive joint values turn about it, right-handed"},
    {"joint", "type", "${1|revolute,continuous,prismatic,fixed|}", "how it moves"},
    {"joint", "value", "[${1:-pi/2}, ${2:pi/2}]",
     "its limits: radians, or model units of a prismatic joint", ValueUnit::kAngle},
    {"joint", "pair", "((${1:arm}, ${2:out}), (${3:base}, ${4:in}))",
     "the two links it joins, each with its axis; the axes lie on one line and point opposite "
     "ways"},
    {"joint", "torque", "${1:1.9}", "the greatest torque (N·m), or force of a prismatic joint (N)",
     ValueUnit::kEffort},
    {"joint", "speed", "${1:pi}", "the greatest speed (rad/s), or model units a second",
     ValueUnit::kSpeed},
    {"joint", "backlash", "${1:1deg}", "how far the link can move without the motor",
     ValueUnit::kAngle},
    {"joint", "delay", "${1:0.02}", "how much later the motor does what it is told (s)",
     ValueUnit::kTime},
    {"sensor", "type", "${1|distance,contact,tilt|}", "what it measures"},
    {"sensor", "link", "${1}", "the link that carries it"},
    {"sensor", "origin", "(${1:0}, ${2:0}, ${3:0})", "where it sits, in model units",
     ValueUnit::kLength},
    {"sensor", "direction", "(${1:1}, ${2:0}, ${3:0})", "where it looks"},
    {"sensor", "range", "${1:2}",
     "how far it sees, or how far from it a touch counts, in model units", ValueUnit::kLength},
    {"sensor", "noise", "${1:0.01}",
     "the standard deviation of its readings: model units of a distance, radians of a tilt"},
    {"connection", "members", "(${1:TYPE} a, ${2:TYPE} b)", "the module types that it joins"},
    {"connection", "conditions", "(a.point ${1:p} coincident b.point ${2:q})",
     "when a connector of a and one of b are mated"},
    {"robot", "modules", "(${1:TYPE} ${2:m1})", "its modules, each a type and a name"},
    {"robot", "connections", "((${1:m1.c1}, ${2:m2.c1}))",
     "which connectors are docked; behind a pair may stand a number, rot=degrees or NAME:number"},
    {"robot", "frame",
     "(${1:m1.body}.(axis: origin=(0,0,0), direction=(1,0,0)), "
     "$1.(axis: origin=(0,0,0), direction=(0,1,0)), "
     "$1.(axis: origin=(0,0,0), direction=(0,0,1)))",
     "three axes on one link: +X north, +Y up, +Z east (default: the first module's first link)"},
    {"robot", "joints", "(${1:m1.joint}=${2:0})",
     "start values: radians, or model units of prismatic joints (default 0)", ValueUnit::kAngle},
    {"box", "size", "(${1:1}, ${2:1}, ${3:1})", "its sides along the module's axes, in model units",
     ValueUnit::kLength},
    {"box", "colour", "\"#${1:4d78a8}\"", "in visual: its own colour"},
    {"cylinder", "colour", "\"#${1:4d78a8}\"", "in visual: its own colour"},
    {"sphere", "colour", "\"#${1:4d78a8}\"", "in visual: its own colour"},
    {"mesh", "colour", "\"#${1:4d78a8}\"", "in visual: its own colour"},
    {"convex", "colour", "\"#${1:4d78a8}\"", "in visual: its own colour"},
    {"box", "at", "(${1:0}, ${2:0}, ${3:0})", "its middle, in model units (default the origin)",
     ValueUnit::kLength},
    {"cylinder", "radius", "${1:1}", "its radius in model units", ValueUnit::kLength},
    {"cylinder", "length", "${1:1}", "its length in model units", ValueUnit::kLength},
    {"cylinder", "axis", "${1}", "the axis of the module about which it lies"},
    {"cylinder", "at", "(${1:0}, ${2:0}, ${3:0})",
     "its middle, in model units (default: the axis' origin)", ValueUnit::kLength},
    {"cylinder", "sides", "${1:24}", "the number of its sides, 3 to 100 (default 24)"},
    {"sphere", "radius", "${1:1}", "its radius in model units", ValueUnit::kLength},
    {"sphere", "at", "(${1:0}, ${2:0}, ${3:0})", "its middle, in model units (default the origin)",
     ValueUnit::kLength},
};

constexpr ModelWord kStatements[] = {
    {"module", "module ${1:NAME}: unit=${2:0.05}\n\n$0", "a type of module"},
    {"point", "point ${1:c1}: coords=(${2:0}, ${3:0}, ${4:0})$0", "a feature of a module"},
    {"link", "link ${1:NAME}: grouping=(${2:c1}), hull=${3:box(size=(1, 1, 1))}, mass=${4:0.1}$0",
     "a rigid body of a module"},
    {"axis",
     "axis ${1:NAME}: origin=(${2:0}, ${3:0}, ${4:0}), direction=(${5:0}, ${6:0}, ${7:1})$0",
     "a line with a direction"},
    {"joint",
     "joint ${1:NAME}: type=${2|revolute,continuous,prismatic,fixed|}, value=[${3:-pi/2}, "
     "${4:pi/2}],\n  pair=((${5:arm}, ${6:out}), (${7:base}, ${8:in})), torque=${9:1.9}$0",
     "what moves one link against another"},
    {"sensor",
     "sensor ${1:NAME}: type=${2|distance,contact,tilt|}, link=${3:body}, origin=(${4:0}, ${5:0}, "
     "${6:0}), direction=(${7:1}, ${8:0}, ${9:0})$0",
     "what a module measures"},
    {"connection",
     "connection ${1:NAME}:\n  members=(${2:TYPE} a, ${3:TYPE} b),\n  conditions=(a.point p "
     "coincident b.point q$0)",
     "when two modules are mated"},
    {"robot",
     "robot ${1:NAME}:\n  modules=(${2:TYPE} m1, $2 m2),\n  connections=((m1.${3:c1}, "
     "m2.${4:c2}))$0",
     "an assembly of modules"},
    {"const", "const ${1:NAME} = ${2:0.05}$0", "a number that has a name"},
    {"import", "import \"${1:file.m3l}\"$0", "reads another file"},
};

constexpr ModelWord kHulls[] = {
    {"convex", "convex(${1}.point)", "the convex hull of points"},
    {"box", "box(size=(${1:1}, ${2:1}, ${3:1}), at=(${4:0}, ${5:0}, ${6:0}))", "a box"},
    {"cylinder", "cylinder(radius=${1:1}, length=${2:1}, axis=${3})", "a prism about an axis"},
    {"sphere", "sphere(radius=${1:1}, at=(${2:0}, ${3:0}, ${4:0}))", "a body of 66 corners"},
    {"mesh", "mesh(\"${1:file.stl}\")",
     "the convex hull of an STL file; in visual the mesh itself"},
};

constexpr ModelWord kConditions[] = {
    {"coincident", "coincident ", "the points meet"},
    {"parallel", "parallel ", "the normals or axes point the same way"},
    {"antiparallel", "antiparallel ", "the normals or axes point opposite ways"},
    {"and", "and ", "both hold"},
    {"or", "or ", "one of them holds"},
    {"not", "not ", "it does not hold"},
};

}  // namespace

std::span<const AttributeWord> AttributeWords() { return kAttributes; }
std::span<const ModelWord> StatementWords() { return kStatements; }
std::span<const ModelWord> HullWords() { return kHulls; }
std::span<const ModelWord> ConditionWords() { return kConditions; }

const AttributeWord* FindAttributeWord(std::string_view definition, std::string_view name) {
  const auto found = std::ranges::find_if(kAttributes, [&](const AttributeWord& word) {
    return word.definition == definition && word.name == name;
  });
  return found == std::end(kAttributes) ? nullptr : &*found;
}

}  // namespace morphbus::tools
