#pragma once
// What Slurm's own commands say: sbatch, squeue, scontrol and scancel. None of them needs its
// accounting database.

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "compiler/base/result.h"

namespace morphbus::tools {

/// Where a task of an array job stands.
struct SlurmTaskState {
  /// As squeue calls it: "RUNNING", "NODE_FAIL".
  std::string state;
  /// Where it runs or ran; empty: nowhere yet.
  std::string node;
  /// Why it waits, or ended.
  std::string reason;
  /// Of the program, once it has ended.
  int exit_status = 0;

  /// Whether it has ended for good: one that Slurm puts into the queue again has not.
  [[nodiscard]] bool ended() const;
  /// Whether it waits for something that need not come by itself: somebody holds it, or no node and
  /// no limit lets it run.
  [[nodiscard]] bool held() const;
};

/// A job as Slurm knows it.
struct SlurmQueue {
  std::string id;
  /// By their numbers. One that is not there ended some time ago, and is forgotten.
  std::map<int, SlurmTaskState> tasks;
};

/// Reads what `squeue` printed.
SlurmQueue ReadQueue(const std::string& text);

/// Submits a job and returns its id: `words` go to sbatch, and the last of them is the script. The
/// error has sbatch's own words; Slurm may have taken the job all the same. sbatch is waited for
/// whatever happens, for one that is stopped leaves a job of which nobody knows.
Result<std::string> SubmitJob(const std::vector<std::string>& words);

/// Where the tasks of a job of one's own stand. It is found by its name, which no other one has,
/// among all jobs if `id` is empty. No tasks, if Slurm does not know it any more. Fails if Slurm
/// does not answer. `go_on` is as in RunProgram, here and below.
Result<SlurmQueue> AskQueue(const std::string& id, const std::string& name,
                            const std::function<bool()>& go_on);

/// The number below which those of array tasks have to be; Slurm's default where it does not say.
int MaxArraySize(const std::function<bool()>& go_on);

/// Ends a job, if there is one; by its name if its id is not known.
void CancelJob(const std::string& id, const std::string& name);

}  // namespace morphbus::tools
