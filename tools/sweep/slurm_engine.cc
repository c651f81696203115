#include "tools/sweep/slurm_engine.h"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include "compiler/base/text.h"
#include "tools/base/files.h"
#include "tools/base/messages.h"
#include "tools/base/print.h"
#include "tools/launch/launcher_link.h"
#include "tools/machine/program_output.h"
#include "tools/machine/wall_clock.h"
#include "tools/sweep/slurm_job.h"
#include "tools/sweep/slurm_queue.h"

namespace morphbus::tools {
namespace {

/// How often the engine looks at signals, milliseconds.
constexpr int kSlurmLookMs = 100;
/// Between two questions to Slurm, s: few rows are soon done, and a controller is asked by many.
constexpr double kFirstPause = 0.5, kLongestPause = 15, kPauseGrowth = 1.3;
/// So many tasks in turn may end without having run a row of theirs.
constexpr int kMostTries = 3;
/// An array job has no more tasks, even where it might.
constexpr int kMostTasks = 1000;

/// One call of RunOnSlurm.
class SlurmEngine {
 public:
  SlurmEngine(const EngineOptions& options, RowSource* source)
      : options_(options),
        source_(*source),
        folder_(std::filesystem::absolute(options.folder).lexically_normal().string()) {}

  EngineResult Run() {
    EngineResult done = Work();
    std::error_code unknown;
    if (options_.once) std::filesystem::remove_all(folder_, unknown);
    return done;
  }

 private:
  [[nodiscard]] std::function<bool()> going_on() {
    return [this] { return source_.GoOn(); };
  }

  EngineResult Work() {
    if (Result<void> drained = Drain(); !drained) return Fail(drained.error().message);
    // Where nothing is wanted, and nothing is left of an earlier call, Slurm is not needed.
    if (CaughtSignal() != 0 || (waiting_.empty() && JobFolders(folder_).empty())) return {};
    for (const char* program : {"sbatch", "squeue"}) {
      const Result<std::string> found = FindProgram(program);
      if (!found) return NoEngine("no Slurm: " + found.error().message);
    }
    ReadJobs();
    EngineResult done = Loop();
    if (Result<void> left = Leave(); !left && done) return Fail(left.error().message);
    return done;
  }

  /// Finds out which rows there are. Their inputs are asked for again when they are written.
  Result<void> Drain() {
    while (true) {
      Result<std::optional<RowTask>> next = source_.Next();
      if (!next) return Fail(next.error().message);
      if (!*next) return {};
      RowTask task = std::move(**next);
      task.inputs = {};
      if (!task.log.empty()) task.log = std::filesystem::absolute(task.log).string();
      waiting_[task.key].push_back(static_cast<int>(rows_.size()));
      rows_.push_back(std::move(task));
    }
  }

  /// Takes up the jobs of the folder.
  void ReadJobs() {
    for (const std::string& path : JobFolders(folder_)) {
      Result<std::optional<SlurmJob>> job =
          ReadJob(path, [this](const std::string& key) { return waiting_.contains(key); });
      if (!job) {
        Warn(job.error().message + ": rows of that job are run again");
      } else if (*job) {
        jobs_.push_back(std::move(**job));
      } else {
        // It was not submitted.
        RemoveJob(path);
      }
    }
  }

  EngineResult Loop() {
    double pause = kFirstPause;
    while (true) {
      for (SlurmJob& job : jobs_) {
        if (EngineResult followed = Follow(&job); !followed) return followed;
      }
      first_look_ = false;
      if (waiting_.empty() || !source_.GoOn()) return {};
      const std::vector<SlurmRow> rows = RowsWithoutTask();
      if (!rows.empty()) {
        if (EngineResult submitted = Submit(rows); !submitted) return submitted;
        pause = kFirstPause;
      }
      if (options_.detach) return {};
      const WallTimer timer;
      while (timer.seconds() < pause) {
        if (!source_.GoOn()) return {};
        poll(nullptr, 0, kSlurmLookMs);
      }
      pause = std::min(pause * kPauseGrowth, kLongestPause);
    }
  }

  /// Takes in what there is of a job, and looks after the tasks that have ended.
  EngineResult Follow(SlurmJob* job) {
    const auto open = [](const SlurmTask& task) { return !task.ended; };
    if (std::ranges::none_of(job->tasks, open)) return {};
    const Result<SlurmQueue> queue = AskQueue(job->id, job->name, going_on());
    // Results are read after the question: what ended before it has written all of them.
    for (SlurmTask& task : job->tasks) {
      if (Result<void> merged = Merge(&task); !merged) return Fail(merged.error().message);
    }
    if (!queue) {
      if (CaughtSignal() == 0 && !std::exchange(silence_told_, true)) {
        Warn(fmt::format("Slurm does not answer ({}); it is asked again", queue.error().message));
      }
      return {};
    }
    if (job->id.empty()) job->id = queue->id;
    if (RunsForNobody(*job)) {
      CancelJob(job->id, job->name);
      for (SlurmTask& task : job->tasks) task.ended = true;
      return {};
    }
    std::vector<std::pair<SlurmTask*, SlurmTaskState>> ends;
    for (SlurmTask& task : job->tasks) {
      const auto found = queue->tasks.find(task.number);
      const bool known = found != queue->tasks.end();
      if (known && !found->second.ended()) {
        task.seen = true;
        if (found->second.held()) TellHold(*job, found->second.reason);
      } else if (!task.ended) {
        task.ended = true;
        ends.emplace_back(&task, known ? found->second : SlurmTaskState());
      }
    }
    for (const auto& [task, state] : ends) {
      if (EngineResult looked = LookAtEnd(*job, task, state); !looked) return looked;
    }
    return {};
  }

  /// Says why Slurm may never run a task, once of each reason.
  void TellHold(const SlurmJob& job, const std::string& reason) {
    // What stands behind a comma are nodes, which come and go.
    const std::string why = EscapeControl(reason.substr(0, reason.find(',')));
    if (!holds_told_.emplace(job.name, why).second) return;
    Warn(fmt::format("Slurm holds job {0} ({1}); scontrol show job {0} says more", job.id, why));
  }

  /// Whether rows are still to be run in it that are not asked for: those that are would have to
  /// wait for them.
  static bool RunsForNobody(const SlurmJob& job) {
    return std::ranges::any_of(job.tasks, [](const SlurmTask& task) {
      return !task.ended && task.results_seen + static_cast<int64_t>(task.left.size()) < task.rows;
    });
  }

  /// Takes the results that a task has written since.
  Result<void> Merge(SlurmTask* task) {
    if (task->ended) return {};
    return task->results.ReadNew([&](const PlacedResult& one) -> Result<void> {
      ++task->results_seen;
      task->left.erase(one.key);
      // A failure from before this call: its row has no task now, and is submitted again.
      const bool old_failure =
          options_.retry && first_look_ && one.result.status != RowResult::Status::kRan;
      if (old_failure) return {};
      return TakeResult(one.key, one.result);
    });
  }

  /// Gives a result to all rows of these inputs.
  Result<void> TakeResult(const std::string& key, const RowResult& result) {
    const auto found = waiting_.find(key);
    // Somebody else wanted it, or two tasks have run it.
    if (found == waiting_.end()) return {};
    const std::vector<int> indices = std::move(found->second);
    waiting_.erase(found);
    // Of equal rows the first one was run (RowsWithoutTask).
    const std::string& log = rows_[static_cast<size_t>(indices.front())].log;
    for (const int index : indices) {
      const RowTask& row = rows_[static_cast<size_t>(index)];
      Result<void> taken = CopyLog(result, log, row.log);
      if (taken) taken = source_.Take(row, result);
      if (!taken) return taken;
    }
    return {};
  }

  /// Gives a row the log of another one of equal inputs.
  static Result<void> CopyLog(const RowResult& result, const std::string& log,
                              const std::string& copy) {
    std::error_code error;
    if (copy.empty() || copy == log) return {};
    // A run that crashes leaves none.
    const bool ran = result.status == RowResult::Status::kRan;
    if (!ran && !std::filesystem::exists(log, error)) return {};
    // A log that is there is whole.
    const std::string part = copy + ".part";
    std::filesystem::copy_file(log, part, std::filesystem::copy_options::overwrite_existing, error);
    if (!error) std::filesystem::rename(part, copy, error);
    if (error) return Fail(fmt::format("cannot copy {} to {}: {}", log, copy, error.message()));
    return {};
  }

  /// What is to be done about the rows that a task has left: they are submitted again, unless that
  /// was done often enough.
  EngineResult LookAtEnd(const SlurmJob& job, SlurmTask* ended, const SlurmTaskState& state) {
    // Another task may have run some of them.
    std::erase_if(ended->left, [this](const std::string& key) { return !waiting_.contains(key); });
    const SlurmTask& task = *ended;
    // What was over when this began is another call's; its rows are submitted anew.
    if (task.left.empty() || !task.seen) return {};
    if (state.state == "CANCELLED") {
      return Fail(fmt::format("Slurm's job {} was cancelled", job.id));
    }
    const std::string reason = EndText(job, task, state);
    // Nothing of this is up to the rows.
    const bool no_program =
        state.exit_status == kUnusable || state.exit_status == 126 || state.exit_status == 127;
    // An earlier call may have named another program; this one's is tried.
    if (no_program && !job.submitted_here) return {};
    if (no_program && !state.node.empty() && refusals_.try_emplace(state.node, reason).second) {
      Warn(fmt::format("{} cannot run rows: {}", state.node, reason));
    }
    // A node that the job could not know to be of no use is left out of the next one.
    const bool by_chance = no_program && !state.node.empty() && !job.excluded.contains(state.node);
    const bool again = task.results_seen > 0 || by_chance;
    const int tries = again ? task.tries : task.tries + 1;
    if (tries > kMostTries && no_program) {
      return NoEngine(refusals_.empty() ? reason : NoNodes());
    }
    for (const std::string& key : task.left) {
      tries_[key] = tries;
      if (tries <= kMostTries) continue;
      RowResult result = NewResult();
      result.host = state.node;
      result.error =
          fmt::format("Slurm ended its task {} times before it was run: {}", kMostTries, reason);
      if (Result<void> taken = TakeResult(key, result); !taken) return Fail(taken.error().message);
    }
    return {};
  }

  /// How a task ended, for people.
  static std::string EndText(const SlurmJob& job, const SlurmTask& task,
                             const SlurmTaskState& state) {
    const Result<std::string> output = ReadFile(job.OutputPath(task.number), size_t{16} << 20);
    const std::string last = output ? EscapeControl(LastLine(*output)) : "";
    std::string how = state.state.empty() ? "it is not known how it ended" : state.state;
    if (state.exit_status != 0) how += fmt::format(" with status {}", state.exit_status);
    if (!state.node.empty()) how += " on " + state.node;
    if (!last.empty()) how += ": " + last;
    return how;
  }

  std::string NoNodes() {
    std::string text = "nodes cannot run rows:";
    for (const auto& [node, reason] : refusals_) text += fmt::format("\n  {}: {}", node, reason);
    return text + "\n  [engine] binary = \"…\" says where the program lies there";
  }

  /// Submits rows as a new job.
  EngineResult Submit(const std::vector<SlurmRow>& rows) {
    const Result<std::string> name = NewJobName(options_.folder);
    const Result<std::string> binary = BinaryOf(options_.settings, "");
    if (!name) return Fail(name.error().message);
    if (!binary) return NoEngine(binary.error().message);
    const SlurmSettings& slurm = options_.settings.slurm;
    const int jobs = options_.jobs > 0 ? options_.jobs : slurm.cpus;
    // The numbers of tasks lie below that of the largest array, and begin with 1.
    const int most = std::min(kMostTasks, MaxArraySize(going_on()) - 1);
    const std::string folder = NewFolder();
    Result<std::optional<SlurmJob>> whole =
        WriteJob(folder, *name, rows, {slurm.chunk_s * jobs, most}, &source_);
    if (!whole) return Fail(whole.error().message);
    if (!*whole) {
      RemoveJob(folder);
      return {};
    }
    SlurmJob& job = **whole;
    // Its name is on the disk before Slurm knows it: whatever ends this process between the two,
    // the next one finds the job.
    Result<void> written =
        WriteFile(job.ScriptPath(), TaskScript(job, *binary, jobs, options_.timeout_s));
    if (written) written = WriteJobState(job);
    if (!written) return Fail(written.error().message);
    job.submitted_here = true;
    for (const auto& [node, reason] : refusals_) job.excluded.insert(node);
    const Result<std::string> id = SubmitJob(SubmitWords(job, jobs));
    if (!id && source_.GoOn()) {
      CancelJob("", job.name);
      RemoveJob(folder);
      if (!refusals_.empty()) return NoEngine(NoNodes());
      return NoEngine("Slurm does not take the job: " + id.error().message);
    }
    if (id) job.id = *id;
    jobs_.push_back(std::move(job));
    written = WriteJobState(jobs_.back());
    if (!written) return Fail(written.error().message);
    return {};
  }

  /// The rows that no task has, in the order of the sweep; those that were tried more often are
  /// behind.
  std::vector<SlurmRow> RowsWithoutTask() {
    std::set<std::string> covered;
    for (const SlurmJob& job : jobs_) {
      for (const SlurmTask& task : job.tasks) {
        if (!task.ended) covered.insert(task.left.begin(), task.left.end());
      }
    }
    std::vector<SlurmRow> rows;
    for (const RowTask& task : rows_) {
      // One of each key.
      if (!waiting_.contains(task.key) || !covered.insert(task.key).second) continue;
      const auto tries = tries_.find(task.key);
      rows.push_back({task, tries == tries_.end() ? 1 : tries->second});
    }
    std::ranges::stable_sort(rows, {}, &SlurmRow::tries);
    return rows;
  }

  /// A folder that no job has.
  [[nodiscard]] std::string NewFolder() const {
    std::error_code unknown;
    for (int number = 1;; ++number) {
      std::string folder = fmt::format("{}/job-{}", folder_, number);
      if (!std::filesystem::exists(folder, unknown)) return folder;
    }
  }

  /// The words for sbatch. What this engine needs stands behind what the user wants, and counts.
  std::vector<std::string> SubmitWords(const SlurmJob& job, int jobs) const {
    const SlurmSettings& slurm = options_.settings.slurm;
    std::vector<std::string> words = slurm.options;
    for (const auto& [option, value] :
         {std::pair("--partition=", &slurm.partition), std::pair("--account=", &slurm.account),
          std::pair("--time=", &slurm.time)}) {
      if (!value->empty()) words.push_back(option + *value);
    }
    if (!job.excluded.empty()) {
      // Of two such options sbatch takes the last one.
      std::vector<std::string> nodes(job.excluded.begin(), job.excluded.end());
      constexpr std::string_view kExclude = "--exclude=";
      for (const std::string& word : slurm.options) {
        if (word.starts_with(kExclude)) nodes.push_back(word.substr(kExclude.size()));
      }
      words.push_back(fmt::format("{}{}", kExclude, fmt::join(nodes, ",")));
    }
    words.insert(words.end(), {fmt::format("--array=1-{}", job.tasks.size()), "--nodes=1",
                               "--ntasks=1", fmt::format("--cpus-per-task={}", jobs),
                               "--job-name=" + job.name, "--requeue", "--open-mode=append",
                               "--chdir=" + job.folder, "--output=task-%a.out", job.ScriptPath()});
    return words;
  }

  /// Leaves the folder as it has to be: what is of no more use goes, and people are told of what
  /// goes on.
  Result<void> Leave() {
    std::error_code unknown;
    const bool done = waiting_.empty();
    // Results that are only in the files must be elsewhere before these go.
    if (Result<void> settled = source_.Settle(); !settled) return settled;
    std::vector<std::string> going;
    for (const SlurmJob& job : jobs_) {
      const auto is_open = [](const SlurmTask& task) { return !task.ended; };
      const bool open = std::ranges::any_of(job.tasks, is_open);
      if (open && !done && options_.once) CancelJob(job.id, job.name);
      if (open && !done && !job.id.empty()) going.push_back(job.id);
      if (done || !open) RemoveJob(job.folder);
    }
    if (done) {
      // Of some of them nothing could be read.
      for (const std::string& folder : JobFolders(folder_)) RemoveJob(folder);
    }
    // A folder that still holds jobs, or a file of the user's, stays.
    std::filesystem::remove(folder_, unknown);
    if (!going.empty() && !options_.once) {
      Say("Slurm goes on with job {}: the same command takes the results in, scancel {} ends it\n",
          fmt::join(going, ", "), fmt::join(going, " "));
    }
    return {};
  }

  const EngineOptions& options_;
  RowSource& source_;
  const std::string folder_;
  /// All rows, without their inputs, and which of them have no result yet, by their keys.
  std::vector<RowTask> rows_;
  std::map<std::string, std::vector<int>> waiting_;
  /// Of rows of which a task came to nothing.
  std::map<std::string, int> tries_;
  std::vector<SlurmJob> jobs_;
  /// Nodes without the program, and what they say.
  std::map<std::string, std::string> refusals_;
  /// Names of jobs, and why Slurm holds them.
  std::set<std::pair<std::string, std::string>> holds_told_;
  /// What there is now comes from earlier calls.
  bool first_look_ = true;
  bool silence_told_ = false;
};

}  // namespace

EngineResult RunOnSlurm(const EngineOptions& options, RowSource* source) {
  return SlurmEngine(options, source).Run();
}

}  // namespace morphbus::tools
