#pragma once
// The syntax tree of M3L: what was written, nothing checked. Plain structs; the depth of an Expr is
// bounded by the parser, so walking and destroying it recursively is safe.
// Parse makes the tree (parser.h) and the checker reads it (checker.h). Pointers to its parts are
// kept while one compilation runs, which holds the trees of all its files.

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "compiler/source/diagnostics.h"

namespace morphbus::m3l {

/// A name as it stands in the source, with its place for diagnostics.
struct Name {
  std::string text;
  source::Span span;
};

/// An anonymous axis inside an expression has attributes, which in turn hold expressions.
struct Attribute;

/// Kinds of expressions, and which members of Expr each uses.
enum class ExprKind {
  /// A number without sign, as in `0.5`: `number`.
  kNumber,
  /// A quoted text, as in `"male"`: `text`, without quotes and with its escapes resolved.
  kString,
  /// Names joined by points, as in `m1.c2`: `path`. `true`, `false` and `pi` are paths of one name;
  /// so is what a `const` defines, whose value then is in `number` (`constant`).
  kPath,
  /// An axis without a name, as in `m5.link.(axis: origin=..., direction=...)`: `path`, then
  /// `axis`.
  kAxis,
  /// `sqrt(2)` or `convex(a.point)`: the function in `path`, its arguments in `children`.
  kCall,
  /// `-x`: the operand in children[0].
  kNegate,
  /// `a + b - c`: `children`, and `ops[i]` stands before children[i + 1].
  kSum,
  /// `a * b / c`, with the same members as kSum.
  kProduct,
  /// `(a, b)`: `children`. An expression in parentheses is a tuple of one.
  kTuple,
  /// `[lo, hi]`, `[bool]` or `["a", "b"]`: `children`.
  kList,
  /// A type and the name bound to it, as in `MTRAN m1` or `a.point p_a`: `path`, then `bound`.
  kTyped,
  /// A connection with the number of one of its options, `NAME:n`: `path`, the number in
  /// children[0].
  kOption,
  /// `m1.joint_1=pi/4` or `rot=180`: `path`, and the value in children[0].
  kAssign,
  /// Conditions joined by `and`: two or more `children`.
  kAnd,
  /// Conditions joined by `or`: two or more `children`.
  kOr,
  /// `not` before a condition: children[0].
  kNot,
  /// children[0] and children[1] with a relation between them, which `text` names: coincident,
  /// parallel, ==, <, ...
  kRelation,
};

/// An expression: a value, a path of names, or an operator over `children`. `kind` says which of
/// the members below are used; the others stay empty.
struct Expr {
  ExprKind kind = ExprKind::kNumber;
  /// The place of the whole expression.
  source::Span span;
  /// The value of a kNumber, or of a constant; radians where it was written with a unit.
  double number = 0.0;
  /// True for a kNumber that was written as an angle, with `deg` or `rad` behind it, and for a
  /// constant that was worked out from one.
  bool angle = false;
  /// True for a path of one name that a `const` defines. Where a name is wanted it stays one.
  bool constant = false;
  /// The text of a kString, or the relation of a kRelation.
  std::string text;
  /// The names of whatever kind begins with a path, in order.
  std::vector<Name> path;
  /// The name that a kTyped binds.
  Name bound;
  /// The operands, arguments or elements, in source order.
  std::vector<Expr> children;
  /// The signs of a kSum or kProduct, a character each: one less than there are `children`.
  std::string ops;
  /// The attributes of a kAxis. They are shared because Attribute is not complete here, and so that
  /// copying an expression stays cheap.
  std::shared_ptr<const std::vector<Attribute>> axis;
};

/// `key=value`, or a flag such as `connector`, which has no value.
struct Attribute {
  Name key;
  std::optional<Expr> value;
  /// True if the value did not parse. That has been reported, and no more is said of it.
  bool broken = false;
};

/// What all definitions and members have in common.
struct Declaration {
  /// The name that the keyword is followed by; its text is empty if none was written.
  Name name;
  /// In source order; a key that is repeated stands there more than once.
  std::vector<Attribute> attributes;
  /// Something in it did not parse: what seems to be missing may be what was skipped.
  bool broken = false;

  /// The first attribute `key`, or null.
  [[nodiscard]] const Attribute* Find(std::string_view key) const {
    for (const Attribute& attribute : attributes) {
      if (attribute.key.text == key) return &attribute;
    }
    return nullptr;
  }
};

/// `point NAME: ...`, with sub-points `(point NAME: ...)`.
/// The members whose keyword is `point`, of a module or of a link.
struct PointDecl : Declaration {
  /// The points written in parentheses within this one.
  std::vector<PointDecl> subpoints;
};

/// `link NAME: ...`, with points of its own.
/// The members whose keyword is `link`.
struct LinkDecl : Declaration {
  /// Points that belong to the link alone; names of module-level points stand in its attributes.
  std::vector<PointDecl> points;
};

/// `axis NAME: ...`. It has a type of its own so that the checker cannot take it for a joint.
struct AxisDecl : Declaration {};
/// `joint NAME: ...`.
struct JointDecl : Declaration {};

/// `sensor NAME: ...`.
struct SensorDecl : Declaration {};

/// `module NAME: ...` and the members that follow it.
/// The members keep the order in which they were written within each kind.
struct ModuleDecl : Declaration {
  std::vector<PointDecl> points;
  std::vector<LinkDecl> links;
  std::vector<AxisDecl> axes;
  std::vector<JointDecl> joints;
  std::vector<SensorDecl> sensors;
};

/// `connection NAME: ...`.
struct ConnectionDecl : Declaration {};
/// `robot NAME: ...`.
struct RobotDecl : Declaration {};

/// `import "FILE"`. Only the loader reads it (loader.h).
struct ImportDecl {
  /// The path as it was written, relative to the directory of the importing file.
  std::string path;
  /// The place of the string, for errors about the file.
  source::Span span;
};

/// `const NAME = number`.
struct ConstDecl {
  Name name;
  /// Nothing if it did not parse, which has been reported.
  std::optional<Expr> value;
};

/// The tree of one source file. Definitions of one kind keep their order; that between kinds is
/// lost, as a definition may be used before it is written.
struct FileAst {
  std::vector<ImportDecl> imports;
  std::vector<ConstDecl> constants;
  std::vector<ModuleDecl> modules;
  std::vector<ConnectionDecl> connections;
  std::vector<RobotDecl> robots;
};

}  // namespace morphbus::m3l
