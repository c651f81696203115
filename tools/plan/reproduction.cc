#include "tools/plan/reproduction.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "compiler/base/text.h"
#include "compiler/base/version.h"
#include "logger/log/facts_text.h"
#include "sim/arithmetic.h"

namespace morphbus::tools {
namespace {

/// The commands of the log as a script that has every program to deploy.
Result<ControlScript> ScriptOf(const logger::RunLog& log) {
  Result<ControlScript> script = ParseScript(logger::CommandsText(log.facts));
  if (!script) return Fail("the log's commands: " + script.error().message);
  // The files of programs may have changed since: what was deployed is taken from the log.
  for (const ScriptedCommand& scripted : script->commands) {
    if (scripted.command.kind != bridge::ControlKind::kDeploy) continue;
    const uint64_t hash = scripted.command.program_hash;
    const auto image = log.deployed.find(hash);
    if (image == log.deployed.end()) {
      return Fail(fmt::format("the log does not hold {} ({}) whole, which was deployed at tick {}",
                              scripted.command.program, Hex(hash), scripted.tick));
    }
    script->images[hash] = image->second;
  }
  return script;
}

/// The tick after the last one that the log tells of.
int64_t EndOf(const logger::LogFacts& facts) {
  // A log that was cut ends with the last tick that it has.
  return facts.end_tick > 0 ? facts.end_tick : facts.ticks;
}

}  // namespace

Result<RunPlan> PlanAgain(const logger::RunLog& log) {
  const logger::LogFacts& facts = log.facts;
  if (log.description.empty()) {
    return Fail(
        "the log does not hold the run's description, so that nobody knows what ran; "
        "morphbus info says more");
  }
  if (facts.mode == "realtime") {
    return Fail(
        "this was a run in real time: what happened depends on when messages came, which no log "
        "tells; only runs in lockstep repeat");
  }
  if (EndOf(facts) < 1) return Fail("the log holds no tick of the run");
  Result<RunPlan> plan = PlanFromDescription(log.description);
  if (!plan) return plan;
  Result<ControlScript> script = ScriptOf(log);
  if (!script) return tl::unexpected(script.error());
  plan->script = std::move(*script);
  // It ends where the logged one did, and says so in the same words. What a run says that came to
  // its end by itself, or that a command ended, it says again.
  proto::RunDescription& description = plan->description;
  description.set_seconds(static_cast<double>(EndOf(facts)) * description.tick_us() * 1e-6);
  if (!facts.end_reason.starts_with("finished")) description.set_end_reason(facts.end_reason);
  // Name, pace and build are this run's own: they change none of the messages that are compared.
  description.clear_run();
  description.set_speed(0);
  description.set_build(Version());
  description.set_arithmetic(sim::ArithmeticFingerprint());
  return plan;
}

}  // namespace morphbus::tools
