#include "tools/roles/static_roles.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "compiler/base/text.h"
#include "compiler/base/utf8.h"
#include "tools/base/files.h"
#include "tools/base/program.h"
#include "tools/roles/role_explanation.h"
#include "vm/image/disassembler.h"
#include "vm/image/fault_text.h"
#include "vm/image/image_texts.h"
#include "vm/vm.h"

namespace morphbus::tools {
namespace {

using Module = StaticRobot::Module;

/// Puts what the modules of a settled robot have into words.
class RoleWriter {
 public:
  explicit RoleWriter(const StaticRobot& robot)
      : robot_(robot), program_(robot.program()), files_(program_) {}

  /// What the module has settled on, by names.
  [[nodiscard]] StaticRole Describe(const Module& module) const {
    StaticRole out;
    out.module = module.instance->name();
    if (module.silent) return out;
    // Faults stand before a missing role, which may follow from them.
    for (const NotedFault& noted : module.faults) {
      const std::string function = vm::FaultFunction(noted.fault, &program_);
      const vm::SourcePlace place = PlaceOf(noted.fault.line);
      out.problems.push_back(
          {out.module + ": " + vm::FaultLine(place.file, place.line, noted.sentence, function),
           vm::FaultLine("", 0, noted.sentence, function), place});
    }
    // A module without a role has no labels and no signs.
    if (module.report.role < 0) {
      ExplainMissingRole(module, &out.problems);
      return out;
    }
    const vm::RoleInfo role = program_.role(module.report.role);
    out.role = ToString(role.name);
    // Signs are listed under the label, and under the joint's own name where it has none.
    const vm::VerifiedKinematics& type = module.instance->type();
    std::vector<bool> labelled(static_cast<size_t>(type.num_joints()));
    for (int l = 0; l < role.num_labels; ++l) {
      const int target = module.report.labels[l];
      // The label has not resolved to anything.
      if (target < 0) continue;
      const std::string name = ToString(program_.member_name(role.labels[l]));
      const bool is_link = program_.function(role.labels[l]).return_type == vm::ValueType::kLink;
      out.labels[name] = ToString(is_link ? type.link(target).name : type.joint(target).name);
      if (is_link) continue;
      labelled[target] = true;
      if (module.report.signs[target] != 0) out.signs[name] = module.report.signs[target];
    }
    // What remains are joints with a convention but without a label.
    for (int j = 0; j < type.num_joints(); ++j) {
      if (module.report.signs[j] == 0 || labelled[j]) continue;
      out.signs[ToString(type.joint(j).name)] = module.report.signs[j];
    }
    return out;
  }

  /// A role that nobody plays, with the module that comes nearest.
  [[nodiscard]] UnplayedRole DescribeUnplayed(int role) const {
    UnplayedRole out{
        ToString(program_.role(role).name), PlaceOf(program_.LineOfRole(role)), "", {}};
    int most = -1;
    for (const auto& module : robot_.modules()) {
      // Requirements ask where the module is, so that without a pose none can be checked.
      if (module->silent || !module->report.has_pose) continue;
      const int met = NumMet(role, module->instance->controller().vm().CheckRole(role));
      // Of modules that come equally far the first one is named.
      if (met <= most) continue;
      most = met;
      out.nearest = module->instance->name();
      out.lacks = WhyNot(*module, role).value_or(RoleProblem());
    }
    return out;
  }

  /// Where a line of the program stands.
  [[nodiscard]] vm::SourcePlace PlaceOf(int line) const {
    return files_.Of(line, robot_.plan().description.program_file());
  }

 private:
  /// A sentence that the requirement there fails, with its text if PROGRAM is source.
  [[nodiscard]] std::string RequirementText(const vm::SourcePlace& at) const {
    const std::string place = fmt::format("a requirement fails ({}:{}", at.file, at.line);
    const Result<std::string> source = ReadFile(at.file);
    // An image does not hold its source.
    if (!source || !IsUtf8(*source)) return place + ")";
    // The line is looked up in the source as it is now.
    std::istringstream lines(*source);
    std::string text;
    for (int i = 0; i < at.line; ++i) std::getline(lines, text);
    const size_t begin = std::min(text.find_first_not_of(" \t"), text.size());
    return place + ": " + EscapeControl(text.substr(begin)) + ")";
  }

  /// Adds why the module takes none of the concrete roles.
  void ExplainMissingRole(const Module& module, std::vector<RoleProblem>* problems) const {
    // Roles rest on where modules are, which spreads from the root over connections.
    if (!module.report.has_pose) {
      const char* why = "no pose reaches it, so it can take no role";
      problems->push_back({module.instance->name() + ": " + why, why, {}});
      return;
    }
    if (vm::PlayableRoles(program_).empty()) {
      const char* why = "all roles of the program are abstract, so it can take none";
      problems->push_back({module.instance->name() + ": " + why, why, {}});
    }
    for (int r = 0; r < program_.num_roles(); ++r) {
      if (program_.role(r).abstract_role) continue;
      if (std::optional<RoleProblem> problem = WhyNot(module, r)) {
        problems->push_back(*std::move(problem));
      }
    }
  }

  /// How far the VM comes with what the role asks for: its keywords, each requirement, each label.
  [[nodiscard]] int NumMet(int role, const vm::RoleCheck& check) const {
    const int requirements = program_.role(role).num_requirements;
    if (check.missing_keyword >= 0) return 0;
    if (check.failed_requirement >= 0) return 1 + check.failed_requirement;
    if (check.failed_label >= 0) return 1 + requirements + check.failed_label;
    return 1 + requirements + program_.role(role).num_labels;
  }

  /// What fails first in a role for a module, in the order in which the VM looks; nothing if the
  /// module fits.
  [[nodiscard]] std::optional<RoleProblem> WhyNot(const Module& module, int r) const {
    const vm::RoleInfo role = program_.role(r);
    const vm::RoleCheck check = module.instance->controller().vm().CheckRole(r);
    const std::string not_it = fmt::format("not {}: ", ToString(role.name));
    std::string text, brief;
    // The VM asks for keywords first, then for requirements, then for labels, and stops at the
    // first that fails. Without a line of its own the role's declaration is named.
    int line = program_.LineOfRole(r);
    if (check.missing_keyword >= 0) {
      text = brief =
          fmt::format("its type has no {}", ToString(program_.keyword(check.missing_keyword).name));
    } else if (check.failed_requirement >= 0) {
      line = program_.LineOf(role.requirements[check.failed_requirement], 0);
      text = RequirementText(PlaceOf(line));
      brief = "this requirement fails";
      // A requirement that came to a comparison tells what it compared, and so by how much it
      // fails.
      if (check.measured.opcode != vm::Opcode::kPop) {
        const std::string measured = ", measured " + vm::ComparisonText(check.measured, program_);
        text += measured;
        brief += measured;
      }
    } else if (check.failed_label >= 0) {
      const int label = role.labels[check.failed_label];
      line = program_.LineOf(label, 0);
      // A label is evaluated once more, since the check only tells which one failed.
      const vm::RunResult result = module.instance->controller().vm().EvaluateAs(r, label).result;
      text = brief =
          fmt::format("label {} {}", ToString(program_.member_name(label)),
                      LabelFinding(program_.function(label), result, module.instance->type()));
    } else {
      return std::nullopt;
    }
    return RoleProblem{module.instance->name() + ": " + not_it + text, not_it + brief,
                       PlaceOf(line)};
  }

  const StaticRobot& robot_;
  const vm::VerifiedProgram& program_;
  const vm::SourceFiles files_;
};

}  // namespace

Result<StaticRoles> SettleRoles(const RunPlan& plan, const Situation* situation) {
  const Result<std::unique_ptr<StaticRobot>> robot = StaticRobot::Create(plan, situation);
  if (!robot) return Fail(robot.error().message);
  StaticRoles roles;
  roles.program_file = plan.description.program_file();
  roles.settled = (*robot)->Settle();
  roles.ticks = (*robot)->ticks();
  // What every module has, and which roles nobody has.
  const RoleWriter writer(**robot);
  const vm::VerifiedProgram& program = (*robot)->program();
  std::vector<bool> played(static_cast<size_t>(program.num_roles()));
  for (const auto& module : (*robot)->modules()) {
    roles.modules.push_back(writer.Describe(*module));
    if (module->report.role >= 0) played[module->report.role] = true;
  }
  for (int r = 0; r < program.num_roles(); ++r) {
    if (played[r] || program.role(r).abstract_role) continue;
    roles.unplayed.push_back(writer.DescribeUnplayed(r));
  }
  const auto asks_for_id = [](vm::Opcode op) { return op == vm::Opcode::kId; };
  for (const int line : FindInstructions(program, asks_for_id).lines) {
    roles.id_places.push_back(writer.PlaceOf(line));
  }
  return roles;
}

bool HasRoles(const RunPlan& plan) {
  const Result<std::unique_ptr<vm::VerifiedProgram>> program =
      VerifyProgram(plan.description.program_image());
  return program && (*program)->num_roles() > 0;
}

}  // namespace morphbus::tools
