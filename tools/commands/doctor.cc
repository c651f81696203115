// morphbus doctor: whether this machine can carry a run, and what mends it if not.

#include <fmt/color.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>

#include "tools/base/print.h"
#include "tools/commands/commands.h"
#include "tools/machine/machine_checks.h"
#include "tools/machine/network.h"
#include "tools/machine/run_registry.h"

namespace morphbus::tools {
namespace {

struct DoctorOptions {
  std::string url;
  std::string run;
  bool json = false;
};

/// The word by which people and scripts tell findings apart.
const char* HealthName(Health health) {
  switch (health) {
    case Health::kGood:
      return "ok";
    case Health::kWarning:
      return "warning";
    case Health::kBroken:
      break;
  }
  return "broken";
}

/// A finding as docs/cli.md describes it.
Json ToJson(const Finding& finding) {
  Json figures = Json::object();
  for (const auto& [name, value] : finding.figures) figures[name] = value;
  return {{"name", finding.name},
          {"health", HealthName(finding.health)},
          {"text", finding.text},
          {"mend", finding.mend},
          {"figures", figures}};
}

/// A line for the finding, and one for the command that mends it.
void PrintFinding(const Finding& finding) {
  // Colours are for terminals; a file or a pipe gets plain text.
  fmt::text_style style;
  if (IsFancyTerminal(STDOUT_FILENO)) {
    const bool good = finding.health == Health::kGood;
    const bool broken = finding.health == Health::kBroken;
    style = fmt::fg(good     ? fmt::terminal_color::green
                    : broken ? fmt::terminal_color::red
                             : fmt::terminal_color::yellow);
  }
  // The word is filled up before it gets its colour, whose bytes would count as width.
  Print("{} {:<11} {}\n", fmt::format(style, "{:<8}", HealthName(finding.health)), finding.name,
        finding.text);
  if (!finding.mend.empty()) Print("{:<20} mend: {}\n", "", finding.mend);
}

int Doctor(const DoctorOptions& options) {
  std::string given = options.url;
  std::string from = given.empty() ? "LCM's default" : "--lcm-url";
  // The network of a run that lives is looked at from within.
  if (!options.run.empty()) {
    const Result<RunEntry> run = FindRun(options.run);
    if (!run) return Unusable(run.error().message);
    if (Result<void> joined = JoinNetworkOf(*run); !joined) return Unusable(joined.error().message);
    if (given.empty()) given = run->url, from = "that of run " + run->name;
  }
  // An option goes before the run's own bus, that before the environment.
  const char* environment = std::getenv("LCM_DEFAULT_URL");
  if (given.empty() && environment != nullptr && *environment != '\0') from = "$LCM_DEFAULT_URL";
  const Result<bridge::LcmUrl> url = bridge::ResolveLcmUrl(given);
  if (!url) return Unusable(url.error().message);

  // All checks are made before anything is printed, so that the status is that of what is shown.
  const std::vector<Finding> findings = CheckMachine(*url, from);
  // What would stop every run is the answer no; a warning is none.
  int broken = 0;
  int warnings = 0;
  for (const Finding& finding : findings) {
    broken += finding.health == Health::kBroken ? 1 : 0;
    warnings += finding.health == Health::kWarning ? 1 : 0;
  }
  // For scripts one object, for people a line a finding.
  if (options.json) {
    Json list = Json::array();
    for (const Finding& finding : findings) list.push_back(ToJson(finding));
    PrintJson(
        {{"ok", broken == 0}, {"broken", broken}, {"warnings", warnings}, {"findings", list}});
    return broken == 0 ? kDone : kNo;
  }
  for (const Finding& finding : findings) PrintFinding(finding);
  if (broken == 0 && warnings == 0) Print("all is well\n");
  return broken == 0 ? kDone : kNo;
}

}  // namespace

void AddDoctor(CommandLine* line) {
  Subcommand sub =
      line->Add("doctor", "Check that this machine can carry a run, and what mends it");
  auto options = std::make_shared<DoctorOptions>();
  sub.Add("-l,--lcm-url", &options->url, "Bus to look at (default: $LCM_DEFAULT_URL, else LCM's)")
      .TypeName("URL");
  sub.Add("--run", &options->run, "Look at the network of this run").TypeName("RUN");
  sub.Json(&options->json);
  sub.Footer(
      "Status 0: nothing stops a run here; 1: something does.\n"
      "Example:\n  morphbus doctor");
  sub.Do([options] { return Doctor(*options); });
}

}  // namespace morphbus::tools
