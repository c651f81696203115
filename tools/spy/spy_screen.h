#pragma once
// The spy on a terminal: hears the bus, draws, obeys keys, until it is told to end.

#include <functional>
#include <string>

#include "bridge/bus/lcm_tap.h"
#include "compiler/base/result.h"
#include "tools/machine/run_choice.h"
#include "tools/spy/spy_table.h"

namespace morphbus::tools {

/// What the screen begins with.
struct SpyScreenOptions {
  RunChoice run;            ///< Which run the keys for pause, step and speed command.
  std::string url;          ///< The bus that `tap` hears.
  double interval_s = 1.0;  ///< Between two looks at the figures.
  double seconds = 0.0;     ///< Ends after so many; 0: when the user says so.
  /// The page of the first channel that passes is opened as soon as it is heard; null opens none.
  std::function<bool(const std::string&)> open;
};

/// Shows the screen until the user quits, a signal comes (CatchSignals), or the time is over. Fails
/// if the terminal cannot show one; then nothing has been heard.
Result<void> ShowSpyScreen(bridge::LcmTap* tap, SpyTable* table, const SpyScreenOptions& options);

/// Now, on the clock of arrivals: nanoseconds since 1970.
int64_t ArrivalClockNs();
/// A snapshot of the table now, with what the listener itself missed.
SpySnapshot SnapshotNow(const SpyTable& table, const bridge::LcmTap& tap);

}  // namespace morphbus::tools
