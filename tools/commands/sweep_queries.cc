// morphbus sweep status, missing, rerun, verify, export and report: what looks at the rows of a
// sweep, or runs some of them again; and the processes that run them.

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>

#include "compiler/base/text.h"
#include "compiler/base/version.h"
#include "tools/base/json.h"
#include "tools/base/work_progress.h"
#include "tools/commands/commands.h"
#include "tools/commands/sweep.h"
#include "tools/launch/launcher_link.h"
#include "tools/sweep/chunk_file.h"
#include "tools/sweep/chunk_stream.h"
#include "tools/sweep/sweep_export.h"
#include "tools/sweep/sweep_page.h"
#include "tools/sweep/sweep_rows.h"

namespace morphbus::tools {
namespace {

/// Rows that are listed where there may be thousands; --json has all.
constexpr int64_t kShownRows = 20;

/// How far a sweep is, and who ran its rows.
int Status(const SweepOptions& options) {
  const std::unique_ptr<SweepStore> store = OpenNamed(options.file);
  if (!store) return kUnusable;
  const Result<RowCounts> counts = store->Counts();
  if (!counts) return Unusable(counts.error().message);
  // Rows of several versions need not go together.
  std::set<std::string> versions;
  double seconds = 0;
  const Result<void> read = store->EachRow([&](const StoredRow& row) {
    if (!row.result) return true;
    versions.insert(row.result->version);
    seconds += row.result->seconds;
    return true;
  });
  if (!read) return Unusable(read.error().message);
  if (options.json) {
    Json json = CountsJson(store->path(), *counts);
    json["of_earlier_plans"] = counts->others;
    json["run_seconds"] = seconds;
    json["versions"] = versions;
    PrintJson(json);
    return kDone;
  }
  Print("{}: {} of {} done, {} failed, {} crashed, {} out of time, {} missing\n", store->path(),
        counts->done, Counted(counts->rows, "row"), counts->failed, counts->crashed,
        counts->timeout, counts->missing());
  if (counts->others > 0) Print("  and {} of earlier plans\n", Counted(counts->others, "result"));
  if (versions.size() > 1) {
    Print(
        "  run by several versions of morphbus ({}): morphbus sweep verify says whether they "
        "agree\n",
        fmt::join(versions, ", "));
  }
  return kDone;
}

/// Lists the rows that are not done. They are printed as they are read, for there may be a million.
int Missing(const SweepOptions& options) {
  const std::unique_ptr<SweepStore> store = OpenNamed(options.file);
  if (!store) return kUnusable;
  // Of the rows JSON has all, in one object; people see the first ones, and how many more there
  // are.
  Json rows = Json::array();
  int64_t count = 0;
  const Result<void> read = store->EachRow([&](const StoredRow& row) {
    if (row.result && row.result->status == RowResult::Status::kRan) return true;
    ++count;
    const std::string status = row.result ? StatusText(row.result->status) : "missing";
    const std::string error = row.result ? row.result->error : "";
    if (options.json) {
      rows.push_back(
          {{"row", row.place}, {"status", status}, {"error", error}, {"inputs", row.point}});
    } else if (count <= kShownRows) {
      Print("row {} {}: {}{}\n", row.place, status, PointText(row.point),
            error.empty() ? "" : "; " + EscapeControl(error));
    }
    return true;
  });
  if (!read) return Unusable(read.error().message);
  if (options.json) {
    PrintJson({{"missing", rows}});
  } else if (count > kShownRows) {
    Print("and {} more (--json)\n", count - kShownRows);
  }
  return count == 0 ? kDone : kNo;
}

/// Runs one row again, from what the database holds: model and program may be gone.
int Rerun(const SweepOptions& options) {
  const std::unique_ptr<SweepStore> store = OpenNamed(options.file);
  if (!store) return kUnusable;
  const Result<std::optional<StoredRow>> row = store->RowAt(options.row);
  if (!row) return Unusable(row.error().message);
  if (!*row) return Unusable(fmt::format("{} has no row {}", store->path(), options.row));
  const Result<std::string> description = store->DescriptionOf((*row)->key);
  const Result<SweepOrigin> origin = store->Origin();
  if (!description) return Unusable(description.error().message);
  if (!origin) return Unusable(origin.error().message);
  if (!options.log.empty() && !MayWriteLog(options.log, options.force, {store->path()}))
    return kUnusable;
  const RowResult result = RunForRow(*description, options.log);
  // A row that has not been run, or failed, has nothing to agree with.
  const bool done = result.status == RowResult::Status::kRan;
  const std::optional<RowResult>& before = (*row)->result;
  const bool known = before && before->status == RowResult::Status::kRan;
  // The same run has the same hash, and nothing that is told of it may differ.
  const bool same = !known || (before->hash == result.hash && before->figures == result.figures);
  // The command goes by the files, which may have changed since; the row went by the database.
  const std::string command = RunCommand((*row)->point, origin->folder);
  if (options.json) {
    PrintJson({{"row", options.row},
               {"inputs", (*row)->point},
               {"hash", done ? Json(result.hash) : Json(nullptr)},
               {"before", known ? Json(before->hash) : Json(nullptr)},
               {"same", done && same},
               {"figures", Json::parse(result.figures)},
               {"log", options.log.empty() ? Json(nullptr) : Json(options.log)},
               {"command", command}});
  } else {
    Print("row {}: {}\n  hash {}{}\n  {}\n", options.row, PointText((*row)->point),
          done ? result.hash : "-",
          !known ? ""
          : same ? ", the same as before"
                 : ", before it was " + before->hash,
          command);
  }
  // A run that failed is told as what it is: it is no answer to whether it would be the same.
  if (!done) return Failed(result.error);
  return same ? kDone : kNo;
}

/// Runs a share of the rows again, and names those that come to something else.
int Verify(SweepOptions options) {
  const std::unique_ptr<SweepStore> store = OpenNamed(options.file);
  if (!store) return kUnusable;
  // The engines are those of the file of which the database was made.
  const Result<SweepOrigin> origin = store->Origin();
  if (!origin) return Unusable(origin.error().message);
  if (!ChooseEngine(EngineOfText(origin->text).value_or(EngineSettings()), origin->folder,
                    &options)) {
    return kUnusable;
  }
  CatchSignals();
  // Which rows it is follows from the seed, and they run from what the database holds of them.
  RepeatedRows rows(store.get());
  if (const Result<void> added = AddSample(store.get(), options.sample, options.seed, &rows);
      !added) {
    return Unusable(added.error().message);
  }
  // Only rows that are done have something to agree with.
  if (rows.rows() == 0) return Unusable(fmt::format("{} has no row that is done", store->path()));
  if (const EngineResult run = RunAgain(&rows, *store, options); !run) {
    return EngineFailed(run.error());
  }
  // Of a run that a signal cut short only those rows are told that were run.
  Json differ = Json::array();
  int64_t agree = 0;
  for (const RowRepeat& repeat : rows.Repeats()) {
    if (repeat.same()) {
      ++agree;
      continue;
    }
    differ.push_back({{"row", repeat.place},
                      {"status", StatusText(repeat.now.status)},
                      {"hash", repeat.now.hash},
                      {"before", repeat.before.hash},
                      {"version", repeat.now.version},
                      {"version_before", repeat.before.version},
                      {"host_before", repeat.before.host}});
  }
  if (options.json) {
    PrintJson({{"rows", rows.taken()},
               {"agree", agree},
               {"stopped", CaughtSignal() != 0},
               {"differ", differ}});
  } else {
    Print("{} of {} agree\n", agree, Counted(rows.taken(), "row"));
    for (size_t i = 0; i < std::min(differ.size(), kMostNamed); ++i) {
      Print("  row {}: {} {}, before {} by {} on {}\n", differ[i]["row"].get<int64_t>(),
            differ[i]["status"].get<std::string>(), differ[i]["hash"].get<std::string>(),
            differ[i]["before"].get<std::string>(), differ[i]["version_before"].get<std::string>(),
            differ[i]["host_before"].get<std::string>());
    }
    if (differ.size() > kMostNamed) Print("  and {} more (--json)\n", differ.size() - kMostNamed);
  }
  return differ.empty() && CaughtSignal() == 0 ? kDone : kNo;
}

/// Writes all rows in their order.
int Export(const SweepOptions& options) {
  const bool csv = options.format == "csv";
  if (!csv && options.format != "json") {
    return Unusable(fmt::format("--to: there is no format '{}'{}; there are csv and json",
                                options.format, DidYouMean(options.format, {"csv", "json"})));
  }
  const std::unique_ptr<SweepStore> store = OpenNamed(options.file);
  if (!store) return kUnusable;
  if (!MayWrite(options.output, csv ? outputs::kSweepCsv : outputs::kSweepJson, options.force,
                {store->path()})) {
    return kUnusable;
  }
  // Rows are written as they are read, for there may be a million.
  Result<std::unique_ptr<OutputFile>> file = OutputFile::Create(options.output);
  if (!file) return Unusable(file.error().message);
  Result<void> written =
      csv ? WriteCsv(store.get(), file->get()) : WriteJson(store.get(), file->get());
  if (written) written = (*file)->Close();
  return written ? kDone : Unusable(written.error().message);
}

/// Writes the page. Whether it can be written is found out before rows run again for it.
int ReportPage(const SweepOptions& options) {
  const WorkProgress progress;
  SweepPageOptions page = {{}, options.smallest, options.best};
  if (!options.by.empty()) {
    ExpressionError error;
    page.by = FigureExpression::Read(options.by, &error);
    if (!page.by) {
      return Unusable(fmt::format("--by: {} (at character {})", error.message, error.offset + 1));
    }
  } else if (options.smallest) {
    return Unusable("--smallest belongs to --by EXPRESSION");
  }
  const std::unique_ptr<SweepStore> store = OpenNamed(options.file);
  if (!store) return kUnusable;
  if (!MayWrite(options.output, outputs::kReport, options.force, {store->path()})) return kUnusable;
  const Result<std::string> html = SweepPageHtml(store.get(), page);
  if (!html) return Unusable(html.error().message);
  const Result<void> written = WriteFile(options.output, *html);
  return written ? kDone : Unusable(written.error().message);
}

/// A subcommand that looks at a database.
struct Query {
  Subcommand sub;
  std::shared_ptr<SweepOptions> options;
};
/// Adds one, with the database as its first argument.
Query AddQuery(Subcommand* sweep, const char* name, const char* what) {
  Query query = {sweep->Command(name, what), std::make_shared<SweepOptions>()};
  query.sub
      .Add("DB", &query.options->file, "The sweep's database, or its file, beside which that lies")
      .Required();
  return query;
}
/// What the engines start: runs rows that come over a socket, as a stream, or in a file.
int Worker(const SweepOptions& options) {
  // One of the processes of this machine, which has its rows from the engine one by one.
  if (options.fd >= 0) return ServeRows(options.fd);
  // One for another machine, or for a batch system, which starts such processes itself.
  const LocalOptions local = {JobsOf(options), options.timeout};
  CatchSignals();
  if (options.chunk.empty()) {
    const Result<void> served = ServeStream(STDIN_FILENO, STDOUT_FILENO, local);
    return served ? kDone : Unusable(served.error().message);
  }
  if (options.output.empty()) return Unusable("--output: a chunk needs a file for its results");
  return ServeChunkFile(options.chunk, options.output, local);
}
/// Adds `sweep worker`, of which the help says nothing.
void AddWorker(Subcommand* sweep) {
  Subcommand sub =
      sweep->Command("worker", "Run rows for a sweep: from stdin, or those of a chunk");
  sub.Hidden();
  auto options = std::make_shared<SweepOptions>();
  sub.Add("CHUNK", &options->chunk, "A file of rows (default: they come on stdin)");
  sub.Add("--fd", &options->fd, "A socket on which they come, one at a time");
  sub.Add("-o,--output", &options->output, "Where the results of a chunk's rows are appended");
  sub.Add("-j,--jobs", &options->jobs, "Rows at a time (default: one a processor)").Range(1, 65536);
  sub.Add("--timeout", &options->timeout, "Wall time that a run may take").Seconds();
  sub.Do([options] { return Worker(*options); });
}

}  // namespace

void AddSweepQueries(Subcommand* sweep) {
  Query status = AddQuery(sweep, "status", "How many rows are done, failed and missing");
  status.sub.Json(&status.options->json);
  status.sub.Footer("Example:\n  morphbus sweep status walk.toml");
  status.sub.Do([options = status.options] { return Status(*options); });

  Query missing =
      AddQuery(sweep, "missing", "The rows that are not done, and why those failed that did");
  missing.sub.Json(&missing.options->json);
  missing.sub.Footer(
      "Exit status 1: there are such rows.\nExample:\n  morphbus sweep missing walk.toml");
  missing.sub.Do([options = missing.options] { return Missing(*options); });

  Query rerun = AddQuery(sweep, "rerun", "Run a row again, which must come to the same hash");
  rerun.sub.Add("ROW", &rerun.options->row, "Its number").Range(1, 1'000'000).Required();
  rerun.sub.Add("--log", &rerun.options->log, "Keep its log").TypeName("FILE");
  rerun.sub.Force(&rerun.options->force);
  rerun.sub.Json(&rerun.options->json);
  rerun.sub.Footer(
      "Exit status 1: another hash.\nExample:\n  morphbus sweep rerun walk.toml 7 --log "
      "seventh.log");
  rerun.sub.Do([options = rerun.options] { return Rerun(*options); });

  Query verify = AddQuery(sweep, "verify",
                          "Run a share of the rows again, which must come to the same hashes");
  verify.sub.Add("--sample", &verify.options->sample, "The share (default: 5%)").Fraction();
  verify.sub.Seed(&verify.options->seed, "Seed by which rows are drawn (default 1)");
  AddEngine(&verify.sub, verify.options.get());
  verify.sub.Json(&verify.options->json);
  verify.sub.Footer(
      "Exit status 1: rows differ.\nExample:\n  morphbus sweep verify walk.toml --sample 10%");
  verify.sub.Do([options = verify.options] { return Verify(*options); });

  Query exported = AddQuery(sweep, "export", "All rows as a table or as JSON");
  exported.options->output = "-";
  exported.sub.Add("--to", &exported.options->format, "csv or json")
      .TypeName("csv|json")
      .Required();
  exported.sub.Add("-o,--output", &exported.options->output, "File to write (default '-', stdout)")
      .TypeName("FILE");
  exported.sub.Force(&exported.options->force);
  exported.sub.Footer("Example:\n  morphbus sweep export walk.toml --to csv -o walk.csv");
  exported.sub.Do([options = exported.options] { return Export(*options); });

  Query report =
      AddQuery(sweep, "report", "The sweep on a page: best rows with pictures, plots, all rows");
  report.sub
      .Add("-o,--output", &report.options->output,
           "Page to write (one self-contained HTML file; '-': stdout)")
      .TypeName("FILE.html")
      .Required();
  report.sub
      .Add("--by", &report.options->by,
           "Which rows are the best: those in which this is largest (default: as the file "
           "keeps them, or else the distance from start to end)")
      .TypeName("EXPRESSION");
  report.sub.Flag("--smallest", &report.options->smallest, "Those in which it is smallest");
  report.sub.Add("--best", &report.options->best, "So many are shown with pictures (default 5)")
      .Range(0, 50);
  report.sub.Force(&report.options->force);
  report.sub.Footer(
      "Example:\n  morphbus sweep report walk.toml -o walk.html --by 'gait.forward_m'");
  report.sub.Do([options = report.options] { return ReportPage(*options); });

  AddWorker(sweep);
}

}  // namespace morphbus::tools
