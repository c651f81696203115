#pragma once
// Where a sweep runs, as the table [engine] of its file says it (docs/sweep.md, Engines).

#include <optional>
#include <string>
#include <vector>

#include "compiler/source/toml.h"

namespace morphbus::tools {

/// Processes of this machine; tasks of the batch system Slurm; other machines, by ssh.
enum class EngineKind { kLocal, kSlurm, kSsh };

/// "local", "slurm", "ssh".
const char* EngineName(EngineKind kind);
/// The engine of this name; nothing for any other text.
std::optional<EngineKind> EngineOfName(const std::string& name);
/// The names, for messages.
const std::vector<std::string>& EngineNames();

/// What Slurm is told of the tasks. An empty text: nothing, so that the cluster's own default
/// holds.
struct SlurmSettings {
  std::string partition, account;
  /// The limit of a task's time, as sbatch takes it: "1:00:00".
  std::string time;
  /// Processors of a task: so many rows run in it at a time.
  int cpus = 1;
  /// About how long a task shall take, wall time (s).
  double chunk_s = 300;
  /// Further words for sbatch.
  std::vector<std::string> options;
};

/// A machine that ssh reaches.
struct SshHost {
  /// "user@name", as ssh takes it.
  std::string address;
  /// 0: ssh's own choice.
  int port = 0;
  /// Rows at a time; 0: as many as the machine has processors.
  int jobs = 0;
  /// Path of the program there; empty: EngineSettings::binary.
  std::string binary;
};

/// The table as a whole. It may speak of engines that are not chosen.
struct EngineSettings {
  EngineKind kind = EngineKind::kLocal;
  /// Path of the program where the rows run; empty: that of this program.
  std::string binary;
  SlurmSettings slurm;
  std::vector<SshHost> hosts;
};

/// Reads what stands behind `engine`. What is wrong is said to `diagnostics`, with its place.
EngineSettings ReadEngine(const source::TomlEntry& entry, source::Diagnostics* diagnostics);

/// The same of the text of a sweep's file, in which everything else is left alone. Nothing if it
/// cannot be read.
std::optional<EngineSettings> EngineOfText(const std::string& text);

/// "[user@]name[:port][/jobs]"; nothing for any other text.
std::optional<SshHost> HostOfText(const std::string& text);

}  // namespace morphbus::tools
