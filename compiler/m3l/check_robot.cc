#include "compiler/m3l/check_robot.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "compiler/m3l/evaluate.h"
#include "compiler/model/attributes.h"

namespace morphbus::m3l {
namespace internal {
namespace {

/// Bounds on hostile input, far above any robot that was built.
constexpr size_t kMaxModules = 20'000;
constexpr size_t kMaxLinks = 100'000;

/// The list of modules: each of a known type, with a name of its own.
void CheckModules(const Expr& list, RobotScope& scope) {
  const bool tuple = list.kind == ExprKind::kTuple && !list.children.empty();
  if (!tuple) {
    scope.diagnostics.Error(list.span, "a robot lists its modules").hint =
        "write modules=(TYPE m1, TYPE m2)";
    scope.names_lost = true;
    return;
  }
  // Entries with errors leave a gap: names in the rest of the robot may then be unknown for that.
  size_t links = 0;
  for (const Expr& expr : list.children) {
    if (scope.diagnostics.full()) return;
    if (scope.robot.modules.size() >= kMaxModules || links > kMaxLinks) {
      scope.diagnostics.Error(expr.span, fmt::format("a robot has at most {} modules and {} links",
                                                     kMaxModules, kMaxLinks));
      scope.names_lost = true;
      return;
    }
    // An entry is a module type and the name of the module.
    if (expr.kind != ExprKind::kTyped || expr.path.size() != 1) {
      scope.diagnostics.Error(expr.span, "expected a module type and a name").hint =
          "write modules=(TYPE m1, TYPE m2)";
      scope.names_lost = true;
      continue;
    }
    const std::optional<int> type = FindModuleType(expr.path[0].text, expr.path[0].span,
                                                   scope.context.modules, &scope.diagnostics);
    scope.names_lost = scope.names_lost || !type;
    if (!type) continue;
    const int index = static_cast<int>(scope.robot.modules.size());
    // Names are unique within the robot; the first of a name counts.
    const auto [it, fresh] = scope.module_index.emplace(expr.bound.text, index);
    if (!fresh) {
      scope.diagnostics.Error(expr.bound.span, "there is another module '" + expr.bound.text + "'")
          .Note(scope.module_spans[it->second], "first used here");
      continue;
    }
    model::ModuleInstance module;
    // A module starts with all its joints at 0 until `joints` says otherwise.
    module.name = expr.bound.text;
    module.type = *type;
    links += scope.context.model.module_types[*type].links.size();
    module.start.assign(scope.context.model.module_types[*type].joints.size(), 0.0);
    scope.robot.modules.push_back(std::move(module));
    scope.module_spans.push_back(expr.bound.span);
  }
}

/// One `m1.joint_1=value`; the place of the value goes into `set`.
void CheckStart(const Expr& entry, RobotScope& scope,
                std::map<std::pair<int, int>, source::Span>& set) {
  if (entry.kind != ExprKind::kAssign || entry.path.size() != 2) {
    scope.diagnostics.Error(entry.span, "expected a start value").hint =
        "write joints=(m1.joint_1=pi/4, m2.joint_1=0)";
    return;
  }
  // The value is evaluated first, so that its errors are found whatever the name is like.
  const std::optional<double> value = EvaluateNumber(entry.children[0], &scope.diagnostics);
  const std::optional<int> module = FindModule(entry.path[0], scope);
  if (!module) return;
  const model::ModuleType& type = scope.TypeOf(*module);
  const std::optional<int> joint = type.FindJoint(entry.path[1].text);
  if (!joint) {
    ReportNoMember(scope.context.modules[scope.robot.modules[*module].type], "joint", entry.path[1],
                   NamesOf(type.joints), "joints are", scope.diagnostics);
    return;
  }
  // Each joint starts once.
  const auto [it, fresh] = set.emplace(std::pair(*module, *joint), entry.span);
  if (!fresh) {
    scope.diagnostics.Error(entry.span, "'" + PathText(entry.path) + "' starts twice")
        .Note(it->second, "first set here");
    return;
  }
  if (!value) return;
  // A slide is a length, so it is in model units, as its limits are.
  const bool slide = type.joints[*joint].type == model::JointType::kPrismatic;
  scope.robot.modules[*module].start[*joint] = slide ? *value * type.unit_m : *value;
}

/// Start values must keep the limits of their joints, those that were given and the default 0.
void CheckStartLimits(RobotScope& scope, const std::map<std::pair<int, int>, source::Span>& set) {
  // A default outside the limits concerns every module of the type: said once.
  std::set<std::pair<int, int>> said;
  for (size_t m = 0; m < scope.robot.modules.size(); ++m) {
    const model::ModuleInstance& module = scope.robot.modules[m];
    const model::ModuleType& type = scope.TypeOf(static_cast<int>(m));
    for (size_t j = 0; j < type.joints.size(); ++j) {
      const model::Joint& joint = type.joints[j];
      const double value = module.start[j];
      if (model::KeepsLimits(joint, value)) continue;
      const auto it = set.find({static_cast<int>(m), static_cast<int>(j)});
      const bool given = it != set.end();
      if (!given && !said.emplace(module.type, static_cast<int>(j)).second) continue;
      // As it was written: lengths in model units.
      const double unit = joint.type == model::JointType::kPrismatic ? type.unit_m : 1.0;
      source::Diagnostic& d = scope.diagnostics.Error(
          given ? it->second : scope.module_spans[m],
          fmt::format("'{}.{}' starts at {}, outside its limits [{}, {}]", module.name, joint.name,
                      NumberText(value / unit), NumberText(joint.lower / unit),
                      NumberText(joint.upper / unit)));
      if (!given) {
        d.hint =
            fmt::format("0 is the default; set it: joints=({}.{}=...)", module.name, joint.name);
      }
      const auto& decls = scope.context.modules[module.type].decl->joints;
      d.notes.push_back({decls[j].name.span, "the joint is declared here"});
    }
  }
}

/// The start values of `joints`, then their limits, if all could be read.
void CheckJoints(const Expr* joints, RobotScope& scope) {
  const int errors = scope.diagnostics.error_count();
  std::map<std::pair<int, int>, source::Span> set;
  // Every entry is read, so that all errors are found.
  if (joints && joints->kind == ExprKind::kTuple) {
    for (const Expr& entry : joints->children) {
      if (scope.diagnostics.full()) return;
      CheckStart(entry, scope, set);
    }
  } else if (joints) {
    scope.diagnostics.Error(joints->span, "'joints' lists start values").hint =
        "write joints=(m1.joint_1=pi/4)";
  }
  if (errors == scope.diagnostics.error_count()) CheckStartLimits(scope, set);
}

/// The list of connections, entry by entry.
void CheckDockings(const Expr& list, RobotScope& scope) {
  if (list.kind != ExprKind::kTuple) {
    scope.diagnostics.Error(list.span, "'connections' lists pairs of connectors").hint =
        "write connections=((m1.c1,m2.c4), (m2.c2,m3.c5))";
    return;
  }
  // Ends without parentheses around each pair: which belong together is not known.
  const bool bare = std::any_of(list.children.begin(), list.children.end(),
                                [](const Expr& e) { return e.kind == ExprKind::kPath; });
  if (bare) {
    scope.names_lost = true;  // What is joined is not known.
    scope.diagnostics.Error(list.span, "each connection is a pair in parentheses").hint =
        "write connections=((m1.c1,m2.c4))";
    return;
  }
  for (const Expr& entry : list.children) {
    if (scope.diagnostics.full()) return;
    CheckDocking(entry, scope);
  }
}

/// True if no module's type has errors.
bool TypesAreSound(const RobotScope& scope) {
  return std::all_of(
      scope.robot.modules.begin(), scope.robot.modules.end(),
      [&](const model::ModuleInstance& m) { return scope.context.modules[m.type].valid; });
}

}  // namespace

std::optional<int> FindModule(const Name& name, const RobotScope& scope) {
  const auto it = scope.module_index.find(name.text);
  if (it != scope.module_index.end()) return it->second;
  if (scope.names_lost || scope.diagnostics.full()) return std::nullopt;
  return scope.diagnostics
      .Error(name.span, fmt::format("robot '{}' has no module '{}'", scope.robot.name, name.text))
      .Hint(NameHint(name.text, NamesOf(scope.robot.modules), "modules are"));
}

void ReportNoMember(const CheckedModule& module, const std::string& what, const Name& name,
                    const std::vector<std::string>& names, const std::string& listing,
                    source::Diagnostics& diagnostics) {
  if (!module.valid) return;
  const std::string& type = module.type.name;
  diagnostics
      .Error(name.span, fmt::format("module type '{}' has no {} '{}'", type, what, name.text))
      .hint = NameHint(name.text, names, listing);
}

}  // namespace internal

std::optional<CheckedRobot> CheckRobot(const RobotDecl& decl, const RobotContext& context,
                                       source::Diagnostics* diagnostics) {
  const int errors = diagnostics->error_count();
  internal::RobotScope scope{decl, context, *diagnostics, {}, {}, {}, false, {}, {}, {}};
  // The parts below share what is known of the robot so far.
  scope.robot.name = decl.name.text;
  AttributeReader attributes(decl, "robot '" + decl.name.text + "'",
                             {"modules", "connections", "frame", "joints"}, diagnostics);
  const Expr* modules = attributes.Required("modules", "write modules=(TYPE m1, TYPE m2)");
  // Modules come first, as all else refers to them by their names.
  if (modules) internal::CheckModules(*modules, scope);
  // Everything else names modules.
  if (!modules || scope.robot.modules.empty()) return std::nullopt;
  // Names are checked even where a type has errors; geometry is not, as it would only repeat them.
  const bool sound = internal::TypesAreSound(scope);
  const Expr* connections = attributes.Optional("connections");
  if (connections) internal::CheckDockings(*connections, scope);
  internal::CheckFrame(attributes.Optional("frame"), scope);
  internal::CheckJoints(attributes.Optional("joints"), scope);
  // Connections under a misspelt key would be missed everywhere.
  const bool lost = !connections && attributes.had_unknown();
  if (!scope.names_lost && !decl.broken && !lost) internal::CheckConnected(scope);
  if (diagnostics->error_count() != errors || decl.broken || !sound) return std::nullopt;
  // An entry without an error may be missing because its connection is unsound.
  if (connections && scope.robot.dockings.size() != connections->children.size()) {
    return std::nullopt;
  }
  // Loops and overlaps need a robot without errors, placed by its dockings.
  internal::CheckGeometry(scope);
  if (diagnostics->error_count() != errors) return std::nullopt;
  return CheckedRobot{std::move(scope.robot), std::move(scope.module_spans),
                      std::move(scope.docking_spans)};
}

}  // namespace morphbus::m3l
