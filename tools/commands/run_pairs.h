#pragma once
// Who answers to whom in two runs that the monitor shows beside each other: as `morphbus compare`
// matches them, by logger::Match.

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "bridge/outward/monitor.pb.h"
#include "bridge/outward/session_hub.h"
#include "logger/log/run_log.h"
#include "tools/machine/wall_clock.h"
#include "tools/monitor/monitor_source.h"

namespace morphbus::tools {

/// The matching of two runs up to the end of the shorter one, for viewers. Both logs must have a
/// model; outlines will do.
morphbus::Pairs PairsOf(const logger::RunLog& a, const logger::RunLog& b);

/// Tells clients who answers to whom in the first two sources, anew whenever that may have changed.
class PairTeller {
 public:
  /// `sources` and `hub` outlive it; `channel` is the index of the topic in the catalogue. With
  /// fewer than two sources there is nothing to tell.
  PairTeller(std::vector<MonitorSource*> sources, bridge::SessionHub* hub, size_t channel);
  /// Looks whether there is something new, now and then.
  void Step();

 private:
  std::vector<MonitorSource*> sources_;
  bridge::SessionHub* hub_;
  size_t channel_;
  WallTimer timer_;
  double next_s_ = 0.0;  ///< When to look next, on `timer_`.
  int64_t told_ = -1;    ///< The versions of both outlines together, as they were told.
  std::array<std::optional<logger::RunLog>, 2> outlines_;
};

}  // namespace morphbus::tools
