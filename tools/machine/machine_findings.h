#pragma once
// What `morphbus doctor` makes of what it has measured: whether it is enough, and the one command
// that mends it if not. Nothing here looks at the machine (tools/machine/machine_checks.h does), so
// that machines which are not at hand can be judged in tests.

#include <sys/resource.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace morphbus::tools {

/// How a finding is to be taken: kWarning harms some runs, kBroken stops all that need the thing.
enum class Health { kGood, kWarning, kBroken };

/// What one check found.
struct Finding {
  /// The thing looked at, e.g. "buffer"; a word, unique among the findings.
  std::string name;
  Health health = Health::kGood;
  /// What was found, in one sentence for people.
  std::string text;
  /// The shell command that mends it; empty if nothing needs mending.
  std::string mend;
  /// The figures in `text`, by name, for scripts.
  std::vector<std::pair<std::string, double>> figures;
};

/// The robot by which "enough" is measured: 60 modules, of which each sends two messages a tick, on
/// a logger that stands still for the 16 ticks that a run can be ahead of it.
inline constexpr int kDoctorModules = 60;
/// Messages that a receive buffer must keep for that robot.
inline constexpr int kNeededMessages = 16 * (2 * kDoctorModules + 10);

/// What became of a burst to a receiver that did not read meanwhile.
struct Burst {
  std::string error;  ///< Why nothing was tried; empty if it was.
  int sent = 0;
  int kept = 0;
  int asked_bytes = 0;
  int got_bytes = 0;  ///< Of the receive buffer; the kernel's own doubling is taken out.
};

/// Whether a receiver that stands still keeps what a large robot sends meanwhile: `buffer`. Where
/// the kernel gave less than was asked for, its limit is raised, and else the URL asks for more.
Finding JudgeBuffer(const Burst& burst);

/// Whether the kernel takes the largest filter of a process: `filter`. `limit_bytes`: what it gives
/// a socket for such things (net.core.optmem_max; 0 if it is not known); `taken`: whether it took
/// one of so many instructions.
Finding JudgeFilter(int64_t limit_bytes, int instructions, bool taken);

/// Whether runs have the hashes here that they have elsewhere: `arithmetic`, with this machine's
/// fingerprint (sim/arithmetic.h). There is no command that mends it.
Finding JudgeArithmetic(const std::string& fingerprint);

/// Whether the limit of open files is enough for a robot of 100 modules: `files`. A process may
/// raise its own limit up to the hard one, and only root that.
Finding JudgeFiles(const rlimit& limit);

/// The same of the number of the user's processes: `processes`.
Finding JudgeProcesses(const rlimit& limit);

/// Whether others' clocks set the wall clock: `clock`.
Finding JudgeClock(bool synchronized);

/// Whether a process that sleeps is woken in time: `timer`. `late_ms` holds how late, in
/// milliseconds, it was each time; not empty, in any order.
Finding JudgeTimer(std::vector<double> late_ms);

}  // namespace morphbus::tools
