#pragma once
// The syntax tree of M3L: what was written, nothing checked. Plain structs; the depth of an Expr is
// bounded by the parser, so walking and destroying it recursively is safe.

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "compiler/source/diagnostics.h"

namespace morphbus::m3l {

/// A name as it stands in the source.
struct Name {
  std::string text;
  source::Span span;
};

struct Attribute;

enum class ExprKind {
  kNumber,   ///< 0.5
  kString,   ///< "male"
  kPath,     ///< m1.c2: `path`. `true`, `false` and `pi` are paths of one name.
  kAxis,     ///< m5.link.(axis: origin=..., direction=...): `path`, then `axis`.
  kCall,     ///< sqrt(2), convex(a.point): function `path`, arguments `children`.
  kNegate,   ///< -x
  kSum,      ///< a + b - c: `children`, `ops[i]` stands before children[i + 1].
  kProduct,  ///< a * b / c, likewise.
  kTuple,    ///< (a, b); a parenthesised expression is a tuple of one.
  kList,     ///< [lo, hi], [bool], ["a", "b"]
  kTyped,    ///< MTRAN m1, a.point p_a: `path`, then `bound`.
  kOption,   ///< NAME:n: `path`, and the number in children[0].
  kAssign,   ///< m1.joint_1=pi/4, rot=180: `path`, and the value in children[0].
  kAnd,      ///< `children`, two or more.
  kOr,
  kNot,
  kRelation,  ///< children[0] `text` children[1]; text is coincident, parallel, ==, <, ...
};

struct Expr {
  ExprKind kind = ExprKind::kNumber;
  source::Span span;
  double number = 0.0;
  std::string text;
  std::vector<Name> path;
  Name bound;
  std::vector<Expr> children;
  std::string ops;
  std::shared_ptr<const std::vector<Attribute>> axis;
};

/// `key=value`, or a flag such as `connector`. `broken`: the value did not parse, say no more of
/// it.
struct Attribute {
  Name key;
  std::optional<Expr> value;
  bool broken = false;
};

/// What all definitions and members have in common.
struct Declaration {
  Name name;
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

struct PointDecl : Declaration {
  std::vector<PointDecl> subpoints;
};

struct LinkDecl : Declaration {
  std::vector<PointDecl> points;
};

struct AxisDecl : Declaration {};
struct JointDecl : Declaration {};

struct ModuleDecl : Declaration {
  std::vector<PointDecl> points;
  std::vector<LinkDecl> links;
  std::vector<AxisDecl> axes;
  std::vector<JointDecl> joints;
};

struct ConnectionDecl : Declaration {};
struct RobotDecl : Declaration {};

struct ImportDecl {
  std::string path;   ///< As written.
  source::Span span;  ///< Of the string.
};

/// One source file.
struct FileAst {
  std::vector<ImportDecl> imports;
  std::vector<ModuleDecl> modules;
  std::vector<ConnectionDecl> connections;
  std::vector<RobotDecl> robots;
};

/// Indented text of the tree, for debugging and golden tests.
std::string DumpAst(const FileAst& file);

}  // namespace morphbus::m3l
