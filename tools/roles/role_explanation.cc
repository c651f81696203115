#include "tools/roles/role_explanation.h"

#include <fmt/format.h>

#include "tools/base/messages.h"
#include "tools/base/program.h"
#include "tools/roles/static_robot.h"
#include "vm/image/disassembler.h"
#include "vm/image/fault_text.h"
#include "vm/vm.h"

namespace morphbus::tools {
namespace {

/// ", measured 2 against 2 and 1 against 3": what was compared on the way; empty if nothing was.
std::string MeasuredText(const vm::Comparisons& compared, const vm::VerifiedProgram& program) {
  // Of a loop's comparisons the first ones are kept, and the last.
  std::string text;
  for (int i = 0; i < compared.num_kept(); ++i) {
    text += i == 0 ? ", measured " : " and ";
    text += vm::ComparisonText(compared.kept[i], program);
  }
  const int more = compared.count - compared.num_kept();
  if (more > 0) text += fmt::format(" ({} more between the last two)", more);
  return text;
}

/// What the evaluation of a requirement found.
ExplainedPart Requirement(const vm::Evaluation& evaluation, const vm::VerifiedProgram& program) {
  ExplainedPart part;
  const vm::RunResult& result = evaluation.result;
  const std::string measured = MeasuredText(evaluation.compared, program);
  part.holds = result.status == vm::RunStatus::kFinished && result.value.AsBool();
  // A requirement that ends with a fault fails as well, but for another reason than what it asks.
  if (result.status == vm::RunStatus::kFinished) {
    part.finding = (part.holds ? "holds" : "does not hold") + measured;
  } else {
    part.finding = fmt::format("ends with a fault, {}{}", vm::FaultName(result.fault), measured);
  }
  return part;
}

/// The number of the role called `name`, or why there is none.
Result<int> FindRole(const vm::VerifiedProgram& program, const std::string& name) {
  std::vector<std::string> names;
  for (int r = 0; r < program.num_roles(); ++r) {
    names.push_back(ToString(program.role(r).name));
    if (names.back() == name) return r;
  }
  return Fail(fmt::format("the program has no role '{}'{}", name, DidYouMean(name, names)));
}

/// What role number `number` asks of the module, as it stands.
/// `file` is the path of the program.
RoleExplanation Explain(const StaticRobot::Module& asked, const vm::VerifiedProgram& program,
                        const std::string& file, int number) {
  const vm::SourceFiles files(program);
  vm::Vm& vm = asked.instance->controller().vm();
  const vm::RoleInfo info = program.role(number);
  // What holds for the role as a whole, whatever its parts say.
  RoleExplanation out;
  out.role = ToString(info.name);
  out.place = files.Of(program.LineOfRole(number), file);
  out.is_abstract = info.abstract_role;
  out.has_pose = asked.report.has_pose;
  const vm::RoleCheck check = vm.CheckRole(number);
  out.fits = check.fits() && out.has_pose && !out.is_abstract;
  if (asked.report.role >= 0) out.held = ToString(program.role(asked.report.role).name);
  // A type without one of the words has no values for what follows.
  if (check.missing_keyword >= 0) {
    out.lacks = ToString(program.keyword(check.missing_keyword).name);
    return out;
  }
  for (int l = 0; l < info.num_labels; ++l) {
    const int label = info.labels[l];
    const vm::RunResult result = vm.EvaluateAs(number, label).result;
    ExplainedPart& part = out.parts.emplace_back();
    part.label = ToString(program.member_name(label));
    part.place = files.Of(program.LineOf(label, 0), file);
    part.holds = result.status == vm::RunStatus::kFinished;
    part.finding = LabelFinding(program.function(label), result, asked.instance->type());
  }
  // Requirements come after the labels, which they may use.
  for (int i = 0; i < info.num_requirements; ++i) {
    out.parts.push_back(Requirement(vm.EvaluateAs(number, info.requirements[i]), program));
    out.parts.back().place = files.Of(program.LineOf(info.requirements[i], 0), file);
  }
  return out;
}

}  // namespace

std::string LabelFinding(const vm::FunctionInfo& label, const vm::RunResult& result,
                         const vm::VerifiedKinematics& type) {
  // The number found is that of a joint or of a link, by the label's type.
  const bool is_link = label.return_type == vm::ValueType::kLink;
  if (result.status == vm::RunStatus::kFinished) {
    const int target = result.value.AsInt();
    return "is " + ToString(is_link ? type.link(target).name : type.joint(target).name);
  }
  // Whatever else goes wrong in a label is a fault of the program, and says nothing of the module.
  if (result.fault != vm::FaultCode::kUnresolved) {
    return fmt::format("ends with a fault, {}", vm::FaultName(result.fault));
  }
  return fmt::format("fits {} {}, and one is wanted",
                     result.num_found == 0 ? "no" : std::to_string(result.num_found),
                     is_link ? "links" : "joints");
}

Result<std::vector<RoleExplanation>> ExplainRoles(const RunPlan& plan, const std::string& module,
                                                  const std::string& role,
                                                  const Situation* situation) {
  const Result<int> index = FindModule(plan.robot(), module);
  if (!index) return Fail(index.error().message);
  const Result<std::unique_ptr<StaticRobot>> robot = StaticRobot::Create(plan, situation);
  if (!robot) return Fail(robot.error().message);
  const vm::VerifiedProgram& program = (*robot)->program();
  std::vector<int> numbers;
  if (!role.empty()) {
    const Result<int> number = FindRole(program, role);
    if (!number) return Fail(number.error().message);
    numbers.push_back(*number);
  }
  // Without a role's name all are explained that a module could take.
  for (int r = 0; role.empty() && r < program.num_roles(); ++r) {
    if (!program.role(r).abstract_role) numbers.push_back(r);
  }
  if (numbers.empty()) return Fail("the program has no roles that a module could take");
  // The rest is asked of the module as it stands when nothing changes any more.
  (*robot)->Settle();
  std::vector<RoleExplanation> all;
  for (const int number : numbers) {
    all.push_back(
        Explain(*(*robot)->modules()[*index], program, plan.description.program_file(), number));
    all.back().module = module;
  }
  return all;
}

}  // namespace morphbus::tools
