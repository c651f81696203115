#include "compiler/dynarole/dump.h"

#include <fmt/format.h>

#include "compiler/base/utf8.h"

namespace morphbus::dynarole {

namespace {

// The expression in one line, every unary and binary one in parentheses.
std::string ExprText(const Expr& expr) {
  switch (expr.kind) {
    case ExprKind::kInt:
      return std::to_string(expr.integer);
    case ExprKind::kFloat:
      return fmt::format("{:.9g}f", expr.number);
    case ExprKind::kBool:
      return expr.integer != 0 ? "true" : "false";
    case ExprKind::kDollar:
      return "$" + expr.name;
    case ExprKind::kName:
      return expr.name;
    case ExprKind::kSelf:
      return "self";
    case ExprKind::kSuper:
      return "super";
    case ExprKind::kText:
      return "\"" + expr.name + "\"";
    case ExprKind::kUnary:
      return "(" + NameOf(expr.op) + ExprText(*expr.operands[0]) + ")";
    case ExprKind::kBinary:
      return "(" + ExprText(*expr.operands[0]) + " " + NameOf(expr.op) + " " +
             ExprText(*expr.operands[1]) + ")";
    case ExprKind::kChoice:
      return "(" + ExprText(*expr.operands[0]) + " ? " + ExprText(*expr.operands[1]) + " : " +
             ExprText(*expr.operands[2]) + ")";
    case ExprKind::kMember:
      return ExprText(*expr.operands[0]) + "." + expr.name;
    case ExprKind::kCall: {
      std::string text = ExprText(*expr.operands[0]) + "(";
      // Operand 0 is what is called; the arguments follow.
      for (size_t i = 1; i < expr.operands.size(); ++i) {
        text += (i > 1 ? ", " : "") + ExprText(*expr.operands[i]);
      }
      return text + ")";
    }
    case ExprKind::kArray: {
      std::string text;
      for (const ExprPtr& value : expr.operands) {
        text += (text.empty() ? "[" : ", ") + ExprText(*value);
      }
      return text + "]";
    }
    case ExprKind::kIndex:
      return ExprText(*expr.operands[0]) + "[" + ExprText(*expr.operands[1]) + "]";
    case ExprKind::kError:
      break;
  }
  return "<error>";
}

// A statement a line; what stands in it is indented by two more.
void DumpStatement(const Stmt& statement, const std::string& indent, std::string* out) {
  const std::string value = statement.expr != nullptr ? ExprText(*statement.expr) : "";
  const auto line = [&](const std::string& text) { *out += indent + text + "\n"; };
  switch (statement.kind) {
    case StmtKind::kExpr:
      return line(value);
    case StmtKind::kAssign:
      return line(statement.name +
                  (statement.subscript != nullptr ? "[" + ExprText(*statement.subscript) + "]"
                                                  : std::string()) +
                  " " + NameOf(statement.op) + "= " + value);
    case StmtKind::kVar:
      return line(
          "var " + statement.name +
          (statement.length > 0 ? "[" + std::to_string(statement.length) + "]" : std::string()) +
          " = " + value);
    case StmtKind::kReturn:
      return line("return " + value);
    case StmtKind::kIf:
    case StmtKind::kWhile:
      line((statement.kind == StmtKind::kIf ? "if " : "while ") + value);
      // The second statement of an if is its else.
      for (size_t i = 0; i < statement.body.size(); ++i) {
        if (i == 1) line("else");
        DumpStatement(*statement.body[i], indent + "  ", out);
      }
      return;
    case StmtKind::kSwitch:
      line("switch " + value);
      for (size_t i = 0; i < statement.cases.size(); ++i) {
        std::string values;
        for (const ExprPtr& one : statement.cases[i].values) {
          values += (values.empty() ? "case " : ", ") + ExprText(*one);
        }
        line(values.empty() ? "default" : values);
        DumpStatement(*statement.body[i], indent + "  ", out);
      }
      return;
    case StmtKind::kFor:
      // First, condition, after each round; then the body.
      DumpStatement(*statement.body[0], indent, out);
      line("for " + value);
      DumpStatement(*statement.body[2], indent + "  ", out);
      line("after each round");
      return DumpStatement(*statement.body[1], indent + "  ", out);
    case StmtKind::kForEach:
      line("for " + statement.name + " in " + value);
      return DumpStatement(*statement.body[0], indent + "  ", out);
    case StmtKind::kBreak:
      return line("break");
    case StmtKind::kContinue:
      return line("continue");
    case StmtKind::kBlock:
      for (const StmtPtr& inner : statement.body) DumpStatement(*inner, indent, out);
      return;
    case StmtKind::kError:
      return line("<error>");
  }
}

void DumpConstants(const std::vector<ConstantDecl>& constants, const std::string& indent,
                   std::string* out) {
  for (const ConstantDecl& constant : constants) {
    *out += indent + (constant.least != nullptr ? "param " : "const ") + constant.name + " = " +
            ExprText(*constant.expr);
    if (constant.least != nullptr) {
      *out += " in [" + ExprText(*constant.least) + ", " + ExprText(*constant.most) + "]";
    }
    *out += "\n";
  }
}

// The word of the member, its name, its parameters or value, then its body.
void DumpMember(const Member& member, std::string* out) {
  *out += std::string(member.shared ? "  shared " : "  ") + (member.kept ? "kept " : "") +
          NameOf(member.kind);
  // A requirement has no name, a field no word of its own.
  if (!member.name.empty()) *out += " " + member.name;
  if (member.body != nullptr) {
    *out += "(";
    for (size_t i = 0; i < member.parameters.size(); ++i) {
      *out += (i > 0 ? ", " : "") + member.parameters[i].name;
    }
    *out += ")";
    if (member.period != nullptr) *out += " every " + ExprText(*member.period);
    if (member.early) *out += " early";
  }
  // A field, a label or a requirement has an expression.
  if (member.expr != nullptr) *out += " = " + ExprText(*member.expr);
  *out += "\n";
  if (member.body != nullptr) DumpStatement(*member.body, "    ", out);
}

}  // namespace

// The text of names, numbers and `$` names follows the kind; words and signs are their own kinds.
std::string DumpTokens(const source::SourceSet& sources, const std::vector<Token>& tokens) {
  std::string out;
  // Tokens come in order, so one walk over the text numbers them all.
  // Places are 1-based, as in diagnostics.
  // They are of the character at `at`, up to which the text has been walked through.
  int line = 1, column = 1;
  size_t at = 0;
  for (const Token& token : tokens) {
    for (const std::string_view text = sources.text(token.span.file); at < token.span.begin; ++at) {
      // Columns count characters, as diagnostics do, not bytes.
      column = text[at] == '\n' ? 1 : column + (ContinuesCharacter(text[at]) ? 0 : 1);
      if (text[at] == '\n') ++line;
    }
    out += fmt::format("{}:{} {}", line, column, Describe(token.kind));
    // Words and signs are called by their spelling, so their text would say it twice.
    if (HasText(token.kind)) out += " " + std::string(sources.text(token.span));
    out += "\n";
  }
  return out;
}

// A role with its base, then its members.
std::string DumpAst(const Program& program) {
  std::string out;
  for (const ImportDecl& import : program.imports) out += "import \"" + import.path + "\"\n";
  DumpConstants(program.constants, "", &out);
  if (program.root != nullptr) {
    for (const Member& member : program.root->members) DumpMember(member, &out);
  }
  for (const Role& role : program.roles) {
    out += (role.abstract_role ? "abstract role " : "role ") + role.name + " extends " + role.base +
           "\n";
    DumpConstants(role.constants, "  ", &out);
    for (const Member& member : role.members) DumpMember(member, &out);
    for (const Trace& trace : role.traces) out += "  trace " + trace.name + "\n";
  }
  return out;
}

}  // namespace morphbus::dynarole
