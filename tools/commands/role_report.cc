#include "tools/commands/role_report.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "compiler/base/columns.h"
#include "compiler/base/utf8.h"
#include "tools/base/files.h"
#include "tools/base/messages.h"
#include "tools/base/print.h"

namespace morphbus::tools {
namespace {

/// Model and program as text, and places in both.
class BothSources {
 public:
  BothSources(const RunPlan& plan, ModelSource model) : plan_(plan), model_(std::move(model)) {}

  /// Where the model declares a module of the robot.
  [[nodiscard]] source::Span ModuleAt(const std::string& name) const {
    return model_.modules[plan_.robot_index][*plan_.robot().FindModule(name)];
  }
  /// What stands on a line of the program; nothing where that is not known.
  [[nodiscard]] std::optional<source::Span> LineAt(const vm::SourcePlace& place) {
    const int file = place.line < 1 ? -1 : FileOf(place.file);
    if (file < 0) return std::nullopt;
    const std::string_view text = model_.sources.text(file);
    // The line's first byte, then what is not indentation.
    size_t begin = 0;
    for (int i = 1; i < place.line && begin < text.size(); ++i) {
      begin = std::min(text.find('\n', begin), text.size() - 1) + 1;
    }
    begin = text.find_first_not_of(" \t", begin);
    // The file may have been changed since.
    if (begin == std::string_view::npos) return std::nullopt;
    size_t end = std::min(text.find('\n', begin), text.size());
    // A comment behind the line is no part of what it says.
    end = std::min(text.find("//", begin), end);
    while (end > begin + 1 && (text[end - 1] == ' ' || text[end - 1] == '\r')) --end;
    return source::Span{file, begin, end};
  }
  [[nodiscard]] const source::SourceSet& sources() const { return model_.sources; }

 private:
  /// The number of a file of the program among the sources; -1 if there is only an image, which
  /// does not hold its source.
  int FileOf(const std::string& path) {
    const auto [known, fresh] = files_.try_emplace(path, -1);
    if (!fresh) return known->second;
    Result<std::string> text = ReadFile(path);
    if (text && IsUtf8(*text)) known->second = model_.sources.AddText(path, std::move(*text));
    return known->second;
  }

  const RunPlan& plan_;
  ModelSource model_;
  std::map<std::string, int> files_;
};

/// A module's problems: where the model declares it, then each place of the program.
void AddProblems(BothSources& both, const StaticRole& module, source::Diagnostics* diagnostics) {
  const std::string& name = module.module;
  source::Diagnostic& diagnostic = diagnostics->Warning(
      both.ModuleAt(name), module.role.empty()
                               ? fmt::format("module {} takes no role", name)
                               : fmt::format("module {} plays {}", name, module.role));
  // What has no place in the program, or whose program is an image, joins the sentence.
  for (const RoleProblem& problem : module.problems) {
    if (const std::optional<source::Span> at = both.LineAt(problem.place)) {
      diagnostic.Note(*at, problem.brief);
    } else {
      diagnostic.message += ": " + problem.brief;
    }
  }
}

/// A role that no module plays, which may be one for other robots: where the program declares it,
/// and what the module that comes nearest lacks.
void AddUnplayed(BothSources& both, const RunPlan& plan, const UnplayedRole& role,
                 source::Diagnostics* diagnostics) {
  source::Diagnostic& diagnostic = diagnostics->Warning(
      // Without the program's text the warning has no place, which -1 stands for.
      both.LineAt(role.place).value_or(source::Span{-1, 0, 0}),
      fmt::format("no module of robot {} takes role {}", plan.robot().name, role.name));
  const std::string& nearest = role.nearest;
  // A role that some module fits, and that none has, is held back by another role of that module.
  if (!nearest.empty()) {
    // Without its text the program's line cannot be shown, and what is wrong joins the sentence.
    const std::optional<source::Span> at = both.LineAt(role.lacks.place);
    const std::string why = role.lacks.brief.empty() ? "fits it, and has another role"
                            : at                     ? "comes nearest"
                                                     : "comes nearest: " + role.lacks.brief;
    diagnostic.Note(both.ModuleAt(nearest), fmt::format("module {} {}", nearest, why));
    if (at && !role.lacks.brief.empty()) diagnostic.Note(*at, role.lacks.brief);
  }
  diagnostic.Hint(fmt::format("--why {} {} tells what it lacks",
                              nearest.empty() ? "MODULE" : nearest, role.name));
}

/// Problems of several modules, and roles that no module plays, with carets.
void PrintProblems(const RunPlan& plan, const StaticRoles& roles, ModelSource source) {
  // Of a large robot the first modules show what is wrong with all.
  BothSources both(plan, std::move(source));
  source::Diagnostics diagnostics;
  size_t with_problems = 0;
  for (const StaticRole& module : roles.modules) {
    if (!module.problems.empty() && ++with_problems <= kMostNamed) {
      AddProblems(both, module, &diagnostics);
    }
  }
  for (const UnplayedRole& role : roles.unplayed) AddUnplayed(both, plan, role, &diagnostics);
  for (const vm::SourcePlace& place : roles.id_places) {
    diagnostics.Warning(both.LineAt(place).value_or(source::Span{-1, 0, 0}),
                        "the program asks for the module's number: what it does no longer follows "
                        "from where a module is");
  }
  // This is the answer, so it goes to stdout, other than the compiler's diagnostics.
  const bool color = IsFancyTerminal(STDOUT_FILENO);
  PrintText(source::Render(diagnostics, both.sources(), color));
  if (with_problems > kMostNamed) {
    Print("and {} modules more with problems (--json names all)\n", with_problems - kMostNamed);
  }
  if (!roles.settled) Print("problem: roles still change after {} ticks\n", roles.ticks);
}

/// "knee = joint_1 (+)": the sign only where the program sets a convention.
std::string LabelsText(const StaticRole& module) {
  std::string labels;
  for (const auto& [label, target] : module.labels) {
    labels += fmt::format("{}{} = {}", labels.empty() ? "" : ", ", label, target);
    const auto sign = module.signs.find(label);
    if (sign != module.signs.end()) labels += sign->second > 0 ? " (+)" : " (-)";
  }
  return labels;
}

int NumPlaying(const StaticRoles& roles) {
  return static_cast<int>(std::count_if(roles.modules.begin(), roles.modules.end(),
                                        [](const StaticRole& m) { return !m.role.empty(); }));
}

/// By program, the roles that no module of any of the robots takes. Programs that do not compile
/// have none.
std::map<std::string, std::vector<std::string>> NeverPlayed(const std::vector<Recognized>& found) {
  std::map<std::string, std::vector<std::string>> never;
  for (const Recognized& one : found) {
    if (!one.roles) continue;
    std::vector<std::string> names;
    for (const UnplayedRole& role : one.roles->unplayed) names.push_back(role.name);
    const auto [entry, is_first] = never.try_emplace(one.program, names);
    // What was missing on all robots so far, and is missing on this one, too.
    if (is_first) continue;
    std::erase_if(entry->second, [&](const std::string& name) {
      return std::find(names.begin(), names.end(), name) == names.end();
    });
  }
  return never;
}

const char* FitName(Fit fit) {
  constexpr const char* kNames[] = {"no", "partly", "yes"};
  return kNames[static_cast<int>(fit)];
}

}  // namespace

Json RolesJson(const StaticRoles& roles) {
  Json modules = Json::object();
  Json problems = Json::array();
  for (const StaticRole& module : roles.modules) {
    // Both maps are empty for a module without a role.
    Json labels = Json::object();
    for (const auto& [label, target] : module.labels) labels[label] = target;
    Json signs = Json::object();
    for (const auto& [label, sign] : module.signs) signs[label] = sign;
    modules[module.module] = {{"role", module.role.empty() ? Json(nullptr) : Json(module.role)},
                              {"labels", labels},
                              {"signs", signs}};
    for (const RoleProblem& problem : module.problems) problems.push_back(problem.text);
  }
  // Roles that never settle are a problem of the program, and one for all modules.
  if (!roles.settled)
    problems.push_back(fmt::format("roles still change after {} ticks", roles.ticks));
  Json unplayed = Json::array();
  for (const UnplayedRole& role : roles.unplayed) unplayed.push_back(role.name);
  // Lines alone are those of the program's own file.
  Json id_lines = Json::array(), id_places = Json::array();
  for (const vm::SourcePlace& place : roles.id_places) {
    if (place.file == roles.program_file) id_lines.push_back(place.line);
    id_places.push_back({{"file", place.file}, {"line", place.line}});
  }
  return {{"modules", modules},
          {"problems", problems},
          {"unplayed", unplayed},
          {"id_lines", id_lines},
          {"id_places", id_places}};
}

void PrintRoles(const RunPlan& plan, const StaticRoles& roles, ModelSource source) {
  std::vector<std::vector<std::string>> rows = {
      {"module", "role", "labels (sign under setJointAxis)"}};
  for (const StaticRole& module : roles.modules) {
    // A module without a role has no labels either.
    rows.push_back(
        {module.module, module.role.empty() ? "(none)" : module.role, LabelsText(module)});
  }
  PrintText(Columns(rows));
  PrintProblems(plan, roles, std::move(source));
}

Fit FitOf(const Recognized& one) {
  if (!one.roles) return Fit::kNone;
  const bool sound =
      one.roles->settled && std::all_of(one.roles->modules.begin(), one.roles->modules.end(),
                                        [](const StaticRole& m) { return m.problems.empty(); });
  const int playing = NumPlaying(*one.roles);
  if (sound && playing == static_cast<int>(one.roles->modules.size())) return Fit::kAll;
  return playing > 0 ? Fit::kSome : Fit::kNone;
}

Json RecognizedJson(const std::vector<Recognized>& found) {
  Json answers = Json::array();
  for (const Recognized& one : found) {
    Json answer = {{"program", one.program},
                   {"robot", one.robot},
                   {"compiles", one.roles.has_value()},
                   {"fits", FitName(FitOf(one))}};
    if (one.roles) answer.update(RolesJson(*one.roles));
    answers.push_back(std::move(answer));
  }
  Json never = Json::object();
  for (const auto& [program, names] : NeverPlayed(found)) never[program] = names;
  return {{"answers", answers}, {"unplayed", never}};
}

void PrintRecognized(const std::vector<Recognized>& found) {
  std::vector<std::vector<std::string>> rows = {{"program", "robot", "fits"}};
  for (const Recognized& one : found) {
    std::string more = "does not compile for this model";
    // How many take part, and what is wrong with the rest.
    if (one.roles) {
      more = fmt::format("{} of {} modules take a role", NumPlaying(*one.roles),
                         one.roles->modules.size());
      // The first problem is mostly the reason of all.
      for (const StaticRole& module : one.roles->modules) {
        if (module.problems.empty()) continue;
        more += fmt::format("; {}: {}", module.module, module.problems[0].brief);
        break;
      }
    }
    rows.push_back({one.program, one.robot, FitName(FitOf(one)), more});
  }
  PrintText(Columns(rows));
  // Roles that are for none of the robots asked about.
  std::set<std::string> robots;
  for (const Recognized& one : found) robots.insert(one.robot);
  const std::string these = robots.size() > 1 ? "these robots" : "robot " + *robots.begin();
  for (const auto& [program, names] : NeverPlayed(found)) {
    if (names.empty()) continue;
    Print("{}: no module of {} takes {}\n", program, these, NameSome(names));
  }
}

namespace {

Json ExplanationJson(const RoleExplanation& why) {
  // Labels and requirements are in one list, in the order of their evaluation.
  Json parts = Json::array();
  for (const ExplainedPart& part : why.parts) {
    parts.push_back({{"kind", part.label.empty() ? "requirement" : "label"},
                     {"label", part.label.empty() ? Json(nullptr) : Json(part.label)},
                     {"file", part.place.file},
                     {"line", part.place.line},
                     {"holds", part.holds},
                     {"finding", part.finding}});
  }
  return {{"module", why.module},
          {"role", why.role},
          {"fits", why.fits},
          {"abstract", why.is_abstract},
          {"has_pose", why.has_pose},
          {"held", why.held.empty() ? Json(nullptr) : Json(why.held)},
          {"lacks", why.lacks.empty() ? Json(nullptr) : Json(why.lacks)},
          {"parts", parts}};
}

/// What speaks against a role as a whole, then its labels and requirements; without those that hold
/// unless `all`.
void PrintParts(BothSources& both, const RoleExplanation& why, bool all) {
  const bool color = IsFancyTerminal(STDOUT_FILENO);
  // A place of the program with what was found there; without the text, the line's number.
  const auto say = [&](const vm::SourcePlace& place, const std::string& text) {
    if (const std::optional<source::Span> at = both.LineAt(place)) {
      PrintText(source::RenderNote({*at, text}, both.sources(), color));
    } else {
      Print("{}:{}: {}\n", place.file, place.line, text);
    }
  };
  // Three things can speak against it: that it is abstract, that the type lacks a keyword, and
  // parts that do not hold.
  if (why.is_abstract) say(why.place, "the role is abstract: only its subroles are taken");
  if (!why.lacks.empty()) say(why.place, "the module's type has no " + why.lacks);
  for (const ExplainedPart& part : why.parts) {
    if (part.holds && !all) continue;
    say(part.place,
        part.label.empty() ? part.finding : fmt::format("label {} {}", part.label, part.finding));
  }
}

}  // namespace

Json ExplanationsJson(const std::vector<RoleExplanation>& roles) {
  if (roles.size() == 1) return ExplanationJson(roles.front());
  Json list = Json::array();
  for (const RoleExplanation& role : roles) list.push_back(ExplanationJson(role));
  const Json& first = list.front();
  return {{"module", first["module"]}, {"held", first["held"]}, {"roles", list}};
}

void PrintExplanations(const RunPlan& plan, const std::vector<RoleExplanation>& roles,
                       ModelSource source) {
  BothSources both(plan, std::move(source));
  const RoleExplanation& first = roles.front();
  const std::string held = first.held.empty() ? "it has no role" : "it has role " + first.held;
  const bool one = roles.size() == 1;
  // The answer comes first, then what speaks against it.
  if (one) {
    Print("{} {} {}; {}\n", first.module, first.fits ? "fits" : "does not fit", first.role, held);
  } else {
    Print("{}: {}\n", first.module, held);
  }
  PrintText(source::RenderNote({both.ModuleAt(first.module), "the module"}, both.sources(),
                               IsFancyTerminal(STDOUT_FILENO)));
  if (!first.has_pose) Print("no pose reaches the module, so it can take no role\n");
  for (const RoleExplanation& why : roles) {
    if (!one) Print("\n{} {}\n", why.fits ? "fits" : "does not fit", why.role);
    PrintParts(both, why, one);
    // A role that fits may still be another's: a subrole fits better, or one that is held stays.
    if (why.fits && !why.held.empty() && why.held != why.role) {
      Print("{} is what it holds, since a role that is held or more derived comes first\n",
            why.held);
    }
  }
}

}  // namespace morphbus::tools
