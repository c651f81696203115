#pragma once
// From the first divergence of two runs back to where it comes from: the earliest message that
// differs, and if a program sent it, the source line of the call that did.

#include <optional>
#include <string>

#include "logger/compare/comparer.h"
#include "logger/log/run_log.h"

namespace morphbus::logger {

/// Finds the earliest message that differs: of one time that of the cause, since a module commands
/// what it senses. None if nothing differs. To find the call the files of the logs are read once
/// more: the module's program runs again on what it sensed and heard, in the VM that it ran on, and
/// the line counts only if it commands again what the log has.
std::optional<Trace> TraceDivergence(const RunLog& a, const RunLog& b,
                                     const Comparison& comparison);

/// One line for people, such as "quadruped.dyn:143 in LegLowerHalf.move_foot".
std::string SourceLineText(const SourceLine& line);

}  // namespace morphbus::logger
