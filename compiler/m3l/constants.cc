#include "compiler/m3l/constants.h"

#include <map>

#include "compiler/m3l/evaluate.h"

namespace morphbus::m3l {
namespace {

/// A constant and where it is defined; without a value if that had an error.
struct Constant {
  source::Span span;
  std::optional<double> value;
  bool angle = false;  ///< It was worked out from a number with `deg` or `rad`.
};
using Constants = std::map<std::string, Constant>;

void Mark(const Constants& constants, std::vector<Attribute>* attributes);

/// Marks the names of constants in an expression. It is as deep as the parser allows.
void Mark(const Constants& constants, Expr* expr) {
  const auto found = constants.find(SingleName(*expr));
  if (found != constants.end() && found->second.value) {
    expr->constant = true;
    expr->number = *found->second.value;
    expr->angle = found->second.angle;
  }
  for (Expr& child : expr->children) Mark(constants, &child);
  if (!expr->axis) return;
  // Attributes of an axis are shared between copies of an expression, so that a marked copy is
  // made.
  auto axis = std::make_shared<std::vector<Attribute>>(*expr->axis);
  Mark(constants, axis.get());
  expr->axis = std::move(axis);
}

void Mark(const Constants& constants, std::vector<Attribute>* attributes) {
  for (Attribute& attribute : *attributes) {
    if (attribute.value) Mark(constants, &*attribute.value);
  }
}

void Mark(const Constants& constants, std::vector<PointDecl>* points) {
  for (PointDecl& point : *points) {
    Mark(constants, &point.attributes);
    Mark(constants, &point.subpoints);
  }
}

void Mark(const Constants& constants, ModuleDecl* module) {
  Mark(constants, &module->attributes);
  Mark(constants, &module->points);
  for (LinkDecl& link : module->links) {
    Mark(constants, &link.attributes);
    Mark(constants, &link.points);
  }
  for (AxisDecl& axis : module->axes) Mark(constants, &axis.attributes);
  for (JointDecl& joint : module->joints) Mark(constants, &joint.attributes);
  for (SensorDecl& sensor : module->sensors) Mark(constants, &sensor.attributes);
}

/// Adds one constant to those above it.
void Define(ConstDecl* decl, Constants* constants, source::Diagnostics* diagnostics) {
  const std::string& name = decl->name.text;
  // These words are values of the language, which a constant would hide.
  const bool taken = name == "pi" || name == "true" || name == "false" || name == "bool";
  if (taken) {
    diagnostics->Error(decl->name.span, "'" + name + "' has a meaning already");
    return;
  }
  const auto [entry, fresh] = constants->try_emplace(name, Constant{decl->name.span, {}, false});
  if (!fresh) {
    diagnostics->Error(decl->name.span, "constant '" + name + "' is defined twice")
        .Note(entry->second.span, "first defined here");
    return;
  }
  if (!decl->value) return;
  // The constant itself has no value yet, so that its own name is none in its value.
  Mark(*constants, &*decl->value);
  const int errors = diagnostics->error_count();
  entry->second.value = EvaluateNumber(*decl->value, diagnostics);
  entry->second.angle = HasAngle(*decl->value);
  if (!entry->second.value && errors < diagnostics->error_count() && !diagnostics->full()) {
    diagnostics->Error(decl->name.span, "constant '" + name + "' has no value")
        .Hint("a constant is a number, worked out from numbers and from the constants above it");
  }
}

}  // namespace

void ResolveConstants(std::vector<FileAst>* files, source::Diagnostics* diagnostics) {
  Constants constants;
  for (FileAst& file : *files) {
    for (ConstDecl& decl : file.constants) {
      // Files come in the order in which they were loaded, and constants in that of the text: a
      // constant knows those above it only.
      if (!diagnostics->full()) Define(&decl, &constants, diagnostics);
    }
  }
  // Marking before checking means that no checker needs to know of constants: a marked name has its
  // number with it.
  if (constants.empty()) return;
  for (FileAst& file : *files) {
    for (ModuleDecl& module : file.modules) Mark(constants, &module);
    for (ConnectionDecl& connection : file.connections) Mark(constants, &connection.attributes);
    for (RobotDecl& robot : file.robots) Mark(constants, &robot.attributes);
  }
}

}  // namespace morphbus::m3l
