// morphbus compare: are two runs the same walk?

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "logger/compare/comparer.h"
#include "logger/log/run_log.h"
#include "logger/show/report.h"
#include "tools/base/output_path.h"
#include "tools/commands/commands.h"

namespace morphbus::tools {
namespace {

/// The options of `morphbus compare`, tolerances and groups as they were written.
struct CompareOptions {
  std::string a;
  std::string b;
  std::string report;
  std::vector<std::string> tolerances;
  std::vector<std::string> without;
  bool force = false;
  bool json = false;
};

/// The tolerances by their names on the command line.
constexpr std::pair<const char*, double logger::Tolerances::*> kTolerances[] = {
    {"propagated_m", &logger::Tolerances::propagated_m},
    {"propagated_rad", &logger::Tolerances::propagated_rad},
    {"simulated_m", &logger::Tolerances::simulated_m},
    {"simulated_rad", &logger::Tolerances::simulated_rad},
    {"angle_rad", &logger::Tolerances::angle_rad},
    {"travel_m", &logger::Tolerances::travel_m},
    {"velocity_m_s", &logger::Tolerances::velocity_m_s},
    {"velocity_rad_s", &logger::Tolerances::velocity_rad_s},
    {"command_rad", &logger::Tolerances::command_rad},
    {"command_m", &logger::Tolerances::command_m},
    {"role_s", &logger::Tolerances::role_s}};

/// For the help and for suggestions.
std::vector<std::string> ToleranceNames() {
  std::vector<std::string> names;
  for (const auto& [name, member] : kTolerances) names.emplace_back(name);
  return names;
}

/// What --without takes.
std::vector<std::string> GroupNames() {
  std::vector<std::string> names;
  for (const logger::QuantityGroup& group : logger::QuantityGroups()) {
    names.emplace_back(group.name);
  }
  return names;
}

/// Sets one tolerance from "name=value"; fails for another text.
Result<void> SetTolerance(const std::string& text, logger::Tolerances* tolerances) {
  // A text without a sign of equality is all name, and fits no tolerance.
  const size_t equals = std::min(text.find('='), text.size());
  const std::string wanted = text.substr(0, equals);
  for (const auto& [name, member] : kTolerances) {
    if (wanted != name || equals == text.size()) continue;
    // The whole rest must be a number: strtod stops at the first character that is none.
    const char* begin = text.c_str() + equals + 1;
    char* end = nullptr;
    const double value = std::strtod(begin, &end);
    if (*end != '\0' || end == begin || !(value >= 0) || !std::isfinite(value)) {
      return Fail(fmt::format("--tolerance {}: expected a number, 0 or more", text));
    }
    tolerances->*member = value;
    return {};
  }
  // No tolerance has this name: the nearest one is suggested.
  return Fail(fmt::format("--tolerance {}{}: expected NAME=VALUE, NAME one of {}", text,
                          DidYouMean(wanted, ToleranceNames()), fmt::join(ToleranceNames(), ", ")));
}

/// Loads both logs, compares them, and answers as text, JSON or page. The verdict is the exit
/// status.
int CompareLogs(const CompareOptions& options) {
  // Two results on one stream could not be told apart.
  if (options.json && IsStdout(options.report)) {
    return Unusable("--report - and --json both write to standard output: give --report a file");
  }
  // What is wrong with the options is said before logs are read, which takes longer.
  logger::CompareOptions compare;
  for (const std::string& text : options.tolerances) {
    if (Result<void> set = SetTolerance(text, &compare.tolerances); !set) {
      return Unusable(set.error().message);
    }
  }
  const std::vector<std::string> groups = GroupNames();
  for (const std::string& name : options.without) {
    if (std::find(groups.begin(), groups.end(), name) == groups.end()) {
      return Unusable(fmt::format("--without {}{}: expected one of {}", name,
                                  DidYouMean(name, groups), fmt::join(groups, ", ")));
    }
    compare.without.insert(name);
  }
  if (!MayWrite(options.report, outputs::kReport, options.force, {options.a, options.b}))
    return kUnusable;
  // A damaged log is still loaded as far as it goes; the comparison then says that it cannot tell.
  const Result<logger::RunLog> a = logger::LoadRunLog(options.a);
  if (!a) return Unusable(a.error().message);
  const Result<logger::RunLog> b = logger::LoadRunLog(options.b);
  if (!b) return Unusable(b.error().message);
  const logger::Comparison comparison = logger::Compare(*a, *b, compare);
  // The page is written whatever the verdict: it shows where the runs differ.
  if (!options.report.empty()) {
    const Result<void> written = WriteFile(options.report, logger::ReportHtml(*a, *b, comparison));
    if (!written) return Unusable(written.error().message);
  }
  // A page on standard output leaves no room for the text.
  if (options.json) {
    fmt::print("{}\n", JsonText(logger::ComparisonJson(comparison), 2));
  } else if (!IsStdout(options.report)) {
    fmt::print("{}", logger::ComparisonText(comparison));
  }
  // "Cannot tell" is no answer: status 2, as for input that cannot be used.
  if (comparison.verdict == logger::Verdict::kUnusable) return kUnusable;
  return comparison.verdict == logger::Verdict::kEquivalent ? kDone : kNo;
}

}  // namespace

void AddCompare(CommandLine* line) {
  Subcommand sub = line->Add(
      "compare",
      "Are two runs the same walk, by role and label? Exit status 0 yes, 1 no, 2 cannot say");
  auto options = std::make_shared<CompareOptions>();
  sub.Add("A", &options->a, "Log file").Required();
  sub.Add("B", &options->b, "Log file").Required();
  sub.Add("--report", &options->report,
          "Write a page with plots (one self-contained file; '-': only that, on stdout)")
      .TypeName("OUT.html");
  sub.Add("--tolerance", &options->tolerances,
          fmt::format("Largest difference that counts as none; may be repeated. NAME is one of {}",
                      fmt::join(ToleranceNames(), ", ")))
      .TypeName("NAME=VALUE")
      .Repeatable();
  sub.Add("--without", &options->without,
          fmt::format("Leave quantities out that a log does not hold; may be repeated: {}",
                      fmt::join(GroupNames(), ", ")))
      .TypeName("GROUP")
      .Repeatable();
  sub.Force(&options->force);
  sub.Json(&options->json);
  sub.Footer(
      "Examples:\n  morphbus compare a.log b.log --report report.html\n"
      "  morphbus compare a.log b.log --tolerance simulated_m=0.005 --json");
  sub.Do([options] { return CompareLogs(*options); });
}

}  // namespace morphbus::tools
