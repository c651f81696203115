#pragma once
// morphbus replay --into: one module of a log, run again.

#include <optional>
#include <string>

#include "vm/image/source_places.h"

namespace morphbus::tools {

/// What of it is asked for.
struct ReplayInto {
  std::string log;
  std::string description;     ///< A file or log that lends one; empty for none.
  std::string module;          ///< By its name.
  std::optional<double> at_s;  ///< Sim time after which the module's state is shown.
  /// "lines" or "instructions": the steps of the tick in which `at_s` lies are shown; empty: none.
  std::string steps;
  /// A source line: whenever a task comes to it in this range of sim time, what it holds is shown;
  /// line 0: none.
  vm::SourcePlace break_at = {};
  double from_s = 0;
  std::optional<double> to_s = {};
  bool json = false;
};

/// Runs the module again on what the log says that it sensed and heard, and compares all that it
/// says. Status 0: the same to the bit; 1: it differs; 2: the log cannot tell.
int RunAgain(const ReplayInto& options);

}  // namespace morphbus::tools
