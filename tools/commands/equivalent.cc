// morphbus equivalent: are two robots kinematically congruent?

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "compiler/base/text.h"
#include "compiler/congruence/congruence.h"
#include "compiler/keywords/module_keywords.h"
#include "tools/base/print.h"
#include "tools/commands/commands.h"
#include "tools/roles/binding_comparison.h"
#include "tools/roles/static_roles.h"

namespace morphbus::tools {
namespace {

/// The options of `morphbus equivalent`.
struct EquivalentOptions {
  std::string file;
  std::string robot_a;
  std::string robot_b;
  std::string program;  ///< Empty: none is asked about.
  bool json = false;
};

/// The module that stands for `module`, or null where its joints go to several.
Json CounterpartJson(const model::Robot& b, int module) {
  return module < 0 ? Json() : Json(b.modules[module].name);
}

/// What the program's modules settle on, on a robot that stands still; nothing, after saying why,
/// if that cannot be asked or they never do.
std::optional<StaticRoles> RolesOn(const model::Model& model, const CompiledProgram& program,
                                   const EquivalentOptions& options, const model::Robot& robot) {
  RunOptions run;
  run.model_file = options.file;
  run.program_file = options.program;
  run.robot = robot.name;
  const std::optional<RunPlan> plan = PlanCompiled(run, model, program);
  if (!plan) return std::nullopt;
  Result<StaticRoles> roles = SettleRoles(*plan);
  if (!roles) return Refuse(roles.error().message);
  if (!roles->settled) return Refuse(robot.name + ": the roles of the program never settle");
  return std::move(*roles);
}

/// What the program binds on both; nothing, after saying why, if it cannot be used.
std::optional<BindingComparison> Bindings(const model::Model& model, const model::Robot& a,
                                          const model::Robot& b, const EquivalentOptions& options,
                                          const congruence::Congruence& answer) {
  const std::optional<CompiledProgram> program =
      LoadProgram(options.program, keywords::KeywordsOf(model));
  if (!program) return std::nullopt;
  const std::optional<StaticRoles> roles_a = RolesOn(model, *program, options, a);
  if (!roles_a) return std::nullopt;
  const std::optional<StaticRoles> roles_b = RolesOn(model, *program, options, b);
  if (!roles_b) return std::nullopt;
  return CompareBindings(model, a, *roles_a, b, *roles_b, answer);
}

/// The modules of `a`, each with its counterpart in `b`.
Json::object_t ModulesJson(const model::Robot& a, const model::Robot& b,
                           const congruence::Mapping& mapping) {
  // Names are unique; looking each up among all before it would be quadratic.
  Json::object_t modules;
  for (size_t m = 0; m < a.modules.size(); ++m) {
    modules.emplace_back(a.modules[m].name, CounterpartJson(b, mapping.module_to[m]));
  }
  return modules;
}

/// What the program binds, as docs/cli.md has it.
Json BindingsJson(const model::Robot& a, const model::Robot& b, const std::string& program,
                  const BindingComparison& bindings, const congruence::Congruence& answer) {
  Json json = {{"file", program},
               {"bound_alike", bindings.differences.empty()},
               {"differences", bindings.differences}};
  json["modules"] = ModulesJson(a, b, answer.mappings[bindings.mapping]);
  return json;
}

/// The same as sentences.
void PrintBindings(const model::Robot& a, const model::Robot& b, const std::string& program,
                   const BindingComparison& bindings, const congruence::Congruence& answer) {
  Print("\n{} {} the same roles and labels on both", program,
        bindings.differences.empty() ? "binds" : "does not bind");
  // The mapping above need not be the one under which that is so.
  if (bindings.mapping > 0) {
    const std::vector<int>& to = answer.mappings[bindings.mapping].module_to;
    for (size_t m = 0; m < a.modules.size(); ++m) {
      Print("{}{} = {}", m == 0 ? ", where " : ", ", a.modules[m].name,
            to[m] < 0 ? "several" : b.modules[to[m]].name);
    }
  }
  Print("{}\n", bindings.differences.empty() ? "." : ":");
  for (const std::string& difference : bindings.differences) Print("  {}\n", difference);
}

/// The answer as docs/cli.md has it: a mapping if there is one, else the reason.
Json AnswerJson(const model::Model& model, const model::Robot& a, const model::Robot& b,
                const congruence::Congruence& answer) {
  // Without a mapping there is only the reason to give.
  Json json = {{"congruent", answer.congruent()}, {"mappings", answer.count}};
  if (!answer.count_complete) json["mappings_complete"] = false;
  if (!answer.congruent()) {
    json["reason"] = answer.reason;
    json["locked_computed"] = answer.locked_computed;
    return json;
  }
  const congruence::Mapping& mapping = answer.mappings.front();
  Json::object_t joints;
  for (size_t j = 0; j < mapping.joints.size(); ++j) {
    const congruence::JointImage& image = mapping.joints[j];
    const Json entry = {{"to", JointName(model, b, answer.joints_b[image.to])},
                        // A joint's value q in robot a is sign * q + offset in robot b.
                        {"sign", image.sign > 0.0 ? 1 : -1},
                        {"offset", image.offset}};
    joints.emplace_back(JointName(model, a, answer.joints_a[j]), entry);
  }
  // The rest tells how far the answer goes, and whether the two also weigh and touch alike.
  json["modules"] = ModulesJson(a, b, mapping);
  json["joints"] = std::move(joints);
  json["keeps_frame"] = mapping.keeps_frame;
  json["masses_equal"] = answer.masses.masses_equal;
  json["hulls_equal"] = answer.masses.hulls_equal;
  json["looked_at"] = answer.mappings.size();
  json["masses_equal_in"] = answer.masses_alike;
  json["hulls_equal_in"] = answer.hulls_alike;
  json["locked_computed"] = answer.locked_computed;
  return json;
}

/// The first mapping as a table, modules first, then joints; then how masses and hulls compare.
void PrintMapping(const model::Model& model, const model::Robot& a, const model::Robot& b,
                  const congruence::Congruence& answer) {
  const congruence::Mapping& mapping = answer.mappings.front();
  // Mappings are counted exactly up to a limit; a search that was cut short gives a lower bound.
  const bool more = !answer.count_complete && answer.count == congruence::kMaxCounted;
  Print("{} and {} are congruent, in {}{}.\n", a.name, b.name,
        answer.count_complete ? "" : (more ? "over " : "at least "),
        more ? "1,000 ways" : Counted(answer.count, "way"));
  Print("This one {}:\n\n",
        mapping.keeps_frame ? "keeps the robot frame" : "does not keep the robot frame");
  // Columns are as wide as the longest name in them.
  size_t width_a = std::max<size_t>(a.name.size(), 6);
  size_t width_b = std::max<size_t>(b.name.size(), 6);
  for (const congruence::JointRef& ref : answer.joints_a) {
    width_a = std::max(width_a, JointName(model, a, ref).size());
  }
  for (const congruence::JointRef& ref : answer.joints_b) {
    width_b = std::max(width_b, JointName(model, b, ref).size());
  }
  Print("{:<{}}  {:<{}}  sign  offset\n", a.name, width_a, b.name, width_b);
  for (size_t m = 0; m < a.modules.size(); ++m) {
    // -1 marks a module whose joints go to several modules of b.
    const int to = mapping.module_to[m];
    Print("{:<{}}  {}\n", a.modules[m].name, width_a,
          to < 0 ? "(its joints belong to several modules)" : b.modules[to].name);
  }
  for (size_t j = 0; j < mapping.joints.size(); ++j) {
    const congruence::JointImage& image = mapping.joints[j];
    const congruence::JointRef& joint = answer.joints_a[j];
    Print("{:<{}}  {:<{}}  {:>4}  {:.6g} {}{}\n", JointName(model, a, joint), width_a,
          JointName(model, b, answer.joints_b[image.to]), width_b, image.sign > 0.0 ? "+" : "-",
          image.offset, joint.slide ? "m" : "rad", joint.locked ? "  locked" : "");
  }
  // Congruent robots move alike; whether they also weigh and touch alike is another question.
  const congruence::MassComparison& masses = answer.masses;
  Print("\nmasses: {}\nhulls:  {}\n",
        masses.masses_equal ? "alike" : "different: " + masses.mass_difference,
        masses.hulls_equal ? "alike" : "different: " + masses.hull_difference);
  // Only some of many mappings were looked at; the counts are of these.
  const size_t ways = answer.mappings.size();
  if (ways < 2) return;
  Print("Of {} ways{}, masses are alike in {}, hulls in {}.\n", ways,
        static_cast<int64_t>(ways) < answer.count ? " that were looked at" : "",
        answer.masses_alike, answer.hulls_alike);
}

/// Compares two robots of one file. Given up is neither yes nor no: status 2.
int Equivalent(const EquivalentOptions& options) {
  const std::optional<model::Model> model = LoadModel({options.file});
  if (!model) return kUnusable;
  // Both names are looked up, so that both mistakes are reported at once.
  const model::Robot* a = PickRobot(*model, options.robot_a);
  const model::Robot* b = PickRobot(*model, options.robot_b);
  if (a == nullptr || b == nullptr) return kUnusable;
  // Both robots are of one model; they may share module types or not.
  const congruence::Congruence answer = congruence::Compare(*model, *a, *model, *b);
  // A search that was given up is no answer.
  if (!answer.decided) {
    const std::string reason =
        fmt::format("{} and {}: given up after many attempts; too many of their bodies look alike",
                    a->name, b->name);
    if (options.json) PrintJson({{"congruent", nullptr}, {"reason", reason}});
    return Unusable(reason);
  }
  if (!answer.locked_computed) {
    Warn(
        "over 500 joints in one part with loops: which of them are locked was not computed, so "
        "their values were not compared");
  }
  // What a program binds can be compared only along a mapping from the one robot to the other.
  std::optional<BindingComparison> bindings;
  if (!options.program.empty() && answer.congruent()) {
    bindings = Bindings(*model, *a, *b, options, answer);
    if (!bindings) return kUnusable;
  }
  if (options.json) {
    Json json = AnswerJson(*model, *a, *b, answer);
    if (bindings) json["program"] = BindingsJson(*a, *b, options.program, *bindings, answer);
    PrintJson(json);
  } else if (answer.congruent()) {
    PrintMapping(*model, *a, *b, answer);
    if (bindings) PrintBindings(*a, *b, options.program, *bindings, answer);
  } else {
    Print("{} and {} are not congruent:\n{}\n", a->name, b->name, answer.reason);
  }
  return answer.congruent() && (!bindings || bindings->differences.empty()) ? kDone : kNo;
}

}  // namespace

void AddEquivalent(CommandLine* line) {
  Subcommand sub = line->Add("equivalent", "Are two robots kinematically congruent?");
  auto options = std::make_shared<EquivalentOptions>();
  sub.Add("FILE.m3l", &options->file, "M3L file").Required();
  sub.Add("R1", &options->robot_a, "A robot").TypeName("ROBOT").Required();
  sub.Add("R2", &options->robot_b, "The other; may be the same one").TypeName("ROBOT").Required();
  sub.Add("--program", &options->program,
          "DynaRole program or image: does it bind the same roles and labels on both?")
      .TypeName("PROG.dyn");
  sub.Json(&options->json);
  sub.Footer(
      "Exit status 0: congruent, with a mapping, and --program binds alike; 1: not, with the "
      "reason.\n"
      "Examples:\n  morphbus equivalent models/mtran.m3l quadruped equivalent_quadruped\n"
      "  morphbus equivalent models/mtran.m3l quadruped equivalent_quadruped --program "
      "models/programs/quadruped.dyn");
  sub.Do([options] { return Equivalent(*options); });
}

}  // namespace morphbus::tools
