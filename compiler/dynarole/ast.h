#pragma once
// The syntax tree of a DynaRole program, as parsed; the checker adds types and meanings to it.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "compiler/dynarole/types.h"
#include "compiler/source/source_text.h"
#include "vm/opcodes.h"
#include "vm/values.h"

namespace morphbus::dynarole {

/// No tree is deeper than this, so that recursion over it is bounded; the parser reports more.
inline constexpr int kMaxDepth = 200;

enum class ExprKind : uint8_t {
  kInt,
  kFloat,
  kBool,
  kDollar,
  kName,
  kSelf,
  kUnary,
  kBinary,
  kMember,
  kCall,
  kError,
};

enum class Operator : uint8_t {
  kNone,
  kAdd,
  kSub,
  kMul,
  kDiv,
  kMod,
  kEqual,
  kNotEqual,
  kLess,
  kLessEqual,
  kGreater,
  kGreaterEqual,
  kAnd,
  kOr,
  kNot,
  kNegate,
};

/// What the checker found an expression to mean.
enum class Meaning : uint8_t {
  kNone,      ///< Follows from the kind alone.
  kConstant,  ///< `cell`.
  kLocal,
  kField,
  kLabel,
  kKeyword,  ///< `index`.
  kMethod,   ///< `index`: slot.
  kInvoke,   ///< `role`, `index`: slot.
  kBuiltin,  ///< `opcode` after the operands.
  kCount,    ///< Number of members of the operand, a set.
};

struct Expr {
  ExprKind kind = ExprKind::kError;
  Operator op = Operator::kNone;
  int depth = 1;
  source::Span span;
  source::Span name_span;   ///< Of the name, the member's name, or the operator.
  std::string name;         ///< kName, kDollar (without '$'), kMember.
  int64_t integer = 0;      ///< kInt, kBool.
  double number = 0;        ///< kFloat.
  bool has_parens = false;  ///< kCall: `f()` in contrast to `f`.
  std::vector<std::unique_ptr<Expr>> operands;  ///< Unary, binary; base of a member; base and
                                                ///< arguments of a call.

  // By the checker.
  Type type = Type::kUnknown;
  Type wanted = Type::kUnknown;  ///< What it is converted to; kUnknown: nothing.
  Meaning meaning = Meaning::kNone;
  int index = -1;
  int role = -1;
  vm::Opcode opcode = vm::Opcode::kPop;
  vm::Cell cell;
};
using ExprPtr = std::unique_ptr<Expr>;

enum class StmtKind : uint8_t { kExpr, kAssign, kVar, kIf, kWhile, kReturn, kBlock, kError };

struct Stmt {
  StmtKind kind = StmtKind::kError;
  Operator op = Operator::kNone;  ///< kAssign: kAdd for `+=`, kSub for `-=`.
  source::Span span;
  source::Span name_span;
  std::string name;                         ///< kAssign, kVar.
  ExprPtr expr;                             ///< Value or condition; null for `return;`.
  std::vector<std::unique_ptr<Stmt>> body;  ///< Block; then and else of an if; body of a while.

  // By the checker.
  Meaning meaning = Meaning::kNone;
  int index = -1;              ///< Local or field that is set.
  Type type = Type::kUnknown;  ///< Of that local or field.
};
using StmtPtr = std::unique_ptr<Stmt>;

struct Parameter {
  std::string name;
  source::Span span;
  Type type = Type::kUnknown;  ///< As written before the name, if it was.
};

enum class MemberKind : uint8_t {
  kField,
  kLabel,
  kRequire,
  kStartup,
  kBehavior,
  kCommand,
  kHandler,
  kFunction,
};

struct Member {
  MemberKind kind = MemberKind::kField;
  source::Span span;
  source::Span name_span;
  std::string name;  ///< Empty for a requirement.
  ExprPtr expr;      ///< Field's value (may be null), label, requirement.
  std::vector<Parameter> parameters;
  StmtPtr body;
};

struct Role {
  bool abstract_role = false;
  source::Span span;
  source::Span name_span;
  std::string name;
  source::Span base_span;
  std::string base;
  std::vector<Member> members;
};

struct Program {
  int file = 0;
  std::vector<Role> roles;
};

/// "field", "label", ... as messages say it.
const char* NameOf(MemberKind kind);
/// "+", "==", ...
const char* NameOf(Operator op);

}  // namespace morphbus::dynarole
