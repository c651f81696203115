#pragma once
// An array job of Slurm and the folder in which it works: a chunk, a file of results and what Slurm
// prints for each task, the script that all of them run, and what is known of the job.

#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tools/sweep/chunk_file.h"
#include "tools/sweep/engine.h"

namespace morphbus::tools {

/// A task of a job: it runs one chunk.
struct SlurmTask {
  SlurmTask(int its_number, int its_tries, std::string results_path)
      : number(its_number), tries(its_tries), results(std::move(results_path)) {}
  /// From 1, as Slurm counts them.
  int number = 1;
  /// So many tasks have worked at its rows by now, it among them, of which those before it came to
  /// nothing.
  int tries = 1;
  /// Keys of its rows that are asked for and have no result.
  std::set<std::string> left;
  ResultsFile results;
  /// Rows of its chunk, and results that have been read.
  int64_t rows = 0, results_seen = 0;
  /// Slurm has been seen to work at it, or to be about to.
  bool seen = false;
  bool ended = false;
};

/// A job.
struct SlurmJob {
  std::string folder;
  /// No other job has it.
  std::string name;
  /// As Slurm calls it; empty: it is not known whether it was submitted.
  std::string id;
  std::vector<SlurmTask> tasks;
  /// Nodes on which it does not run.
  std::set<std::string> excluded;
  /// It was submitted by the call that looks at it, and not by an earlier one.
  bool submitted_here = false;

  [[nodiscard]] std::string ChunkPath(int task) const;
  [[nodiscard]] std::string ResultsPath(int task) const;
  /// What the task and Slurm say of it.
  [[nodiscard]] std::string OutputPath(int task) const;
  [[nodiscard]] std::string ScriptPath() const;
};

/// A row that is to be run, without its inputs.
struct SlurmRow {
  RowTask task;
  int tries = 1;
};

/// How rows are shared out to tasks.
struct ChunkSize {
  /// Wall time that the rows of a chunk are to take together, one after the other (s).
  double seconds = 300;
  /// There are no more chunks; they become larger instead.
  int most_chunks = 1000;
};

/// Writes the folder of a job with these rows, in their order, and everything in it. The job has no
/// id yet. Nothing, if `source` wants to stop before that is done. Fails if a file cannot be
/// written, or as `source` does.
Result<std::optional<SlurmJob>> WriteJob(const std::string& folder, const std::string& name,
                                         const std::vector<SlurmRow>& rows, const ChunkSize& size,
                                         RowSource* source);

/// Writes what is known of the job, so that another process can go on with it.
Result<void> WriteJobState(const SlurmJob& job);

/// Reads the folder of a job. Of its rows only those are taken up that `wanted` holds. Fails if
/// what is known of the job is damaged; nothing, if it was never written whole.
Result<std::optional<SlurmJob>> ReadJob(const std::string& folder,
                                        const std::function<bool(const std::string& key)>& wanted);

/// The folders of jobs that lie in `folder`: job-1, job-2, ….
std::vector<std::string> JobFolders(const std::string& folder);
/// Removes the folder of a job with everything in it. One that holds other things than a job's
/// stays.
void RemoveJob(const std::string& folder);

/// The script of the tasks: runs the chunk of its task by the program at `binary`.
std::string TaskScript(const SlurmJob& job, const std::string& binary, int jobs, double timeout_s);

/// A name for a new job, of the database's: "morphbus-creep-1a2b3c4d".
Result<std::string> NewJobName(const std::string& folder);

}  // namespace morphbus::tools
