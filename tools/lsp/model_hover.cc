#include "tools/lsp/model_hover.h"

#include <fmt/format.h>

#include <numbers>
#include <vector>

#include "compiler/base/text.h"
#include "compiler/m3l/evaluate.h"
#include "compiler/model/forward_kinematics.h"
#include "tools/base/model_io.h"
#include "tools/lsp/m3l_words.h"
#include "tools/lsp/model_places.h"
#include "tools/lsp/pictures.h"

namespace morphbus::tools {
namespace {

using source::NamedThing;
using source::NameKind;

constexpr double kPictureWidth = 320;
/// Robots have so many faces that the time to draw them counts.
constexpr double kRobotWidth = 240;
constexpr double kDegrees = 180.0 / std::numbers::pi;

std::string VectorText(const Eigen::Vector3d& v) {
  // Rounded to a micrometre, and without a negative zero.
  const auto tidy = [](double x) { return std::abs(x) < 5e-7 ? 0.0 : x; };
  return fmt::format("({:.5g}, {:.5g}, {:.5g})", tidy(v.x()), tidy(v.y()), tidy(v.z()));
}

/// The module type of this name; null if the model has none, or its definition has errors.
const model::ModuleType* TypeNamed(const model::Model& model, const std::string& name) {
  for (const model::ModuleType& type : model.module_types) {
    if (type.name == name) return &type;
  }
  return nullptr;
}

/// The module type that a member of a module stands in, over links and points.
const model::ModuleType* TypeOf(const ModelFile& file, const NamedThing& thing) {
  int owner = thing.owner;
  while (owner >= 0 && file.names.things[owner].kind != NameKind::kModule) {
    owner = file.names.things[owner].owner;
  }
  return owner < 0 ? nullptr : TypeNamed(file.compiled.solved, file.names.things[owner].name);
}

std::string ModuleLine(const model::ModuleType& type) {
  double mass_kg = 0.0;
  for (const model::Link& link : type.links) mass_kg += link.mass_kg;
  return fmt::format(
      "module {}: {}, {}, {}, {:.3g} kg; one unit is {} m", type.name,
      Counted(std::ssize(type.links), "link"), Counted(std::ssize(type.joints), "joint"),
      Counted(std::ssize(type.connectors), "connector"), mass_kg, model::NumberText(type.unit_m));
}

std::string JointLine(const model::Joint& joint) {
  const bool slides = joint.type == model::JointType::kPrismatic;
  std::string line = fmt::format("joint {}: {}", joint.name, model::JointTypeName(joint.type));
  if (joint.type == model::JointType::kRevolute) {
    line += fmt::format(", {:.4g} to {:.4g} rad ({:.4g}° to {:.4g}°)", joint.lower, joint.upper,
                        joint.lower * kDegrees, joint.upper * kDegrees);
  } else if (slides) {
    line += fmt::format(", {:.4g} to {:.4g} m", joint.lower, joint.upper);
  }
  if (joint.type == model::JointType::kFixed) return line;
  return line + fmt::format(", {:.4g} {}, {:.4g} {}", joint.effort, slides ? "N" : "N·m",
                            joint.speed, slides ? "m/s" : "rad/s");
}

std::string ConnectorLine(const model::Connector& connector, const model::ModuleType& type) {
  std::string line = fmt::format("connector {} on link {}, at {} m", connector.name,
                                 type.links[connector.link].name, VectorText(connector.p_MoCo_M));
  for (const auto& [key, value] : connector.attributes) {
    line += fmt::format(", {}={}", key, model::ValueText(value));
  }
  for (const model::StateVariable& state : connector.states) {
    std::vector<std::string> values;
    for (const model::AttributeValue& value : state.values) {
      values.push_back(model::ValueText(value));
    }
    line += fmt::format(", {} may be {}", state.name, fmt::join(values, " or "));
  }
  return line;
}

std::string SensorLine(const model::Sensor& sensor, const model::ModuleType& type) {
  std::string line = fmt::format("sensor {}: {}, on link {}, at {} m, looks along {}", sensor.name,
                                 model::SensorTypeName(sensor.type), type.links[sensor.link].name,
                                 VectorText(sensor.p_MoSo_M), VectorText(sensor.direction));
  if (sensor.range_m > 0) line += fmt::format(", {:.4g} m far", sensor.range_m);
  return line;
}

/// What the model says of a member of a module type; empty where it has errors.
std::string MemberLine(const model::ModuleType& type, const NamedThing& thing) {
  if (thing.kind == NameKind::kJoint) {
    const std::optional<int> joint = type.FindJoint(thing.name);
    return joint ? JointLine(type.joints[*joint]) : "";
  }
  if (thing.kind == NameKind::kLink) {
    const std::optional<int> link = type.FindLink(thing.name);
    return link ? fmt::format("link {}: {:.4g} kg, a shape of {}", thing.name,
                              type.links[*link].mass_kg,
                              Counted(std::ssize(type.links[*link].hull), "point"))
                : "";
  }
  if (thing.kind == NameKind::kPoint) {
    const std::optional<int> connector = type.FindConnector(thing.name);
    return connector ? ConnectorLine(type.connectors[*connector], type) : "point " + thing.name;
  }
  for (const model::Sensor& sensor : type.sensors) {
    if (thing.kind == NameKind::kSensor && sensor.name == thing.name)
      return SensorLine(sensor, type);
  }
  return "";
}

std::string ConnectionLine(const model::Model& model, const std::string& name) {
  for (const model::ConnectionType& type : model.connection_types) {
    if (type.name != name) continue;
    return fmt::format("connection {} ({} a, {} b): {} of {} candidates", name,
                       model.module_types[type.type_a].name, model.module_types[type.type_b].name,
                       type.options.size(), type.candidates);
  }
  return "connection " + name;
}

std::string RobotLine(const ModelFile& file, const std::string& name) {
  const model::Robot* robot = file.compiled.model ? file.compiled.model->FindRobot(name) : nullptr;
  if (robot == nullptr) return "robot " + name;
  int joints = 0;
  for (int m = 0; m < std::ssize(robot->modules); ++m) {
    joints += static_cast<int>(std::ssize(file.compiled.model->TypeOf(*robot, m).joints));
  }
  return fmt::format("robot {}: {}, {}, {}", name, Counted(std::ssize(robot->modules), "module"),
                     Counted(joints, "joint"), Counted(std::ssize(robot->dockings), "connection"));
}

/// Where a module of a robot is at the start values; empty where the model has errors.
std::string InstancePlace(const ModelFile& file, const NamedThing& thing) {
  const bool placed = thing.kind == NameKind::kInstance && thing.owner >= 0 && file.compiled.model;
  const model::Robot* robot =
      placed ? file.compiled.model->FindRobot(file.names.things[thing.owner].name) : nullptr;
  const std::optional<int> module = robot ? robot->FindModule(thing.name) : std::nullopt;
  if (!module) return "";
  const model::KinematicState state =
      model::ForwardKinematics(*file.compiled.model, *robot, model::StartValues(*robot));
  return fmt::format("at {} m of the robot's frame",
                     VectorText(state.X_RL[*module][0].translation()));
}

/// The picture that belongs to a thing, if one does.
std::string PictureOf(const ModelFile& file, const NamedThing& thing) {
  const model::Model& solved = file.compiled.solved;
  if (thing.kind == NameKind::kModule) {
    for (int type = 0; type < std::ssize(solved.module_types); ++type) {
      if (solved.module_types[type].name != thing.name) continue;
      return PictureMarkdown(ModuleDrawing(solved, type, kPictureWidth), thing.name);
    }
  }
  if (thing.kind == NameKind::kRobot && file.compiled.model) {
    const model::Robot* robot = file.compiled.model->FindRobot(thing.name);
    if (robot == nullptr) return "";
    return PictureMarkdown(RobotDrawing(*file.compiled.model, *robot, {}, kRobotWidth), thing.name);
  }
  return "";
}

/// The numbers of a value in SI units, where it says them in others.
std::string SiText(const ModelFile& file, const AttributePlace& place, ValueUnit unit) {
  source::Diagnostics unsaid;
  const double scale = place.module ? UnitOf(file, place.module->name.text) : 1.0;
  // Limits and play of a prismatic joint are lengths.
  const m3l::Attribute* type = place.declaration->Find("type");
  const bool slides =
      type != nullptr && type->value && m3l::SingleName(*type->value) == "prismatic";
  if (unit == ValueUnit::kAngle && slides) unit = ValueUnit::kLength;
  const auto text = [&](const m3l::Expr& expr) -> std::string {
    const std::optional<double> value = m3l::EvaluateNumber(expr, &unsaid);
    if (!value) return "?";
    switch (unit) {
      case ValueUnit::kLength:
        return fmt::format("{:.5g} m", *value * scale);
      case ValueUnit::kAngle:
        return fmt::format("{:.5g} rad ({:.5g}°)", *value, *value * kDegrees);
      case ValueUnit::kMass:
        return fmt::format("{:.5g} kg", *value);
      case ValueUnit::kEffort:
        return fmt::format("{:.5g} {}", *value, slides ? "N" : "N·m");
      case ValueUnit::kSpeed:
        return fmt::format("{:.5g} {}", slides ? *value * scale : *value, slides ? "m/s" : "rad/s");
      case ValueUnit::kTime:
        return fmt::format("{:.5g} s", *value);
      case ValueUnit::kNone:
        break;
    }
    return fmt::format("{:.5g}", *value);
  };
  const m3l::Expr& value = *place.value;
  const bool list = (value.kind == m3l::ExprKind::kTuple && value.children.size() == 3) ||
                    (value.kind == m3l::ExprKind::kList && value.children.size() == 2);
  if (!list) return value.kind == m3l::ExprKind::kTuple ? "" : text(value);
  std::vector<std::string> parts;
  for (const m3l::Expr& child : value.children) parts.push_back(text(child));
  return fmt::format("{}", fmt::join(parts, ", "));
}

std::string AttributeText(const ModelFile& file, const AttributePlace& place) {
  const AttributeWord* word = FindAttributeWord(place.definition, place.name);
  if (word == nullptr) return "";
  std::string text = fmt::format("`{}`: {}", place.name, word->meaning);
  if (place.value == nullptr || word->unit == ValueUnit::kNone) return text;
  const std::string si = SiText(file, place, word->unit);
  if (!si.empty() && si.find('?') == std::string::npos) text += "\n\nhere: " + si;
  return text;
}

}  // namespace

std::string ThingLine(const ModelFile& file, const NamedThing& thing) {
  const model::Model& solved = file.compiled.solved;
  switch (thing.kind) {
    case NameKind::kModule: {
      const model::ModuleType* type = TypeNamed(solved, thing.name);
      return type != nullptr ? ModuleLine(*type) : "module " + thing.name;
    }
    case NameKind::kConnection:
      return ConnectionLine(solved, thing.name);
    case NameKind::kRobot:
      return RobotLine(file, thing.name);
    case NameKind::kInstance:
    case NameKind::kMember:
    case NameKind::kBinder: {
      const std::string type = thing.base < 0 ? "?" : file.names.things[thing.base].name;
      if (thing.kind == NameKind::kInstance) return "module " + thing.name + " of type " + type;
      return (thing.kind == NameKind::kMember ? "a module of type " : "a connector of ") + type;
    }
    case NameKind::kConstant:
      for (const m3l::FileAst& ast : file.compiled.files) {
        for (const m3l::ConstDecl& constant : ast.constants) {
          source::Diagnostics unsaid;
          if (constant.name.text != thing.name || !constant.value) continue;
          const std::optional<double> value = m3l::EvaluateNumber(*constant.value, &unsaid);
          return "constant " + thing.name + (value ? " = " + model::NumberText(*value) : "");
        }
      }
      return "constant " + thing.name;
    case NameKind::kSubpoint:
      return "sub-point " + thing.name;
    case NameKind::kAttribute:
      return "attribute " + thing.name + " of connectors";
    case NameKind::kAxis:
      return "axis " + thing.name;
    default:
      break;
  }
  const model::ModuleType* type = TypeOf(file, thing);
  const std::string line = type != nullptr ? MemberLine(*type, thing) : "";
  return line.empty() ? thing.name : line;
}

std::string ConnectionLines(const model::Model& model, int connection, int option) {
  const model::ConnectionType& type = model.connection_types[connection];
  const model::ConnectionOption& way = type.options[option];
  const model::ModuleType& a = model.module_types[type.type_a];
  const model::ModuleType& b = model.module_types[type.type_b];
  const Json pose = PoseJson(way.X_AB);
  std::string text = fmt::format(
      "connection {}:{}, {} of {} on {} of {}\n\nb's origin in a: ({:.5f}) m\n\nturned (w x y z): "
      "({:.4f})",
      type.name, way.number, a.connectors[way.connector_a].name, a.name,
      b.connectors[way.connector_b].name, b.name, fmt::join(Numbers(pose["p"]), ", "),
      fmt::join(Numbers(pose["q"]), ", "));
  for (const model::StateRequirement& state : way.states) {
    text += fmt::format(
        "\n\nasks for {}.{}.{} = {}", state.of_a ? "a" : "b",
        state.of_a ? a.connectors[way.connector_a].name : b.connectors[way.connector_b].name,
        state.variable, model::ValueText(state.value));
  }
  return text;
}

std::string ModelHover(const ModelFile& file, size_t offset, source::Span* span) {
  std::string text;
  const auto add = [&](const std::string& paragraph) {
    if (!paragraph.empty()) text += (text.empty() ? "" : "\n\n") + paragraph;
  };
  // The name itself, then what it is a part of.
  if (const source::NameUse* use = file.names.At(0, offset)) {
    *span = use->span;
    const NamedThing& thing = file.names.things[use->thing];
    add(ThingLine(file, thing));
    add(InstancePlace(file, thing));
    add(PictureOf(file, thing));
  }
  if (const std::optional<DockingPlace> place = DockingAt(file, offset)) {
    const model::Docking& docking =
        file.compiled.model->robots[place->robot].dockings[place->docking];
    if (text.empty()) *span = file.compiled.dockings[place->robot][place->docking];
    add(ConnectionLines(*file.compiled.model, docking.connection_type, docking.option));
    add(PictureMarkdown(
        MatedDrawing(*file.compiled.model, docking.connection_type, docking.option, kPictureWidth),
        "the two modules"));
    return text;
  }
  const std::optional<AttributePlace> attribute = AttributeAt(file, offset);
  if (!attribute || !text.empty()) return text;
  add(AttributeText(file, *attribute));
  if (!text.empty()) *span = attribute->value ? attribute->value->span : attribute->name_span;
  return text;
}

}  // namespace morphbus::tools
