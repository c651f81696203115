// morphbus repair: what is sound in a damaged or cut log, as a log of its own.

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "logger/event_log.h"
#include "logger/run_facts.h"
#include "tools/commands.h"

namespace morphbus::tools {
namespace {

struct Options {
  std::string log;
  std::string output;
  bool json = false;
};

Json ReportJson(const Options& options, const logger::RepairReport& report) {
  Json findings = Json::array();
  for (const logger::LogFinding& finding : report.findings) {
    findings.push_back(Json(logger::FindingJson(finding)));
  }
  return {{"path", options.log},
          {"output", options.output},
          {"events_kept", report.events_kept},
          {"bytes_dropped", report.bytes_dropped},
          {"findings", findings},
          {"num_findings", report.num_findings}};
}

void PrintReport(const Options& options, const logger::RepairReport& report) {
  for (const logger::LogFinding& finding : report.findings) {
    fmt::print("{}: {}\n", options.log, finding.what);
  }
  const int64_t unlisted = report.num_findings - static_cast<int64_t>(report.findings.size());
  if (unlisted > 0) fmt::print("{}: {} more places\n", options.log, unlisted);
  fmt::print("{}: {} kept, {} dropped\n", options.output,
             Plural(static_cast<size_t>(report.events_kept), "event"),
             Plural(report.bytes_dropped, "byte"));
}

int Repair(const Options& options) {
  if (options.output == "-") return Unusable("-o -: a log is a file, and cannot go to stdout");
  const Result<logger::RepairReport> report = logger::RepairLog(options.log, options.output);
  if (!report) return Unusable(report.error().message);
  if (options.json) {
    PrintJson(ReportJson(options, *report));
  } else {
    PrintReport(options, *report);
  }
  return kDone;
}

}  // namespace

void AddRepair(CLI::App& app, Action* action) {
  CLI::App* sub =
      app.add_subcommand("repair", "Copy what is sound in a damaged or cut log into a new one");
  auto options = std::make_shared<Options>();
  sub->add_option("LOG", options->log, "Log file; it is left as it is")->required();
  sub->add_option("-o,--output", options->output, "Log to write")->required();
  sub->add_flag("--json", options->json, "One JSON object on stdout");
  sub->footer(
      "It invents nothing: a log that lost events still fails morphbus verify.\n"
      "Example:\n  morphbus repair walk.log.partial -o sound.log");
  sub->callback([options, action] { *action = [options] { return Repair(*options); }; });
}

}  // namespace morphbus::tools
