#include "tools/lsp/model_places.h"

#include <vector>

namespace morphbus::tools {
namespace {

/// The file itself is the first that the compiler reads.
constexpr int kItself = 0;

bool Holds(const source::Span& span, size_t offset) {
  return span.file == kItself && span.begin <= offset && offset <= span.end;
}

/// Looks through the declarations of one file for the attribute at a place.
class AttributeSearch {
 public:
  explicit AttributeSearch(size_t offset) : offset_(offset) {}

  std::optional<AttributePlace> In(const m3l::FileAst& file) {
    for (const m3l::ModuleDecl& module : file.modules) {
      module_ = &module;
      Look(module, "module");
      Look(module.points, "point");
      for (const m3l::LinkDecl& link : module.links) {
        Look(link, "link");
        Look(link.points, "point");
      }
      for (const m3l::AxisDecl& axis : module.axes) Look(axis, "axis");
      for (const m3l::JointDecl& joint : module.joints) Look(joint, "joint");
      for (const m3l::SensorDecl& sensor : module.sensors) Look(sensor, "sensor");
    }
    module_ = nullptr;
    for (const m3l::ConnectionDecl& connection : file.connections) Look(connection, "connection");
    for (const m3l::RobotDecl& robot : file.robots) Look(robot, "robot");
    return found_;
  }

 private:
  void Look(const std::vector<m3l::PointDecl>& points, const char* definition) {
    for (const m3l::PointDecl& point : points) {
      Look(point, definition);
      Look(point.subpoints, definition);
    }
  }

  void Look(const m3l::Declaration& declaration, const std::string& definition) {
    for (const m3l::Attribute& attribute : declaration.attributes) {
      const m3l::Expr* value = attribute.value ? &*attribute.value : nullptr;
      if (!Holds(attribute.key.span, offset_) &&
          (value == nullptr || !Holds(value->span, offset_))) {
        continue;
      }
      found_ = AttributePlace{definition,         &declaration,       module_,
                              attribute.key.text, attribute.key.span, value};
      if (value != nullptr) LookInside(*value, declaration);
    }
  }

  /// The arguments of a part of a hull, and the axes of a frame, have attributes of their own.
  void LookInside(const m3l::Expr& expr, const m3l::Declaration& declaration) {
    if (expr.kind == m3l::ExprKind::kCall) {
      for (const m3l::Expr& argument : expr.children) {
        if (argument.kind != m3l::ExprKind::kAssign || !Holds(argument.span, offset_)) continue;
        found_ =
            AttributePlace{expr.path[0].text,     &declaration,          module_,
                           argument.path[0].text, argument.path[0].span, &argument.children[0]};
      }
    }
    if (expr.axis) {
      for (const m3l::Attribute& attribute : *expr.axis) {
        const m3l::Expr* value = attribute.value ? &*attribute.value : nullptr;
        if (Holds(attribute.key.span, offset_) ||
            (value != nullptr && Holds(value->span, offset_))) {
          found_ = AttributePlace{
              "axis", &declaration, module_, attribute.key.text, attribute.key.span, value};
        }
      }
    }
    for (const m3l::Expr& child : expr.children) LookInside(child, declaration);
  }

  size_t offset_;
  const m3l::ModuleDecl* module_ = nullptr;
  std::optional<AttributePlace> found_;
};

}  // namespace

std::optional<AttributePlace> AttributeAt(const ModelFile& file, size_t offset) {
  for (const m3l::FileAst& ast : file.compiled.files) {
    if (std::optional<AttributePlace> found = AttributeSearch(offset).In(ast)) return found;
  }
  return std::nullopt;
}

std::optional<DockingPlace> DockingAt(const ModelFile& file, size_t offset) {
  if (!file.compiled.model) return std::nullopt;
  for (size_t robot = 0; robot < file.compiled.dockings.size(); ++robot) {
    const std::vector<source::Span>& spans = file.compiled.dockings[robot];
    for (size_t docking = 0; docking < spans.size(); ++docking) {
      if (Holds(spans[docking], offset)) {
        return DockingPlace{static_cast<int>(robot), static_cast<int>(docking)};
      }
    }
  }
  return std::nullopt;
}

double UnitOf(const ModelFile& file, const std::string& module) {
  for (const model::ModuleType& type : file.compiled.solved.module_types) {
    if (type.name == module) return type.unit_m;
  }
  return 1.0;
}

}  // namespace morphbus::tools
