// morphbus info and verify: what is in a log, and whether it is whole.

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "logger/run_log.h"
#include "tools/commands.h"
#include "tools/json_text.h"

namespace morphbus::tools {
namespace {

struct Options {
  std::string log;
  std::string run;
  bool json = false;
};

std::shared_ptr<Options> AddOptions(CLI::App* sub) {
  auto options = std::make_shared<Options>();
  sub->add_option("LOG", options->log, "Log file")->required();
  sub->add_option("--run", options->run,
                  "Which run, if the file holds several (default: the first)");
  sub->add_flag("--json", options->json, "One JSON object on stdout");
  return options;
}

/// Prints the facts; `verify` also answers whether the log is whole.
int Report(const Options& options, bool verify) {
  const Result<logger::RunLog> log = logger::LoadRunLog(options.log, {options.run, false});
  if (!log) return Unusable(log.error().message);
  if (options.json) {
    fmt::print("{}\n", JsonText(logger::FactsJson(log->facts), 2));
  } else {
    fmt::print("{}", verify ? logger::VerifyText(log->facts) : logger::FactsText(log->facts));
  }
  return verify && !log->facts.whole() ? kNo : kDone;
}

}  // namespace

void AddInfo(CLI::App& app, Action* action) {
  CLI::App* sub =
      app.add_subcommand("info", "What is in a log: run, channels, rates, losses, faults, damage");
  const auto options = AddOptions(sub);
  sub->footer("Example:\n  morphbus info walk.log");
  sub->callback([options, action] { *action = [options] { return Report(*options, false); }; });
}

void AddVerify(CLI::App& app, Action* action) {
  CLI::App* sub =
      app.add_subcommand("verify", "Is a log whole? Exit status 1 if anything is missing or wrong");
  const auto options = AddOptions(sub);
  sub->footer("Example:\n  morphbus verify walk.log");
  sub->callback([options, action] { *action = [options] { return Report(*options, true); }; });
}

}  // namespace morphbus::tools
