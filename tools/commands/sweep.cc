// morphbus sweep: runs a robot many times.

#include "tools/commands/sweep.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "compiler/base/text.h"
#include "compiler/base/version.h"
#include "tools/base/json.h"
#include "tools/commands/commands.h"
#include "tools/launch/launcher_link.h"
#include "tools/sweep/expectations.h"
#include "tools/sweep/local_engine.h"
#include "tools/sweep/sweep_estimate.h"
#include "tools/sweep/sweep_rows.h"

namespace morphbus::tools {
namespace {

/// Failures of an expectation that are named, and repeated by commands, where there may be
/// thousands.
constexpr size_t kShownFailures = kMostNamed;

/// A sweep, read and planned.
struct ReadySweep {
  SweepFile file;
  SweepPlan plan;
  SweepOrigin origin;
};

/// Reads and plans; nothing after saying what is wrong.
std::optional<ReadySweep> Prepare(SweepOptions* options) {
  std::optional<SweepOrigin> origin = OriginOf(*options);
  if (!origin) return std::nullopt;
  std::optional<SweepFile> sweep = ReadOrigin(*options, *origin, ReadSweepFile);
  if (!sweep || !ChooseEngine(sweep->engine, origin->folder, options)) return std::nullopt;
  std::optional<SweepPlan> plan = PlanSweep(*sweep);
  if (!plan) return std::nullopt;
  return ReadySweep{std::move(*sweep), std::move(*plan), std::move(*origin)};
}

/// --dry-run: what it would be.
int Estimate(const ReadySweep& sweep, const SweepOptions& options) {
  const Result<SweepEstimate> estimate = EstimateOf(sweep.plan);
  if (!estimate) return Failed(estimate.error().message);
  const bool here = options.engines.kind == EngineKind::kLocal;
  // How many processors a cluster or other machines give is not known.
  const int jobs = here ? JobsOf(options) : 1;
  // Axes with one value are no axes to a reader.
  Json axes = Json::object();
  std::vector<std::string> texts;
  for (const SweepAxis& axis : sweep.file.axes) {
    if (axis.kind == SweepAxis::Kind::kEach && axis.values.size() == 1) continue;
    const bool each = axis.kind == SweepAxis::Kind::kEach;
    const auto count = static_cast<int64_t>(each ? axis.values.size() : sweep.file.samples);
    axes[axis.name] = count;
    texts.push_back(fmt::format("  {}: {}\n", axis.name,
                                each ? Counted(count, "value") : Counted(count, "sample")));
  }
  if (options.json) {
    PrintJson({{"rows", sweep.plan.rows.size()},
               {"runs", estimate->runs},
               {"axes", axes},
               {"jobs", jobs},
               {"wall_seconds", estimate->run_seconds / jobs},
               {"bytes", estimate->bytes}});
    return kDone;
  }
  Print("{}{}\n{}", Counted(static_cast<int64_t>(sweep.plan.rows.size()), "row"),
        estimate->runs == static_cast<int64_t>(sweep.plan.rows.size())
            ? ""
            : fmt::format(", of which {} differ", estimate->runs),
        fmt::join(texts, ""));
  Print("about {}, and {:.1f} MB\n", EstimateText(estimate->run_seconds, options),
        static_cast<double>(estimate->bytes) / 1e6);
  return kDone;
}

/// Keeps the logs that the file asks for, and appends their paths. Says what goes wrong, and
/// returns the exit status of that.
int KeepLogs(const SweepFile& file, SweepStore* store, const SweepOptions& options,
             std::vector<std::string>* logs) {
  RepeatedRows rows(store);
  // They lie beside the database: creep.sweep.db has creep.sweep.logs/.
  std::filesystem::path folder = store->path();
  folder.replace_extension(".logs");
  if (const Result<void> added = AddKept(store, file.keep, folder.string(), &rows); !added) {
    return Unusable(added.error().message);
  }
  // Logs that an earlier call has kept are not made again.
  if (rows.rows() == 0) return kDone;
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return Failed(fmt::format("cannot make {}: {}", folder.string(), error.message()));
  if (const EngineResult run = RunAgain(&rows, *store, options, true); !run) {
    return EngineFailed(run.error());
  }
  for (const RowRepeat& repeat : rows.Repeats()) {
    // A run that crashes leaves no log that is whole.
    if (std::filesystem::exists(repeat.log, error)) logs->push_back(repeat.log);
    if (!repeat.same())
      Warn(fmt::format("row {} went another way when its log was kept (morphbus sweep verify)",
                       repeat.place));
  }
  return kDone;
}

/// Prints an expectation with the first rows that do not fulfil it, and the commands that do those
/// runs again.
void PrintExpectation(const ExpectationResult& result, const std::string& folder) {
  const auto failed = static_cast<int64_t>(result.failures.size());
  if (result.rows == 0) {
    Print("  FAILS: {} (it is about no row)\n", result.text);
    return;
  }
  if (result.holds) {
    Print("  holds: {} ({})\n", result.text, Counted(result.rows, "row"));
    return;
  }
  Print("  FAILS: {} ({} of {})\n", result.text, failed, Counted(result.rows, "row"));
  for (size_t i = 0; i < std::min(result.failures.size(), kShownFailures); ++i) {
    const RowFailure& failure = result.failures[i];
    Print("    row {}: {}\n      {}\n", failure.place, EscapeControl(failure.why),
          RunCommand(failure.point, folder));
  }
  if (result.failures.size() > kShownFailures) {
    Print("    and {} more (--json)\n", result.failures.size() - kShownFailures);
  }
}

Json ExpectationJson(const ExpectationResult& result, const std::string& folder) {
  Json failures = Json::array();
  for (const RowFailure& failure : result.failures) {
    failures.push_back({{"row", failure.place},
                        {"why", failure.why},
                        {"inputs", failure.point},
                        {"command", RunCommand(failure.point, folder)}});
  }
  return {{"expect", result.text},
          {"rows", result.rows},
          {"holds", result.holds},
          {"failures", failures}};
}

/// What there is to say at the end; returns the exit status.
int Report(const ReadySweep& sweep, SweepStore* store, const SweepOptions& options,
           const std::vector<std::string>& logs, double seconds) {
  const Result<RowCounts> counts = store->Counts();
  if (!counts) return Unusable(counts.error().message);
  // A signal may have ended it, or a batch system goes on with the rest.
  const bool whole = counts->missing() == 0;
  // What is not there yet cannot be judged.
  Result<std::vector<ExpectationResult>> expectations = std::vector<ExpectationResult>();
  if (whole) expectations = CheckExpectations(sweep.file, store);
  // The rows are done all the same, and no output is made of what is not known.
  if (!expectations) {
    Say("{} of {} done: {}\n", counts->done, Counted(counts->rows, "row"), store->path());
    return Unusable(expectations.error().message);
  }
  const bool holds = std::ranges::all_of(*expectations, &ExpectationResult::holds);
  const int64_t failed = counts->failed + counts->crashed + counts->timeout;
  if (options.json) {
    Json list = Json::array();
    for (const ExpectationResult& one : *expectations)
      list.push_back(ExpectationJson(one, sweep.file.folder));
    Json json = CountsJson(store->path(), *counts);
    json["wall_seconds"] = seconds;
    json["expectations"] = list;
    json["logs"] = logs;
    PrintJson(json);
  } else {
    Print("{} of {} done{} in {}: {}\n", counts->done, Counted(counts->rows, "row"),
          failed == 0 ? "" : fmt::format(", {} failed", failed), DurationText(seconds),
          store->path());
    for (const ExpectationResult& one : *expectations) PrintExpectation(one, sweep.file.folder);
    for (const std::string& log : logs) Print("  log {}\n", log);
  }
  // Who has left a batch system to it has what was asked for.
  if (!whole && options.detach && CaughtSignal() == 0) return kDone;
  if (!whole) {
    Say("stopped; {} left, with which the same command goes on\n",
        Counted(counts->missing(), "row"));
    return kNo;
  }
  if (failed > 0) {
    Say("morphbus sweep missing {} lists the rows that failed, --retry runs them again\n",
        ShellWord(store->path()));
  }
  // A signal may have come while logs were kept, of which some are missing then.
  if (CaughtSignal() != 0) return kNo;
  // What the file expects is what was asked; that runs failed is told where nothing else went
  // wrong.
  return !holds ? kNo : failed > 0 ? kFailed : kDone;
}

/// morphbus sweep FILE.
int RunSweep(SweepOptions options) {
  const std::optional<ReadySweep> sweep = Prepare(&options);
  if (!sweep) return kUnusable;
  if (options.detach && options.engines.kind != EngineKind::kSlurm) {
    return Unusable("--detach: only Slurm goes on by itself");
  }
  if (options.dry_run) return Estimate(*sweep, options);
  // What another plan has left in the database stays there: rows that this one has, too, are done.
  const std::string path = options.output.empty() ? DatabaseOf(options.file) : options.output;
  Result<std::unique_ptr<SweepStore>> store = SweepStore::OpenToWrite(path);
  if (!store) return Unusable(store.error().message);
  // From here on a signal ends the rows under way, and what was done is written.
  CatchSignals();
  Result<void> planned = (*store)->SetPlan(sweep->plan, sweep->origin);
  if (planned && options.retry) planned = (*store)->ForgetFailed();
  if (!planned) return Failed(planned.error().message);
  const WallTimer timer;
  if (const int status = RunMissing(store->get(), options); status != kDone) return status;
  // Which rows' logs the file asks for follows from all figures: they are made by running again.
  std::vector<std::string> logs;
  const int kept = CaughtSignal() == 0 && !options.detach
                       ? KeepLogs(sweep->file, store->get(), options, &logs)
                       : kDone;
  if (kept != kDone) return kept;
  return Report(*sweep, store->get(), options, logs, timer.seconds());
}

/// Adds `sweep run`, which is meant by `sweep FILE.toml`.
void AddSweepRun(Subcommand* sweep) {
  Subcommand sub =
      sweep->Command("run", "Run what is missing of a sweep (the word may be left out)");
  auto options = std::make_shared<SweepOptions>();
  sub.Add("FILE.toml", &options->file, "The sweep, in TOML (docs/sweep.md)").Required();
  sub.Add("VALUES", &options->overrides,
          "In the place of what the file says: amplitude=10,20 or seed=1..9:1");
  sub.Flag("--dry-run", &options->dry_run,
           "Only say how many runs it is, about how long and how large");
  sub.Add("-o,--output", &options->output, "The database (default: FILE.sweep.db beside the file)")
      .TypeName("DB");
  AddEngine(&sub, options.get());
  sub.Flag("--detach", &options->detach,
           "Leave once Slurm has the rows; the same command takes their results in");
  sub.Flag("--retry", &options->retry, "Also run those again that failed");
  sub.Json(&options->json);
  sub.Footer(
      "Exit status 1: an expectation of the file does not hold, or a signal ended it; 3: runs "
      "failed.\n"
      "Examples:\n"
      "  morphbus sweep walk.toml --dry-run\n"
      "  morphbus sweep walk.toml seed=1..20:1 --jobs 4\n"
      "  morphbus sweep walk.toml --engine slurm --detach");
  sub.Do([options] { return RunSweep(*options); });
}

}  // namespace

std::string DatabaseOf(const std::string& file) {
  return std::filesystem::path(file).replace_extension(".sweep.db").string();
}

std::optional<SweepOrigin> OriginOf(const SweepOptions& options) {
  Result<std::string> text = ReadFile(options.file, size_t{16} << 20);
  if (!text) return Refuse(text.error().message);
  // Every database of SQLite begins so.
  if (text->starts_with("SQLite format 3")) {
    return Refuse(
        fmt::format("{} is the database of a sweep, and not its file: morphbus sweep "
                    "status {} looks into it",
                    options.file, ShellWord(options.file)));
  }
  std::error_code unknown;
  // Paths in the file are relative to its folder, wherever the sweep is gone on with.
  const std::filesystem::path path = std::filesystem::absolute(options.file, unknown);
  return SweepOrigin{path.parent_path().string(), std::move(*text), options.overrides};
}

std::unique_ptr<SweepStore> OpenNamed(const std::string& name) {
  Result<std::unique_ptr<SweepStore>> store =
      SweepStore::OpenToRead(name.ends_with(".toml") ? DatabaseOf(name) : name);
  if (store) return std::move(*store);
  Unusable(store.error().message);
  return nullptr;
}

Json CountsJson(const std::string& database, const RowCounts& counts) {
  return {{"database", database},       {"rows", counts.rows},       {"done", counts.done},
          {"failed", counts.failed},    {"crashed", counts.crashed}, {"timeout", counts.timeout},
          {"missing", counts.missing()}};
}

int RunMissing(SweepStore* store, const SweepOptions& options,
               const std::optional<LastRows>& last) {
  Result<std::unique_ptr<MissingRows>> rows = MissingRows::Of(store, last ? last->from : 1);
  if (!rows) return Unusable(rows.error().message);
  // An engine that has nothing to do would end what a later generation's rows run in.
  if (last && (*rows)->rows() == 0) return kDone;
  if (last) (*rows)->set_label(last->label);
  const EngineResult run =
      RunByEngine({options.engines, options.jobs, options.timeout, store->path() + ".jobs", false,
                   options.detach, options.retry},
                  rows->get());
  const Result<void> settled = (*rows)->Settle();
  if (run && settled) return kDone;
  const std::string why = run ? settled.error().message : run.error().message;
  // A reason of several lines gets the way out on a line of its own.
  const std::string message =
      fmt::format("{}{} what was written before is whole, and the same command goes on there", why,
                  why.find('\n') == std::string::npos ? ";" : "\n ");
  return !run && run.error().unusable ? Unusable(message) : Failed(message);
}

EngineResult RunAgain(RowSource* rows, const SweepStore& store, const SweepOptions& options,
                      bool logs) {
  EngineOptions engine = {options.engines, options.jobs, options.timeout, "", true, false, false};
  // The logs are to be on this machine, whose program makes them.
  if (logs && engine.settings.kind == EngineKind::kSsh) {
    engine.settings.kind = EngineKind::kLocal;
    engine.settings.binary.clear();
  }
  if (engine.settings.kind == EngineKind::kSlurm) {
    // Two of these may be under way, and neither is to take the other's results.
    engine.folder = store.path() + ".jobs.XXXXXX";
    if (mkdtemp(engine.folder.data()) == nullptr) {
      return Fail(fmt::format("cannot make {}: {}", engine.folder, std::strerror(errno)));
    }
  }
  return RunByEngine(engine, rows);
}

int EngineFailed(const EngineError& error) {
  return error.unusable ? Unusable(error.message) : Failed(error.message);
}

void AddEngine(Subcommand* sub, SweepOptions* options) {
  sub->Add("--engine", &options->engine,
           "Where rows run: local, slurm or ssh (default: as the file says, or here)")
      .TypeName("local|slurm|ssh");
  sub->Add("--binary", &options->binary,
           "The morphbus that runs the rows there (default: as the file says, or this one)")
      .TypeName("FILE");
  sub->Add("-j,--jobs", &options->jobs,
           "Rows at a time: here, in a task of Slurm or on a host (default: one a processor, or as "
           "the file says)")
      .Range(1, 1024);
  sub->Add("--timeout", &options->timeout,
           "Wall time that a run may take (default: 60 s and 20 times its own)")
      .Seconds();
}

bool ChooseEngine(const EngineSettings& engines, const std::string& folder, SweepOptions* options) {
  const std::optional<EngineKind> kind =
      options->engine.empty() ? engines.kind : EngineOfName(options->engine);
  if (!kind) {
    Unusable(fmt::format("--engine: there is no engine '{}'{}; there are {}", options->engine,
                         DidYouMean(options->engine, EngineNames()), NameSome(EngineNames())));
    return false;
  }
  options->engines = engines;
  options->engines.kind = *kind;
  std::string& binary = options->engines.binary;
  // Where the file speaks of other machines, its path is one of theirs.
  if (*kind == EngineKind::kLocal && engines.kind != *kind) binary.clear();
  // Paths of the file are relative to it, those of the command line to where the user is.
  std::filesystem::path base = folder;
  if (!options->binary.empty()) {
    binary = options->binary;
    base = std::filesystem::current_path();
    for (SshHost& host : options->engines.hosts) host.binary.clear();
  }
  // A word without a slash is looked for in $PATH, and a path of ssh's is one of the other machine.
  if (*kind != EngineKind::kSsh && binary.find('/') != std::string::npos) {
    binary = (base / binary).lexically_normal().string();
  }
  return true;
}

int JobsOf(const SweepOptions& options) {
  return options.jobs > 0 ? options.jobs : ProcessorCount();
}

std::string EstimateText(double run_seconds, const SweepOptions& options) {
  if (options.engines.kind != EngineKind::kLocal) {
    return DurationText(run_seconds) + " of one processor's time";
  }
  return fmt::format("{} with {}", DurationText(run_seconds / JobsOf(options)),
                     Counted(JobsOf(options), "process", "processes"));
}

void AddSweep(CommandLine* line) {
  Subcommand sweep =
      line->Add("sweep", "Run a robot many times, over parameters, robots, worlds and seeds");
  AddSweepRun(&sweep);
  AddSweepQueries(&sweep);
  sweep.Implied("run");
  sweep.Footer(
      "Examples:\n"
      "  morphbus sweep walk.toml --dry-run\n"
      "  morphbus sweep walk.toml\n"
      "  morphbus sweep export walk.toml --to csv -o walk.csv");
}

}  // namespace morphbus::tools
