#pragma once
// Comparison of two runs, called A and B, by role and label, along sim time: are they the same
// walk? docs/log.md defines every quantity. Differences are in SI units, times are sim time in µs.

#include <cstdint>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "logger/compare/alignment.h"
#include "logger/compare/command_pairs.h"
#include "logger/compare/gait.h"
#include "logger/compare/kinematic_tracks.h"
#include "logger/compare/matcher.h"
#include "logger/compare/quantities.h"
#include "logger/compare/setting_pairs.h"
#include "logger/compare/tolerances.h"
#include "logger/log/run_log.h"

namespace morphbus::logger {

/// What of two runs is compared: every instant, or the figures of their gaits (gait.h).
enum class Level { kSample, kGait };

/// How two logs are to be compared.
struct CompareOptions {
  Level level = Level::kSample;
  Align align = Align::kTick;
  /// Tolerances that are not the defaults of this way of comparing; of those that fit, the last
  /// counts.
  std::vector<ToleranceEntry> tolerances;
  /// Those of kQuantityGroups that are not compared; other words are ignored.
  std::set<std::string> without;
  /// A serialized description for files that hold none whole (RunLogOptions::description); read by
  /// CompareFiles alone.
  std::string description = {};
};

/// What a comparison comes to. kEquivalent demands that everything was there and nothing differs;
/// kDifferent that something does; kUnusable is the rest: nothing differs, but something was
/// missing.
enum class Verdict { kEquivalent, kDifferent, kUnusable };

/// How one thing differs: one quantity of one joint, link or module of both runs, over all
/// instants. A PairComparer makes it and a Meter fills in the figures.
struct Item {
  Quantity quantity = Quantity::kRole;
  /// Role of both modules, empty if they have none; "(root body)" for where the robot went, "(run)"
  /// for the run itself.
  std::string role;
  /// Label or name of the joint or link; empty for the module's root link or the module as a whole.
  std::string label;
  /// Names of the modules in A and in B; one is empty if only the other run has somebody for the
  /// role.
  std::string module_a;
  std::string module_b;
  /// Of max, rms, tolerance and first_over: "m", "rad", "m/s", "rad/s", "s" or "share" (0…1); empty
  /// for a count.
  std::string unit;
  /// Instants at which both runs have it, and at which it was compared.
  int64_t samples = 0;
  /// Instants at which both should have it, and one or none has.
  int64_t missing = 0;
  /// The largest difference.
  double max = 0.0;
  /// Root of the mean square of the differences at all samples.
  double rms = 0.0;
  /// The largest difference that counts as the same.
  double tolerance = 0.0;
  /// Sim time of the largest difference, µs.
  int64_t max_time_us = 0;
  /// Sim time (µs) of the first difference beyond the tolerance; -1 if there is none.
  int64_t first_over_us = -1;
  /// The difference at that time.
  double first_over = 0.0;
  /// More, for people, e.g. "mode 1 against 0"; mostly empty.
  std::string detail;
};

/// A call in a program.
struct SourceLine {
  /// The program's source file, as the run or the program's image names it.
  std::string file;
  /// From 1.
  int line = 0;
  /// The function, e.g. "LegLowerHalf.move_foot".
  std::string function;
};

/// What one run says of the message that differs.
struct TracedMessage {
  /// The channel, and the tick in this run; empty and -1 if this run has no such message.
  std::string channel;
  int64_t tick = -1;
  /// The call that asked for the command; none for messages that no program sends, and where the
  /// module could not be run again.
  std::optional<SourceLine> line;
  /// Why there is no line where one was looked for; else empty.
  std::string why_not;
};

/// Where two runs part.
struct Trace {
  /// Index into Comparison::items of the quantity whose message differs first.
  size_t item = 0;
  TracedMessage a, b;
};

/// What Compare() found.
struct Comparison {
  /// Of the logs that were compared.
  LogFacts a, b;
  Verdict verdict = Verdict::kUnusable;
  /// One sentence that says why the verdict is what it is.
  std::string reason;
  /// Modules that only one run has, then the matched pairs in order of role, each with its links,
  /// joints and connectors, then the root body, then the run's length.
  std::vector<Item> items;
  /// Index of the item that is first beyond its tolerance, of several at one time the one that is
  /// beyond it by most; none if nothing is.
  std::optional<size_t> first;
  /// The message from which the divergence comes; none if nothing differs, or at the gait level.
  std::optional<Trace> trace;
  /// Largest difference of all items in metres.
  double max_position_m = 0.0;
  /// Largest difference of all items in radians.
  double max_rotation_rad = 0.0;
  /// Sim time (µs) up to which was compared: the end of the shorter log, or the first damage.
  int64_t compared_until_us = 0;
  /// Parameters and attributes in which the runs differ.
  std::vector<SettingPair> settings;
  /// Damage, losses, and what was left out: what a reader must know besides.
  std::vector<std::string> notes;
  /// What should have been compared and could not be; with an entry the verdict is never
  /// kEquivalent. Of missing instants at most some 50 entries are listed.
  std::vector<std::string> not_compared;
  /// The commands that people gave to either run. They say nothing for or against the verdict: that
  /// a run was pushed shows in where it went. A note says where they differ.
  std::vector<CommandPair> commands;
  /// Who was compared with whom.
  Matching matching;
  Level level = Level::kSample;
  /// How B's times were brought onto A's; all times of a comparison are A's.
  Alignment alignment;
  /// At the gait level: the figures of both runs.
  std::optional<RunFigures> figures_a, figures_b;
  /// B on A's time line, where that is not B as it is; null else.
  std::shared_ptr<const RunLog> aligned_b;
};

/// Whether equal commands of both runs must have been given at equal ticks: not where ticks mean
/// nothing, that is if the runs are aligned by something else or only their gaits are compared.
bool CommandsByTicks(const Comparison& comparison);

/// Compares two logs that were read with their series. It never fails: what cannot be compared is
/// kUnusable with a reason. Damaged logs are compared up to the first damage. They are never
/// kEquivalent, nor are logs that lack something, or whose END says that the run did not end as it
/// should: a difference found is still kDifferent, none found is kUnusable.
Comparison Compare(const RunLog& a, const RunLog& b, const CompareOptions& options = {});

/// The same for two files. Tick by tick they are read side by side, a stretch at a time, so that
/// memory does not grow with their length; by event, by lag and at the gait level both are in
/// memory. Fails if a file cannot be read or holds no run.
Result<Comparison> CompareFiles(const std::string& path_a, const std::string& path_b,
                                const CompareOptions& options = {});

/// Largest differences of one role, over all its modules, joints and links.
struct RoleFigures {
  /// The modules of A and B that play it; one is empty if only the other run has somebody for it.
  std::vector<std::pair<std::string, std::string>> modules;
  /// By quantity: the item with the largest difference, its RMS, samples and first time beyond the
  /// tolerance taken over all items of that quantity.
  std::map<Quantity, Item> worst;
  /// Over all quantities in metres and in radians, whatever they measure.
  double max_position_m = 0.0;
  double max_rotation_rad = 0.0;
  /// Sim time (µs) of the first difference beyond a tolerance; -1 if there is none.
  int64_t first_over_us = -1;
};
/// Sums the items of each role, by its name.
std::map<std::string, RoleFigures> FiguresByRole(const Comparison& comparison);

/// A role as people read it: "(no role)" for the empty name.
std::string RoleName(const std::string& role);

/// The word for a verdict, in text and JSON: "equivalent", "different" or "unusable".
const char* VerdictName(Verdict verdict);
/// The unit in which people read values of one of Item's units: millimetres and degrees.
struct DisplayUnit {
  /// "mm", "deg", "mm/s", "deg/s", "N m", "N", "s", "%" or empty.
  const char* name;
  /// By what an SI value is multiplied.
  double scale;
};
/// The display unit of an Item::unit; without name and with scale 1 for a count or an unknown unit.
DisplayUnit DisplayUnitOf(const std::string& unit);
/// A value in SI units, for people: in its display unit, with three decimals; a count has none. A
/// value that these would hide is "<0.001", unless it is less than the rounding of the arithmetic.
std::string NumberText(double value, const std::string& unit);
/// The same with the name of the unit: "828.205 mm".
std::string ValueText(double value, const std::string& unit);

/// Text for a terminal, many lines: verdict, logs, notes, first divergence, and a table: a line for
/// each quantity with the role that differs most in it, or for each quantity of each role if `all`.
std::string ComparisonText(const Comparison& comparison, bool all);
/// The object of `compare --json`: times in seconds, all else in SI units; keys in docs/log.md.
nlohmann::json ComparisonJson(const Comparison& comparison);

}  // namespace morphbus::logger
