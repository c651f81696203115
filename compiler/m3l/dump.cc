// DumpAst: the tree as indented text. One line a declaration or attribute, expressions in brackets.

#include <fmt/format.h>

#include "compiler/m3l/ast.h"

namespace morphbus::m3l {
namespace {

std::string Joined(const std::vector<Name>& path) {
  std::string text;
  for (const Name& name : path) text += (text.empty() ? "" : ".") + name.text;
  return text;
}

std::string Text(const Expr& expr);

std::string TextOf(const std::vector<Expr>& children) {
  std::string text;
  for (const Expr& child : children) text += " " + Text(child);
  return text;
}

std::string Text(const Attribute& attribute) {
  if (attribute.broken) return attribute.key.text + "=?";
  return attribute.key.text + (attribute.value ? "=" + Text(*attribute.value) : "");
}

std::string Text(const Expr& expr) {
  const std::string path = Joined(expr.path);
  switch (expr.kind) {
    case ExprKind::kNumber:
      return fmt::format("{}", expr.number);
    case ExprKind::kString:
      return "\"" + expr.text + "\"";
    case ExprKind::kPath:
      return path;
    case ExprKind::kAxis: {
      std::string text = "{axis " + path;
      for (const Attribute& attribute : *expr.axis) text += " " + Text(attribute);
      return text + "}";
    }
    case ExprKind::kCall:
      return "{call " + path + TextOf(expr.children) + "}";
    case ExprKind::kNegate:
      return "{-" + TextOf(expr.children) + "}";
    case ExprKind::kSum:
    case ExprKind::kProduct:
      return "{" + expr.ops + TextOf(expr.children) + "}";
    case ExprKind::kTuple:
      return "{tuple" + TextOf(expr.children) + "}";
    case ExprKind::kList:
      return "{list" + TextOf(expr.children) + "}";
    case ExprKind::kTyped:
      return "{" + path + " as " + expr.bound.text + "}";
    case ExprKind::kOption:
      return "{option " + path + TextOf(expr.children) + "}";
    case ExprKind::kAssign:
      return "{set " + path + TextOf(expr.children) + "}";
    case ExprKind::kAnd:
      return "{and" + TextOf(expr.children) + "}";
    case ExprKind::kOr:
      return "{or" + TextOf(expr.children) + "}";
    case ExprKind::kNot:
      return "{not" + TextOf(expr.children) + "}";
    case ExprKind::kRelation:
      return "{" + expr.text + TextOf(expr.children) + "}";
  }
  return "";
}

void DumpDeclaration(const char* kind, const Declaration& declaration, int level,
                     std::string& out) {
  out += std::string(static_cast<size_t>(level) * 2, ' ') + kind + " " + declaration.name.text;
  if (declaration.broken) out += " (broken)";
  out += "\n";
  for (const Attribute& attribute : declaration.attributes) {
    out += std::string(static_cast<size_t>(level) * 2 + 2, ' ') + Text(attribute) + "\n";
  }
}

void DumpPoints(const std::vector<PointDecl>& points, int level, std::string& out) {
  for (const PointDecl& point : points) {
    DumpDeclaration("point", point, level, out);
    DumpPoints(point.subpoints, level + 1, out);
  }
}

}  // namespace

std::string DumpAst(const FileAst& file) {
  std::string out;
  for (const ImportDecl& import : file.imports) out += "import \"" + import.path + "\"\n";
  for (const ModuleDecl& module : file.modules) {
    DumpDeclaration("module", module, 0, out);
    DumpPoints(module.points, 1, out);
    for (const LinkDecl& link : module.links) {
      DumpDeclaration("link", link, 1, out);
      DumpPoints(link.points, 2, out);
    }
    for (const AxisDecl& axis : module.axes) DumpDeclaration("axis", axis, 1, out);
    for (const JointDecl& joint : module.joints) DumpDeclaration("joint", joint, 1, out);
  }
  for (const ConnectionDecl& c : file.connections) DumpDeclaration("connection", c, 0, out);
  for (const RobotDecl& robot : file.robots) DumpDeclaration("robot", robot, 0, out);
  return out;
}

}  // namespace morphbus::m3l
