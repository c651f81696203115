// morphbus reproduce: a logged run once more, which must say the same to the bit.

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>

#include "compiler/base/temporary_files.h"
#include "compiler/base/version.h"
#include "logger/compare/log_difference.h"
#include "sim/arithmetic.h"
#include "tools/base/print.h"
#include "tools/commands/commands.h"
#include "tools/convert/rerun_report.h"
#include "tools/launch/inproc_run.h"
#include "tools/launch/launcher.h"
#include "tools/machine/key_choice.h"
#include "tools/machine/network.h"
#include "tools/machine/run_registry.h"
#include "tools/plan/reproduction.h"
#include "tools/spy/lcm_sources.h"

namespace morphbus::tools {
namespace {

/// The options of `morphbus reproduce`.
struct ReproduceOptions {
  std::string log;
  std::string run;
  std::string output;  ///< Where the second run's log stays; empty: nowhere.
  bool processes = false;
  bool force = false;
  bool json = false;
};

/// The second run's log where nobody asks to keep it: in a folder of its own, which goes with it,
/// under both names that a log has.
struct PassingLog {
  explicit PassingLog(const std::string& in)
      : folder(in), partial(in + "/again.log.partial"), log(in + "/again.log") {}
  TemporaryPath folder, partial, log;
};

/// Does the run again, writes its log, and reads what that is. Says nothing on success.
Result<logger::RunLog> RunAgain(RunPlan* plan, const ReproduceOptions& options,
                                const std::string& log) {
  // The second run has a name and a folder of its own, so that it can go on beside any other.
  Result<RunDirectory> directory = RunDirectory::Claim("");
  if (!directory) return tl::unexpected(directory.error());
  // The run's name is in its channels and not in what is compared, so that it may be another one.
  plan->description.set_run(directory->name());
  plan->description.set_started(WallTime());
  const Result<bridge::RunKey> key =
      KeyOfNewRun(plan->description.open(), "", options.processes ? directory->path() : "");
  if (!key) return tl::unexpected(key.error());
  RunOptions launched;
  launched.isolate = true;
  const RunOutcome outcome = options.processes ? Launcher(*plan, launched, *directory, log).Run()
                                               : RunInProcess(*plan, log, *key);
  if (CaughtSignal() != 0) return Fail("interrupted");
  // A run that failed the first time fails again; its messages are what counts.
  Result<logger::RunLog> again =
      logger::LoadRunLog(outcome.log.empty() ? log : outcome.log, {.run = "", .series = false});
  if (!again && !outcome.error.empty()) return Fail(outcome.error);
  return again;
}

/// What made the log and what runs now, where that may be the reason of a difference; else empty.
std::string OriginNote(const logger::LogFacts& facts) {
  std::vector<std::string> unlike;
  if (facts.build != Version()) {
    unlike.push_back(fmt::format("made by {}, this is {}",
                                 facts.build.empty() ? "an unknown version" : facts.build,
                                 Version()));
  }
  // Older logs do not tell.
  if (!facts.arithmetic.empty() && facts.arithmetic != sim::ArithmeticFingerprint()) {
    unlike.push_back(fmt::format("made with arithmetic {}, that of this machine is {}",
                                 facts.arithmetic, sim::ArithmeticFingerprint()));
  }
  return unlike.empty() ? "" : fmt::format("{}: its hash may differ", fmt::join(unlike, "; "));
}

/// Both runs side by side, for scripts.
Json FindingsJson(const logger::LogFacts& logged, const logger::LogFacts& again,
                  const logger::LogDifference& difference, const RerunDifferences& fields) {
  Json json = {{"same", difference.differing == 0},
               {"whole", logged.whole()},
               {"hash", again.run_hash},
               {"logged_hash", logged.run_hash},
               {"messages", difference.compared},
               {"differing", difference.differing},
               {"made_by", logged.build},
               {"this_is", Version()},
               {"arithmetic", again.arithmetic},
               {"logged_arithmetic", logged.arithmetic},
               {"note", OriginNote(logged)},
               {"first", fields.first()}};
  if (difference.first) json["first"]["channel"] = difference.first->channel;
  return json;
}

/// The same for people.
void PrintFindings(const ReproduceOptions& options, const Json& found) {
  if (found["same"].get<bool>()) {
    Print("{}: {} again, hash {}\n",
          found["whole"].get<bool>() ? "same" : "not whole, and what there is the same",
          Counted(found["messages"].get<int64_t>(), "message"), found["hash"].get<std::string>());
    return;
  }
  // Hashes say that the runs differ, and the first field that does, where to look.
  const Json& first = found["first"];
  Print(
      "different: {} of {}, hash {}, in {} {}\nfirst at tick {} ({:.2f} s), {}, {}: {} in "
      "the log, {} now\n",
      found["differing"].get<int64_t>(), Counted(found["messages"].get<int64_t>(), "message"),
      found["hash"].get<std::string>(), options.log, found["logged_hash"].get<std::string>(),
      first["tick"].get<int64_t>(), first["seconds"].get<double>(),
      first["channel"].get<std::string>(), first["field"].get<std::string>(),
      first["logged"].get<std::string>(), first["again"].get<std::string>());
}

/// Reads the log, runs, compares.
int Reproduce(const ReproduceOptions& options) {
  // The logged run, and whether the second log may be written where it is asked for.
  const Result<logger::RunLog> log =
      logger::LoadRunLog(options.log, {.run = options.run, .series = false});
  if (!log) return Unusable(log.error().message);
  if (!options.output.empty() && !MayWriteLog(options.output, options.force, {options.log})) {
    return kUnusable;
  }
  if (const std::string note = OriginNote(log->facts); !note.empty()) Warn(note);
  // What the log does not tell enough of is refused before anything runs.
  Result<RunPlan> plan = PlanAgain(*log);
  if (!plan) return Unusable(options.log + ": " + plan.error().message);
  std::optional<PassingLog> passing;
  if (options.output.empty()) {
    std::error_code failure;
    const std::filesystem::path parent = std::filesystem::temp_directory_path(failure);
    // mkdtemp makes a folder that no other user can look into.
    std::string folder = (parent / "morphbus-reproduce-XXXXXX").string();
    if (failure || mkdtemp(folder.data()) == nullptr) {
      return Unusable(fmt::format(
          "cannot make a folder for the second log in {}; $TMPDIR names another", parent.string()));
    }
    passing.emplace(folder);
  }
  const std::string second =
      passing ? passing->log.path()
              : std::filesystem::absolute(options.output).lexically_normal().string();
  // A process can enter a network of its own only before it has threads.
  if (options.processes) {
    if (Result<void> entered = EnterPrivateNetwork(); !entered) {
      return Unusable(entered.error().message);
    }
  }
  const Result<logger::RunLog> again = RunAgain(&*plan, options, second);
  if (!again) return Failed(again.error().message);
  // The messages decide: hashes differ where they do.
  const Result<logger::LogDifference> difference =
      logger::FirstUnlikeMessage(log->facts, again->facts);
  if (!difference) return Unusable(difference.error().message);
  // Of the first message that differs the field is named, by the types that this build knows.
  const Result<LcmSchema> schema = LcmSchema::Parse(LcmSources());
  if (!schema) return Unusable(schema.error().message);
  RerunDifferences fields(*schema);
  if (const auto& first = difference->first) {
    fields.Take({first->topic, first->tick, first->sim_time_us, first->first, first->second});
  }
  const Json found = FindingsJson(log->facts, again->facts, *difference, fields);
  options.json ? PrintJson(found) : PrintFindings(options, found);
  // Same messages of a log that lacks some are no proof that the hash is the same.
  if (difference->differing > 0) return kNo;
  if (log->facts.whole()) return kDone;
  return Unusable(
      fmt::format("{} is not whole, so that its hash proves nothing; morphbus verify "
                  "says where",
                  options.log));
}

}  // namespace

void AddReproduce(CommandLine* line) {
  Subcommand sub = line->Add("reproduce", "Run again what a log says, and demand the same hash");
  auto options = std::make_shared<ReproduceOptions>();
  sub.Add("LOG", &options->log, "Log file").Required();
  sub.Flag("--processes", &options->processes,
           "A process a module in a private network, as run --isolate (default: one process)");
  sub.Add("--run", &options->run, "Which run, if the log holds several (default: the first)")
      .TypeName("NAME");
  sub.Add("-o,--log", &options->output, "Keep the second run's log there (default: it is removed)")
      .TypeName("FILE");
  sub.Force(&options->force);
  sub.Json(&options->json);
  sub.Footer(
      "Exit status 0: the same to the bit; 1: not, and what differs first is named; 2: the log "
      "does "
      "not tell enough.\n"
      "Examples:\n"
      "  morphbus reproduce walk.log\n"
      "  morphbus reproduce walk.log.zst --processes --json");
  sub.Do([options] { return Reproduce(*options); });
}

}  // namespace morphbus::tools
