// morphbus compare: are two runs the same walk?

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <cmath>
#include <cstdlib>

#include "logger/comparer.h"
#include "logger/report.h"
#include "logger/run_log.h"
#include "tools/commands.h"
#include "tools/json_text.h"
#include "tools/output_path.h"

namespace morphbus::tools {
namespace {

struct Options {
  std::string a;
  std::string b;
  std::string report;
  std::vector<std::string> tolerances;
  bool json = false;
};

/// Sets one tolerance from "name=value"; on failure says why and returns false.
bool SetTolerance(const std::string& text, logger::Tolerances* tolerances) {
  const std::vector<std::pair<std::string, double*>> known = {
      {"propagated_m", &tolerances->propagated_m},
      {"propagated_rad", &tolerances->propagated_rad},
      {"simulated_m", &tolerances->simulated_m},
      {"simulated_rad", &tolerances->simulated_rad},
      {"angle_rad", &tolerances->angle_rad},
      {"travel_m", &tolerances->travel_m},
      {"command_rad", &tolerances->command_rad},
      {"command_m", &tolerances->command_m},
      {"role_s", &tolerances->role_s}};
  const size_t equals = text.find('=');
  std::string names;
  for (const auto& [name, target] : known) {
    names += (names.empty() ? "" : ", ") + name;
    if (equals == std::string::npos || text.substr(0, equals) != name) continue;
    char* end = nullptr;
    const double value = std::strtod(text.c_str() + equals + 1, &end);
    if (*end != '\0' || end == text.c_str() + equals + 1 || !(value >= 0) ||
        !std::isfinite(value)) {
      Unusable(fmt::format("--tolerance {}: expected a number, 0 or more", text));
      return false;
    }
    *target = value;
    return true;
  }
  Unusable(fmt::format("--tolerance {}: expected NAME=VALUE, NAME one of {}", text, names));
  return false;
}

int CompareLogs(const Options& options) {
  if (options.json && IsStdout(options.report)) {
    return Unusable("--report - and --json both write to standard output: give --report a file");
  }
  logger::CompareOptions compare;
  for (const std::string& text : options.tolerances) {
    if (!SetTolerance(text, &compare.tolerances)) return kUnusable;
  }
  if (!SparesInputs(options.report, {options.a, options.b})) return kUnusable;
  const Result<logger::RunLog> a = logger::LoadRunLog(options.a);
  if (!a) return Unusable(a.error().message);
  const Result<logger::RunLog> b = logger::LoadRunLog(options.b);
  if (!b) return Unusable(b.error().message);
  const logger::Comparison comparison = logger::Compare(*a, *b, compare);
  if (!options.report.empty()) {
    const Result<void> written = WriteFile(options.report, logger::ReportHtml(*a, *b, comparison));
    if (!written) return Unusable(written.error().message);
  }
  if (options.json) {
    fmt::print("{}\n", JsonText(logger::ComparisonJson(comparison), 2));
  } else if (!IsStdout(options.report)) {
    fmt::print("{}", logger::ComparisonText(comparison));
  }
  switch (comparison.verdict) {
    case logger::Verdict::kEquivalent:
      return kDone;
    case logger::Verdict::kDifferent:
      return kNo;
    case logger::Verdict::kUnusable:
      break;
  }
  return kUnusable;
}

}  // namespace

void AddCompare(CLI::App& app, Action* action) {
  CLI::App* sub = app.add_subcommand(
      "compare",
      "Are two runs the same walk, by role and label? Exit status 0 yes, 1 no, 2 cannot say");
  auto options = std::make_shared<Options>();
  sub->add_option("A", options->a, "Log file")->required();
  sub->add_option("B", options->b, "Log file")->required();
  sub->add_option("--report", options->report,
                  "Write a page with plots (one self-contained file; '-': only that, on stdout)")
      ->type_name("OUT.html");
  sub->add_option("--tolerance", options->tolerances,
                  "Largest difference that counts as none; may be repeated")
      ->type_name("NAME=VALUE")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  sub->add_flag("--json", options->json, "One JSON object on stdout");
  sub->footer(
      "Examples:\n  morphbus compare a.log b.log --report report.html\n"
      "  morphbus compare a.log b.log --tolerance simulated_m=0.005 --json");
  sub->callback([options, action] { *action = [options] { return CompareLogs(*options); }; });
}

}  // namespace morphbus::tools
