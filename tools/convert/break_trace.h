#pragma once
// Where the tasks of a module that runs again come to a source line.

#include <cstdint>
#include <limits>
#include <string>
#include <utility>

#include "logger/compare/module_rerun.h"
#include "tools/base/json.h"
#include "vm/image/source_places.h"

namespace morphbus::tools {

/// Collects the moments in which a task comes to the first instruction of a line, with what the
/// task and the role hold then.
class BreakTrace {
 public:
  /// @param place   a line of the program's source, from 1; without a file one of its own file
  /// @param from_s  sim time from which on ticks are looked at, seconds
  /// @param to_s    sim time before which they begin
  BreakTrace(vm::SourcePlace place, double from_s, double to_s)
      : place_(std::move(place)), from_s_(from_s), to_s_(to_s) {}

  /// Takes the next moment of the run.
  void Take(const logger::ComputedStep& step);

  /// The moments, of which the first 1,000 are kept: "tick", "seconds", "kind", "routine", "calls",
  /// "fields" (as in docs/cli.md).
  [[nodiscard]] const Json& moments() const { return moments_; }
  /// How many more there were.
  [[nodiscard]] int64_t dropped() const { return dropped_; }

 private:
  const vm::SourcePlace place_;
  const double from_s_, to_s_;
  Json moments_ = Json::array();
  int64_t dropped_ = 0;
  /// The files of the program that ran last, and the line of the place as it counts them.
  uint64_t program_ = 0;
  vm::SourceFiles files_;
  int line_ = 0;
};

/// The moments for people.
std::string BreaksText(const Json& moments, int64_t dropped);

}  // namespace morphbus::tools
