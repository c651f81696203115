// morphbus report: one run on a page.

#include "logger/show/report.h"
#include "logger/log/run_log.h"
#include "tools/base/output_path.h"
#include "tools/base/work_progress.h"
#include "tools/commands/commands.h"

namespace morphbus::tools {
namespace {

/// The options of `morphbus report`.
struct ReportOptions {
  std::string log;
  std::string run;
  std::string output;
  bool force = false;
};

/// Reads the log and writes the page.
int WriteReport(const ReportOptions& options) {
  const WorkProgress progress;
  // Whether the page can be written is found out before the log is read, which takes longer.
  if (!MayWrite(options.output, outputs::kReport, options.force, {options.log})) return kUnusable;
  // A damaged log is shown as far as it goes; the page says what is wrong with it.
  const Result<logger::RunLog> log = logger::LoadRunLog(options.log, {options.run, true});
  if (!log) return Unusable(log.error().message);
  const Result<void> written = WriteFile(options.output, logger::RunReportHtml(*log));
  return written ? kDone : Unusable(written.error().message);
}

}  // namespace

void AddReport(CommandLine* line) {
  Subcommand sub = line->Add("report", "One run on a page: pictures, roles, faults, gait, joints");
  auto options = std::make_shared<ReportOptions>();
  sub.Add("LOG", &options->log, "Log file").Required();
  sub.Add("-o,--output", &options->output,
          "Page to write (one self-contained HTML file; '-': stdout)")
      .TypeName("FILE.html")
      .Required();
  sub.Add("--run", &options->run, "Which run, if the log holds several (default: the first)")
      .TypeName("NAME");
  sub.Force(&options->force);
  sub.Footer("Example:\n  morphbus report walk.log -o walk.html");
  sub.Do([options] { return WriteReport(*options); });
}

}  // namespace morphbus::tools
