#pragma once
// Comparisons of two runs by role and label: are they the same walk? docs/log.md says how.
//
// Library morphbus-compare. Its function may be called from any number of threads at once. Values
// are in SI units, times in seconds of sim time of the first run.

#include <morphbus/export.h>
#include <morphbus/observe/log.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace morphbus {

/// By what the times of two runs are matched: sim time itself, events such as a role that is taken,
/// or one shift for the whole run.
enum class Alignment { kTick, kEvent, kLag };

/// How two runs are compared: the options of `morphbus compare`.
struct CompareOptions {
  Alignment alignment = Alignment::kTick;
  /// Compare the figures of their gaits, and not every instant.
  bool gait = false;
  /// Tolerances by their names in docs/log.md, with values as text: {"angle_rad", "0.5deg"}.
  std::vector<std::pair<std::string, std::string>> tolerances = {};
};

/// Equivalent: all was there and nothing differs. Different: something does. Unusable: nothing
/// differs, but something was missing.
enum class Verdict { kEquivalent, kDifferent, kUnusable };

/// How one quantity of one joint, link or module differs, over all instants.
struct ComparedItem {
  /// Such as "angle" or "position (simulated)".
  std::string quantity;
  /// The role of both modules; empty if they have none.
  std::string role;
  /// The label or name of the joint or link; empty for the module as a whole.
  std::string label;
  /// The modules of the first run and of the second; one is empty if only the other has one.
  std::string module_a;
  std::string module_b;
  /// Of the values below: "m", "rad", "m/s", "rad/s", "s" or "share"; empty for a count.
  std::string unit;
  /// At how many instants it was compared.
  int64_t samples = 0;
  /// The largest difference, the root of its mean square, and the largest that counts as the same.
  double max = 0;
  double rms = 0;
  double tolerance = 0;
  /// When it was largest, and when it was beyond the tolerance first; below 0 if it never was.
  double max_time_s = 0;
  double first_over_s = -1;

  [[nodiscard]] bool Differs() const { return first_over_s >= 0; }
};

/// What a comparison comes to.
struct Comparison {
  Verdict verdict = Verdict::kUnusable;
  /// One sentence that says why.
  std::string reason;
  std::vector<ComparedItem> items;
  /// The place in `items` of what differs first; -1 if nothing does.
  int first = -1;
  /// What a reader must know besides: damage, losses, what was left out.
  std::vector<std::string> notes;
  /// As `morphbus compare` prints it, and all of it as JSON (docs/log.md).
  std::string text;
  std::string json;
};

/// Compares two runs. Throws Failure for a tolerance that there is not.
MORPHBUS_EXPORT Comparison CompareLogs(const Log& a, const Log& b,
                                       const CompareOptions& options = {});

}  // namespace morphbus
