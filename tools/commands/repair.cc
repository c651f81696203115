// morphbus repair: what is sound in a damaged or cut log, as a log of its own.

#include <fmt/format.h>

#include "compiler/base/text.h"
#include "logger/log/repair.h"
#include "logger/log/run_facts.h"
#include "tools/base/print.h"
#include "tools/base/work_progress.h"
#include "tools/commands/commands.h"

namespace morphbus::tools {
namespace {

/// The options of `morphbus repair`.
struct RepairOptions {
  std::string log;
  std::string output;
  bool force = false;
  bool json = false;
};

/// The findings are those of the damaged log; at most so many as the reader keeps.
Json ReportJson(const RepairOptions& options, const logger::RepairReport& report) {
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

/// What is wrong, a line a place, then what was kept.
void PrintReport(const RepairOptions& options, const logger::RepairReport& report) {
  for (const logger::LogFinding& finding : report.findings) {
    Print("{}: {}\n", options.log, finding.what);
  }
  // The reader lists so many findings, and counts all.
  const int64_t unlisted = report.num_findings - static_cast<int64_t>(report.findings.size());
  if (unlisted > 0) Print("{}: {} more\n", options.log, Counted(unlisted, "place"));
  Print("{}: {} kept, {} dropped\n", options.output, Counted(report.events_kept, "event"),
        Counted(report.bytes_dropped, "byte"));
}

/// Copies sound events. That some were damaged is what repair is for: status 0.
int Repair(const RepairOptions& options) {
  const WorkProgress progress;
  // RepairLog writes under a temporary name and renames, which a stream cannot be.
  if (options.output == "-") return Unusable("-o -: a log is a file, and cannot go to stdout");
  if (!MayWriteLog(options.output, options.force, {})) return kUnusable;  // RepairLog spares LOG
  const Result<logger::RepairReport> report = logger::RepairLog(options.log, options.output);
  if (!report) return Unusable(report.error().message);
  // The report is of the damaged log, whose places the user may want to know.
  if (options.json) {
    PrintJson(ReportJson(options, *report));
  } else {
    PrintReport(options, *report);
  }
  return kDone;
}

}  // namespace

void AddRepair(CommandLine* line) {
  Subcommand sub = line->Add("repair", "Copy what is sound in a damaged or cut log into a new one");
  auto options = std::make_shared<RepairOptions>();
  sub.Add("LOG", &options->log, "Log file; it is left as it is").Required();
  sub.Add("-o,--output", &options->output, "Log to write").TypeName("FILE").Required();
  sub.Force(&options->force);
  sub.Json(&options->json);
  sub.Footer(
      "It invents nothing: a log that lost events still fails morphbus verify.\n"
      "Example:\n  morphbus repair walk.log.partial -o sound.log");
  sub.Do([options] { return Repair(*options); });
}

}  // namespace morphbus::tools
