#pragma once
// Runs rows on a cluster: array jobs of the batch system Slurm.

#include "tools/sweep/engine.h"

namespace morphbus::tools {

/// Runs all rows of `source` as tasks of Slurm, which work in EngineOptions::folder, where the
/// nodes see it under the same name. What is in the folder already is gone on with: results are
/// taken in, jobs that run are waited for, and only what neither has is submitted. When the source
/// wants to stop, the jobs go on, unless they are for once. Rows whose tasks end several times
/// without any of them having been run have failed. Fails if Slurm does not take the job, if nodes
/// do not have the program, or with an error of `source`.
EngineResult RunOnSlurm(const EngineOptions& options, RowSource* source);

}  // namespace morphbus::tools
