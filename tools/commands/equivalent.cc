// morphbus equivalent: are two robots kinematically congruent?

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "compiler/base/text.h"
#include "compiler/congruence/congruence.h"
#include "tools/commands/commands.h"

namespace morphbus::tools {
namespace {

/// The options of `morphbus equivalent`.
struct EquivalentOptions {
  std::string file;
  std::string robot_a;
  std::string robot_b;
  bool json = false;
};

/// The module that stands for `module`, or null where its joints go to several.
Json CounterpartJson(const model::Robot& b, int module) {
  return module < 0 ? Json() : Json(b.modules[module].name);
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
  // Names are unique; looking each up among all before it would be quadratic.
  Json::object_t modules;
  for (size_t m = 0; m < a.modules.size(); ++m) {
    modules.emplace_back(a.modules[m].name, CounterpartJson(b, mapping.module_to[m]));
  }
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
  json["modules"] = std::move(modules);
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
  fmt::print("{} and {} are congruent, in {}{}.\n", a.name, b.name,
             answer.count_complete ? "" : (more ? "over " : "at least "),
             more ? "1,000 ways" : Counted(answer.count, "way"));
  fmt::print("This one {}:\n\n",
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
  fmt::print("{:<{}}  {:<{}}  sign  offset\n", a.name, width_a, b.name, width_b);
  for (size_t m = 0; m < a.modules.size(); ++m) {
    // -1 marks a module whose joints go to several modules of b.
    const int to = mapping.module_to[m];
    fmt::print("{:<{}}  {}\n", a.modules[m].name, width_a,
               to < 0 ? "(its joints belong to several modules)" : b.modules[to].name);
  }
  for (size_t j = 0; j < mapping.joints.size(); ++j) {
    const congruence::JointImage& image = mapping.joints[j];
    const congruence::JointRef& joint = answer.joints_a[j];
    fmt::print("{:<{}}  {:<{}}  {:>4}  {:.6g} {}{}\n", JointName(model, a, joint), width_a,
               JointName(model, b, answer.joints_b[image.to]), width_b,
               image.sign > 0.0 ? "+" : "-", image.offset, joint.slide ? "m" : "rad",
               joint.locked ? "  locked" : "");
  }
  // Congruent robots move alike; whether they also weigh and touch alike is another question.
  const congruence::MassComparison& masses = answer.masses;
  fmt::print("\nmasses: {}\nhulls:  {}\n",
             masses.masses_equal ? "alike" : "different: " + masses.mass_difference,
             masses.hulls_equal ? "alike" : "different: " + masses.hull_difference);
  // Only some of many mappings were looked at; the counts are of these.
  const size_t ways = answer.mappings.size();
  if (ways < 2) return;
  fmt::print("Of {} ways{}, masses are alike in {}, hulls in {}.\n", ways,
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
  if (options.json) {
    PrintJson(AnswerJson(*model, *a, *b, answer));
  } else if (answer.congruent()) {
    PrintMapping(*model, *a, *b, answer);
  } else {
    fmt::print("{} and {} are not congruent:\n{}\n", a->name, b->name, answer.reason);
  }
  return answer.congruent() ? kDone : kNo;
}

}  // namespace

void AddEquivalent(CommandLine* line) {
  Subcommand sub = line->Add("equivalent", "Are two robots kinematically congruent?");
  auto options = std::make_shared<EquivalentOptions>();
  sub.Add("FILE", &options->file, "M3L file").Required();
  sub.Add("R1", &options->robot_a, "A robot").Required();
  sub.Add("R2", &options->robot_b, "The other; may be the same one").Required();
  sub.Json(&options->json);
  sub.Footer(
      "Exit status 0: congruent, with a mapping; 1: not, with the reason.\n"
      "Example:\n  morphbus equivalent models/mtran.m3l quadruped equivalent_quadruped");
  sub.Do([options] { return Equivalent(*options); });
}

}  // namespace morphbus::tools
