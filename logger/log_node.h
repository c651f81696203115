#pragma once
// The logger process: `morphbus log`.

#include <string>

namespace morphbus::logger {

struct LogOptions {
  std::string description_path;  ///< A serialized RunDescription, as the launcher writes it.
  std::string log_path;
  std::string lcm_url;           ///< Empty: $LCM_DEFAULT_URL, else the default.
  bool realtime = false;         ///< Else as the description's mode says.
  double loss = 0.0;             ///< Fraction of datagrams thrown away on purpose.
  unsigned long long loss_seed = 0;
  bool quiet = false;            ///< No summary line on stderr.
};

/// Records a run until it ends or SIGINT or SIGTERM comes; an interrupted log still gets its END, which
/// says so. Returns the exit status: 0 complete, 2 unusable options, 3 the run or the disk failed; the
/// reason, and where the log is, go to stderr.
int RunLogNode(const LogOptions& options);

}  // namespace morphbus::logger
