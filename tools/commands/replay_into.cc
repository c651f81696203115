#include "tools/commands/replay_into.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <vector>

#include "compiler/base/text.h"
#include "logger/compare/module_rerun.h"
#include "tools/base/lent_description.h"
#include "tools/base/print.h"
#include "tools/base/work_progress.h"
#include "tools/commands/commands.h"
#include "tools/convert/break_trace.h"
#include "tools/convert/rerun_report.h"
#include "tools/convert/step_trace.h"
#include "tools/spy/lcm_sources.h"

namespace morphbus::tools {
namespace {

/// The module's index by name; nothing, after saying which there are.
std::optional<int> ModuleToRun(const logger::RunLog& log, const std::string& name) {
  const std::vector<std::string> names = NamesOf(log.modules);
  const auto found = std::ranges::find(names, name);
  if (found != names.end()) return static_cast<int>(found - names.begin());
  return Refuse(fmt::format("--into {}{}: expected a module of the run, {}", name,
                            DidYouMean(name, names), fmt::join(names, ", ")));
}

/// What was found, for people.
void PrintFindings(const ReplayInto& options, const logger::RerunSummary& done, const Json& known,
                   const RerunDifferences& differences, const logger::RunLog& log) {
  if (!known.is_null()) PrintText(KnownText(known));
  const double tick_s = log.facts.tick_us * 1e-6;
  Print("{}: {} run again, {:.2f} to {:.2f} s; {} compared: ", options.module,
        Counted(done.ticks, "tick"), static_cast<double>(done.first_tick) * tick_s,
        static_cast<double>(done.last_tick) * tick_s, Counted(done.messages, "message"));
  if (differences.count() == 0) {
    Print("the same to the bit\n");
    return;
  }
  const Json& first = differences.first();
  Print("{} different\nfirst at tick {} ({:.2f} s), {}, {}: {} in the log, {} now\n",
        differences.count() == 1 ? "1 is" : fmt::format("{} are", differences.count()),
        first["tick"].get<int64_t>(), first["seconds"].get<double>(),
        first["topic"].get<std::string>(), first["field"].get<std::string>(),
        first["logged"].get<std::string>(), first["again"].get<std::string>());
}

/// What was found, for scripts.
Json FindingsJson(const std::string& module, const logger::RerunSummary& done,
                  const RerunDifferences& differences) {
  return {{"module", module},
          {"same", differences.count() == 0},
          {"ticks", done.ticks},
          {"first_tick", done.first_tick},
          {"last_tick", done.last_tick},
          {"messages", done.messages},
          {"different", differences.count()},
          {"first", differences.first()},
          {"skipped", done.skipped},
          {"unheard", done.unheard}};
}

/// What may be the cause of a difference besides the module.
void WarnOfGaps(const logger::RerunSummary& done, const logger::RunLog& log) {
  if (log.facts.mode == "realtime") {
    Warn(
        "in real time a log does not tell which messages had come by the end of a tick: "
        "differences may come from that");
  }
  // A neighbour's message that the log lacks may have reached the module, which then knew more than
  // it does now.
  if (done.unheard > 0) {
    Warn(fmt::format("the log lacks {} of neighbours", Counted(done.unheard, "message")));
  }
  if (done.skipped > 0) {
    Warn(fmt::format("the log lacks what the module said in {}", Counted(done.skipped, "tick")));
  }
}

}  // namespace

int RunAgain(const ReplayInto& options) {
  const WorkProgress progress;
  if (options.at_s && !(*options.at_s >= 0 && std::isfinite(*options.at_s))) {
    return Unusable(fmt::format("--at {}: expected a sim time, 0 or more seconds", *options.at_s));
  }
  if (!options.steps.empty() && options.steps != "lines" && options.steps != "instructions") {
    return Unusable("--steps " + options.steps + ": expected lines or instructions");
  }
  // The module of the log, and the types of its messages.
  const Result<logger::RunLog> log =
      LoadLog(options.log, {.run = "", .series = false}, options.description);
  if (!log) return Unusable(log.error().message);
  const std::optional<int> module = ModuleToRun(*log, options.module);
  if (!module) return kUnusable;
  const Result<LcmSchema> schema = LcmSchema::Parse(LcmSources());
  if (!schema) return Unusable(schema.error().message);
  // What is collected while it runs: what differs, what it knew, and what its tasks did.
  RerunDifferences differences(*schema);
  std::optional<int64_t> next_steps_us;  // When, after the tick asked for, a task runs next.
  StepTrace trace(options.steps == "lines" ? StepTrace::By::kLine : StepTrace::By::kInstruction);
  Json known;
  logger::RerunVisitors visitors;
  visitors.message = [&](const logger::MessageAgain& message) { differences.Take(message); };
  // The tick in which the time asked for lies; the first one if that is earlier.
  const auto is_asked_for = [&](const vm::TickInput& input) {
    // A tick's time is that of its beginning; the time asked for lies in it if it ends later than
    // that.
    const double end_s = static_cast<double>(input.sim_time_us + log->facts.tick_us) * 1e-6;
    return options.at_s && known.is_null() && end_s > *options.at_s;
  };
  visitors.tick = [&](const logger::ComputedTick& tick) {
    if (is_asked_for(tick.input)) known = KnownAfter(tick);
  };
  if (!options.steps.empty()) {
    visitors.step = [&](const logger::ComputedStep& step) {
      // Steps come before their tick, so that `known` is still empty during those of the tick asked
      // for, and set for all later ones.
      if (is_asked_for(step.input)) trace.Take(step);
      if (!known.is_null() && !next_steps_us) next_steps_us = step.input.sim_time_us;
    };
  }
  // Without --break it stays empty, and its text too.
  BreakTrace breaks(options.break_at, options.from_s,
                    options.to_s.value_or(std::numeric_limits<double>::infinity()));
  if (options.break_at.line > 0) {
    // Takes the place of the visitor above: --break does not go with --at, without which there are
    // no steps.
    visitors.step = [&](const logger::ComputedStep& step) { breaks.Take(step); };
  }
  // Without the module's image the log gives no answer.
  const Result<logger::RerunSummary> done = logger::RerunModule(*log, *module, visitors);
  if (!done) return Unusable(options.log + ": " + done.error().message);
  if (done->ticks == 0) {
    return Unusable(
        fmt::format("{}: holds no tick with what {} sensed and said", options.log, options.module));
  }
  // Every tick up to the last one was run, and none was the one asked for.
  if (options.at_s && known.is_null()) {
    return Unusable(fmt::format("--at {}: the last tick of {} begins at {:.2f} s", *options.at_s,
                                options.module,
                                static_cast<double>(done->last_tick * log->facts.tick_us) * 1e-6));
  }
  // What the log lacks may be why something differs.
  WarnOfGaps(*done, *log);
  if (options.break_at.line > 0 && breaks.moments().empty()) {
    const vm::SourcePlace& at = options.break_at;
    Warn(fmt::format("no task of {} came to line {}{}", options.module, at.line,
                     at.file.empty() ? "" : " of " + at.file));
  }
  // Parts that were not asked for have no keys.
  if (options.json) {
    Json json = FindingsJson(options.module, *done, differences);
    if (options.at_s) json["at"] = known;
    if (options.break_at.line > 0) {
      json["breaks"] = breaks.moments();
      json["breaks_dropped"] = breaks.dropped();
    }
    if (!options.steps.empty()) {
      json["steps"] = trace.steps();
      json["steps_dropped"] = trace.dropped();
      json["next_steps_at"] = nullptr;
      if (next_steps_us) json["next_steps_at"] = static_cast<double>(*next_steps_us) * 1e-6;
    }
    PrintJson(json);
  } else {
    PrintText(BreaksText(breaks.moments(), breaks.dropped()));
    if (!options.steps.empty()) {
      Print("steps of tick {}\n{}", known["tick"].get<int64_t>(),
            StepsText(trace.steps(), trace.dropped()));
      if (next_steps_us) {
        Print("  the next steps are at {:.2f} s\n", static_cast<double>(*next_steps_us) * 1e-6);
      }
      // The state that follows is that after the steps: "after tick 125 ...".
      Print("after ");
    }
    PrintFindings(options, *done, known, differences, *log);
  }
  // A difference is the answer no, whatever else was asked for.
  return differences.count() == 0 ? kDone : kNo;
}

}  // namespace morphbus::tools
