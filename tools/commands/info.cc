// morphbus info and verify: what is in a log, and whether it is whole.

#include <fmt/format.h>

#include "logger/log/facts_text.h"
#include "logger/log/run_log.h"
#include "tools/base/lent_description.h"
#include "tools/base/print.h"
#include "tools/base/work_progress.h"
#include "tools/commands/commands.h"

namespace morphbus::tools {
namespace {

/// The options of `morphbus info` and `morphbus verify`.
struct InfoOptions {
  std::string log;
  std::string run;
  std::string description;
  bool json = false;
  bool commands = false;
  bool all = false;
};

/// Adds the options, which are the same for both commands.
std::shared_ptr<InfoOptions> AddOptions(Subcommand* sub) {
  auto options = std::make_shared<InfoOptions>();
  sub->Add("LOG", &options->log, "Log file").Required();
  sub->Add("--run", &options->run, "Which run, if the file holds several (default: the first)")
      .TypeName("NAME");
  sub->Description(&options->description);
  sub->Json(&options->json);
  return options;
}

/// Prints the facts; `verify` also answers whether the log is whole.
int Report(const InfoOptions& options, bool verify) {
  const WorkProgress progress;
  // The facts are enough here: the robot's series are not loaded.
  const Result<logger::RunLog> log =
      LoadLog(options.log, {options.run, false}, options.description);
  if (!log) return Unusable(log.error().message);
  // Both commands print the same facts as JSON.
  if (options.json) {
    Print("{}\n", JsonText(logger::FactsJson(log->facts), 2));
  } else if (options.commands) {
    PrintText(logger::CommandsText(log->facts));
  } else {
    PrintText(verify ? logger::VerifyText(log->facts) : logger::FactsText(log->facts, options.all));
  }
  // A damaged log is no error of `info`, whose task is to say what is in it.
  return verify && !log->facts.whole() ? kNo : kDone;
}

}  // namespace

void AddInfo(CommandLine* line) {
  Subcommand sub =
      line->Add("info", "What is in a log: run, channels, rates, losses, faults, damage");
  const auto options = AddOptions(&sub);
  sub.Flag("--commands", &options->commands,
           "Only the commands that people gave, with their ticks, as run --commands reads them");
  sub.Flag("--all", &options->all,
           "Every channel, process, fault and line, however many there are");
  sub.Footer("Examples:\n  morphbus info walk.log\n  morphbus info walk.log --commands");
  sub.Do([options] { return Report(*options, false); });
}

void AddVerify(CommandLine* line) {
  Subcommand sub =
      line->Add("verify", "Is a log whole? Exit status 1 if anything is missing or wrong");
  const auto options = AddOptions(&sub);
  sub.Footer("Example:\n  morphbus verify walk.log");
  sub.Do([options] { return Report(*options, true); });
}

}  // namespace morphbus::tools
