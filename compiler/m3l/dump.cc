#include "compiler/m3l/parser.h"

#include <fmt/format.h>

#include "compiler/m3l/evaluate.h"

namespace morphbus::m3l {
namespace {

std::string Text(const Expr& expr);

/// The texts of several expressions, each with a space before it.
std::string TextOf(const std::vector<Expr>& children) {
  std::string text;
  for (const Expr& child : children) text += " " + Text(child);
  return text;
}

/// `key=value`, `key`, or `key=?` where the value did not parse.
std::string Text(const Attribute& attribute) {
  // What did not parse is shown where it stands, and was reported.
  if (attribute.broken) return attribute.key.text + "=?";
  return attribute.key.text + (attribute.value ? "=" + Text(*attribute.value) : "");
}

/// An expression with its operator first, in braces.
std::string Text(const Expr& expr) {
  // Every kind is written, so that a golden test sees any change of the tree.
  const std::string path = PathText(expr.path);
  const auto braced = [&](const std::string& head) {
    return "{" + head + TextOf(expr.children) + "}";
  };
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
    case ExprKind::kTyped:
      return "{" + path + " as " + expr.bound.text + "}";
    case ExprKind::kCall:
    case ExprKind::kOption:
    case ExprKind::kAssign:
      return braced((expr.kind == ExprKind::kCall     ? "call "
                     : expr.kind == ExprKind::kOption ? "option "
                                                      : "set ") +
                    path);
    case ExprKind::kSum:
    case ExprKind::kProduct:
      return braced(expr.ops);
    case ExprKind::kRelation:
      return braced(expr.text);
    default:
      return braced(expr.kind == ExprKind::kNegate  ? "-"
                    : expr.kind == ExprKind::kTuple ? "tuple"
                    : expr.kind == ExprKind::kList  ? "list"
                    : expr.kind == ExprKind::kAnd   ? "and"
                    : expr.kind == ExprKind::kOr    ? "or"
                                                    : "not");
  }
}

/// The head of a declaration and its attributes, `level` steps indented.
void DumpDeclaration(const char* kind, const Declaration& declaration, int level,
                     std::string& out) {
  // Two columns are one step of indentation.
  out += std::string(2 * level, ' ') + kind + " " + declaration.name.text;
  if (declaration.broken) out += " (broken)";
  out += "\n";
  for (const Attribute& attribute : declaration.attributes) {
    out += std::string(2 * level + 2, ' ') + Text(attribute) + "\n";
  }
}

/// Points with their sub-points below them.
void DumpPoints(const std::vector<PointDecl>& points, int level, std::string& out) {
  for (const PointDecl& point : points) {
    DumpDeclaration("point", point, level, out);
    DumpPoints(point.subpoints, level + 1, out);
  }
}

}  // namespace

std::string DumpTokens(const source::SourceSet& sources, const std::vector<Token>& tokens) {
  // In the order of TokenKind.
  static constexpr const char* kNames[] = {"word", "number", "string", "symbol", "end"};
  std::string out;
  for (const Token& token : tokens) {
    // Places are those that diagnostics would show.
    const source::LineColumn at = sources.Locate(token.span.file, token.span.begin);
    out += std::to_string(at.line) + ":" + std::to_string(at.column) + " " +
           kNames[static_cast<int>(token.kind)];
    // The mark at the end has no text.
    if (token.kind != TokenKind::kEnd) out += " " + std::string(token.text);
    out += "\n";
  }
  return out;
}

std::string DumpAst(const FileAst& file) {
  std::string out;
  for (const ImportDecl& import : file.imports) out += "import \"" + import.path + "\"\n";
  // Constants come before what may use them, wherever they stand.
  for (const ConstDecl& constant : file.constants) {
    out +=
        "const " + constant.name.text + "=" + (constant.value ? Text(*constant.value) : "?") + "\n";
  }
  for (const ModuleDecl& module : file.modules) {
    // The points of the module itself come before its links.
    DumpDeclaration("module", module, 0, out);
    DumpPoints(module.points, 1, out);
    // Members come by kind, not in the order of the source, as the tree has them.
    for (const LinkDecl& link : module.links) {
      DumpDeclaration("link", link, 1, out);
      DumpPoints(link.points, 2, out);
    }
    for (const AxisDecl& axis : module.axes) DumpDeclaration("axis", axis, 1, out);
    for (const JointDecl& joint : module.joints) DumpDeclaration("joint", joint, 1, out);
    for (const SensorDecl& sensor : module.sensors) DumpDeclaration("sensor", sensor, 1, out);
  }
  // Connections and robots follow the modules, whatever their order in the file was.
  for (const ConnectionDecl& c : file.connections) DumpDeclaration("connection", c, 0, out);
  for (const RobotDecl& robot : file.robots) DumpDeclaration("robot", robot, 0, out);
  return out;
}

}  // namespace morphbus::m3l
