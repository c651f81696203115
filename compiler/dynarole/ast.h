#pragma once
// The syntax tree of a DynaRole program, as parsed; the checker adds types and meanings to it. Each
// node owns those below it, and the Program owns them all: it lives as long as the compilation, and
// the ProgramModel refers to its roles and members. Spans are places in the program's text, for
// messages and line numbers.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "compiler/dynarole/types.h"
#include "compiler/source/source_text.h"
#include "vm/image/opcodes.h"
#include "vm/image/values.h"

namespace morphbus::dynarole {

/// No tree is deeper than this, so that recursion over it is bounded; the parser reports more.
inline constexpr int kMaxDepth = 200;
/// More members, or constants, stand nowhere: it is more than a role can hold of all kinds
/// together, so that a hostile text costs no time later.
inline constexpr size_t kMaxMembers = 200;

/// The form of an expression.
enum class ExprKind : uint8_t {
  kInt,    ///< 45
  kFloat,  ///< 22.5
  kBool,   ///< true
  /// A word behind '$': a direction or axis ($NORTH), a role ($Role), or a part of the module
  /// ($LINK_BAR). Only the checker tells which.
  kDollar,
  /// A name without anything before it: a variable, a field or a label.
  kName,
  kSelf,   ///< self
  kSuper,  ///< super, which stands only before the name of a member
  kText,   ///< "a text", an argument of print
  kUnary,  ///< -x, !x
  /// An operator between two operands: x + y, a && b.
  kBinary,
  /// c ? x : y, of which one is evaluated: the operands in this order.
  kChoice,
  /// x.NAME, without parentheses; where these follow, it is the base of a kCall.
  kMember,
  /// A call with parentheses: f(x), x.NAME(y). Its first operand is what is called.
  kCall,
  /// [x, y]: the values that an array begins with.
  kArray,
  /// x[i], an element of an array: the array's name, and the element's number.
  kIndex,
  /// A piece of text that could not be read. It has been reported, and the checker is silent about
  /// it.
  kError,
};

/// Operators, the arithmetic ones first and in the order of the instructions that compute them.
enum class Operator : uint8_t {
  /// There is no operator: the expression is neither unary nor binary, or the assignment is a plain
  /// `=`.
  kNone,
  // Arithmetic, on numbers.
  kAdd,
  kSub,
  kMul,
  kDiv,
  kMod,
  // Comparisons, which give a bool.
  kEqual,
  kNotEqual,
  kLess,
  kLessEqual,
  kGreater,
  kGreaterEqual,
  // Logic, on bools; && and || evaluate their right side only if the left one does not decide.
  kAnd,
  kOr,
  kNot,
  // The sign before a number.
  kNegate,
};
/// The operators whose operands and result are numbers.
constexpr bool IsArithmetic(Operator op) { return op >= Operator::kAdd && op <= Operator::kMod; }

/// What the checker found an expression to mean; Expr holds the numbers that go with it.
enum class Meaning : uint8_t {
  kNone,      ///< Nothing beyond what its kind and operands say.
  kConstant,  ///< A value that stands in the text: Expr::cell.
  /// A variable or parameter: Expr::index is its slot among the locals of the routine.
  kLocal,
  /// A field: Expr::index is its slot in the role, which is the same in all its subroles.
  kField,
  /// An element of an array whose number is not known at compile time: Expr::index is the slot of
  /// the first one, of the routine's locals or of the role's fields, Expr::length their number.
  kLocalElement,
  kFieldElement,
  /// A label: Expr::index is its slot in the role.
  kLabel,
  /// A part of the module, by its keyword: Expr::index counts ProgramModel::keywords.
  kKeyword,
  /// A parameter of the program: Expr::index counts ProgramModel::constants.
  kParameter,
  /// A call of a function of the own role: Expr::index is its slot, so that a subrole's function
  /// runs in its place where it overrides it.
  kMethod,
  /// A command, which every module with the role Expr::role is asked to run: Expr::index is its
  /// slot there.
  kInvoke,
  /// A shared field of neighbours, the set before the dot: Expr::index is its slot in Expr::role.
  kNeighbourField,
  /// A command for neighbours only, the set before the dot: as kInvoke.
  kInvokeNear,
  /// One value of all members of a set of neighbours: sum(SET.NAME), count(SET). Expr::index is the
  /// slot of the local that holds those which are still to be asked, Expr::role their role.
  kOverNeighbours,
  /// A call of the routine Expr::index, which the one that calls has replaced.
  kSuper,
  /// What `self`, a joint or a connector offers, or a function of the language: the instruction
  /// Expr::opcode follows the operands.
  kBuiltin,
  kCount,  ///< sizeof: the number of members of its operand, a set.
  /// int(x) or float(x): the operand as a number of the call's own type.
  kConvert,
};

/// An expression: what the parser read, and below it what the checker found out about it.
struct Expr {
  ExprKind kind = ExprKind::kError;
  /// The operator of a unary or binary expression.
  Operator op = Operator::kNone;
  /// Levels of the tree below it, itself included; the parser keeps it at kMaxDepth at most.
  int depth = 1;
  source::Span span;  ///< All of its text.
  /// What a message about this node alone points at: the name, the member's name, or the operator.
  source::Span name_span;
  /// The name of a kName, a kDollar (without its '$') or a kMember; the characters of a kText.
  std::string name;
  /// The value of a kInt, or 0 and 1 for a kBool.
  int64_t integer = 0;
  /// The value of a kFloat, not yet rounded to single precision.
  double number = 0;
  /// In the order of the text: the operands of an operator; the base of a member; the base of a
  /// call and then its arguments.
  std::vector<std::unique_ptr<Expr>> operands;

  // The checker sets the rest, anew in each of its passes.
  Type type = Type::kUnknown;  ///< Of its value before any conversion.
  /// What the surroundings convert the value to; kUnknown: it stays as it is.
  Type wanted = Type::kUnknown;
  /// Says which of the following fields count, and what for.
  Meaning meaning = Meaning::kNone;
  int index = -1;  ///< A slot or a keyword.
  int role = -1;   ///< The role whose command is invoked or whose field is read.
  int length = 0;  ///< How many elements an array has.
  /// The instruction of a kBuiltin.
  vm::Opcode opcode = vm::Opcode::kPop;
  /// The value of a kConstant, as the VM stores it.
  vm::Cell cell;
};
using ExprPtr = std::unique_ptr<Expr>;

/// A copy of an expression that nobody has checked yet.
ExprPtr CopyOf(const Expr& expr);

/// Whether it is a call of floor or round, whose value is an int.
bool IsWholeNumber(const Expr& expr);

/// The form of a statement.
enum class StmtKind : uint8_t {
  kExpr,
  kAssign,
  kVar,
  kIf,
  kSwitch,
  kWhile,
  kFor,
  /// for (NAME in SET): the body once for each neighbour in the set.
  kForEach,
  kBreak,
  kContinue,
  kReturn,
  kBlock,
  kError,
};

/// What leads to one of the blocks of a switch: `case A, B:` or `default:`.
struct SwitchCase {
  source::Span span;  ///< Its text, up to the colon.
  /// The values, which are known at compile time; none for `default`.
  std::vector<ExprPtr> values;
  [[nodiscard]] bool is_default() const { return values.empty(); }
};

/// A statement: as for expressions, the parser fills in what it read, and the checker the rest.
struct Stmt {
  StmtKind kind = StmtKind::kError;
  /// How an assignment combines: kAdd for `+=`, kSub for `-=` and so on, kNone for `=`.
  Operator op = Operator::kNone;
  source::Span span;       ///< All of its text.
  source::Span name_span;  ///< Of `name`.
  /// The variable or field that a kAssign sets, or the variable that a kVar or kForEach makes.
  std::string name;
  /// The value, the condition, the set that a kForEach goes over, or the expression that stands
  /// alone; null for `return;` and for a `for` without a condition.
  ExprPtr expr;
  /// The statements of a block; the then and perhaps the else branch of an if; the body of a while
  /// or kForEach;
  /// what a for does first, what it does after each round (empty blocks if nothing), and its body.
  std::vector<std::unique_ptr<Stmt>> body;
  /// Of an assignment to an element of an array: its number. Else null.
  ExprPtr subscript;
  /// Of a kVar, and of an assignment to an element: how many elements the array has; 0 for none. A
  /// kVar whose value is a kArray makes one too.
  int length = 0;
  /// Of a switch: what leads to each statement of `body`, which are blocks.
  std::vector<SwitchCase> cases;

  // The checker sets the rest.
  Meaning meaning = Meaning::kNone;  ///< kLocal or kField, of what is set.
  /// Slot of that local or field; of a switch that of the local that holds what it looks at.
  int index = -1;
  Type type = Type::kUnknown;  ///< Of that local or field.
  /// Of a kForEach: the slot of the local that holds the neighbours which are still to come. Of an
  /// assignment that reads an element of unknown number first: that of the number.
  int rest = -1;
  /// Of a kForEach whose body reads shared fields: the role that has them; else -1.
  int role = -1;
};
using StmtPtr = std::unique_ptr<Stmt>;

/// Whether every value that a checked switch may look at leads to one of its blocks: there is a
/// `default`, or both bools have a case.
bool CoversAll(const Stmt& statement);

/// A parameter of a command or function. Its type is mostly left out; the checker then finds it
/// from the code.
struct Parameter {
  std::string name;
  source::Span span;           ///< Of its name.
  Type type = Type::kUnknown;  ///< As written before the name, if it was.
};

/// The kinds of members of a role, each with a word of its own but fields.
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

/// A member of a role.
struct Member {
  MemberKind kind = MemberKind::kField;
  source::Span span;       ///< All of its text.
  source::Span name_span;  ///< Of its name; of the word `require` where it has none.
  std::string name;        ///< Empty for a requirement.
  /// The value of a field, null where subroles must give one; else what a label or a requirement
  /// evaluates.
  ExprPtr expr;
  /// Parameters of commands and functions; other members have none.
  std::vector<Parameter> parameters;
  /// Of a handler that is a timer: its period in seconds; null for others.
  ExprPtr period;
  /// Of a handler: it runs during startup too.
  bool early = false;
  /// Of a field: neighbours may read it.
  bool shared = false;
  /// Of a field: its value outlives a change of role or of program.
  bool kept = false;
  /// Of a field that is an element of an array, each of which is a member, "gains[2]": the array's
  /// name, the element's number, and how many there are.
  std::string array;
  int element = 0;
  int length = 0;

  /// The name as it is declared: of an element that of its array.
  [[nodiscard]] const std::string& declared_name() const { return array.empty() ? name : array; }
  /// The block of a startup, behavior, command, handler or function; null for other members.
  StmtPtr body;

  /// The checker computes it: the value of `period`, or the parameter that it is, by its index in
  /// ProgramModel::constants (-1: none).
  float period_s = 0;
  int period_parameter = -1;
};

/// A name for a value that is known at compile time: `const NAME = value;`. A parameter is one
/// whose value a run may choose: `param NAME = value in [least, most];`.
struct ConstantDecl {
  std::string name;
  source::Span name_span;
  ExprPtr expr;
  /// Of a parameter: the range that its values are in; null for a constant.
  ExprPtr least, most;
  /// Which enumeration it is a value of, by its number in the program; -1 for none.
  int enumeration = -1;
};

/// `enum NAME { A, B = 5, C }`: ints with names, each one more than the one before, from 0 on.
struct Enumeration {
  std::string name;
  source::Span name_span;
};

/// `trace NAME;`: the value of a field is told in every tick.
struct Trace {
  std::string name;
  source::Span span;       ///< Of the name, with the number of the element of an array.
  source::Span name_span;  ///< Of the name alone.
};

/// A role as it is declared, without what it inherits.
struct Role {
  /// No module takes an abstract role; only those that extend it can be taken.
  bool abstract_role = false;
  source::Span span;       ///< From its first word to the name of its base.
  source::Span name_span;  ///< Of its name.
  std::string name;
  source::Span base_span;  ///< Of the name behind `extends`.
  /// The role that it extends: "Module" or another of the program. Whether there is one is for
  /// BuildModel to find out.
  std::string base;
  std::vector<Member> members;
  /// Constants that stand in it.
  std::vector<ConstantDecl> constants;
  /// Fields whose values are told.
  std::vector<Trace> traces;
};

/// `import "FILE";`: what the file declares outside all counts as if it stood here.
struct ImportDecl {
  /// As it is written, relative to the folder of the file that it stands in.
  std::string path;
  source::Span span;  ///< Of the path, with its quotes.
};

/// A program: the roles of one file, in their order; and once it is loaded those of the files that
/// it imports, which come first.
struct Program {
  std::vector<ImportDecl> imports;
  std::vector<Role> roles;
  /// Constants that stand outside all roles.
  std::vector<ConstantDecl> constants;
  /// Those of the program and of all its roles; their values are constants where they stand.
  std::vector<Enumeration> enumerations;
  /// The root of all roles where functions stand outside all of them, which are its members; else
  /// null.
  std::unique_ptr<Role> root;
  /// Functions of imported files that no code names, which no image needs to hold.
  std::vector<Member> left_out;
};

/// "field", "label", "requirement": the kind of member as messages say it.
std::string NameOf(MemberKind kind);
/// "+", "==": the operator as programs write it; empty for kNone.
std::string NameOf(Operator op);

}  // namespace morphbus::dynarole
