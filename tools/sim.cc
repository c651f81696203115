// morphbus sim: the simulator of a run, as a process of its own.

#include <fmt/format.h>
#include <unistd.h>
#include <CLI/CLI.hpp>

#include "bridge/bus_adapters.h"
#include "bridge/health.h"
#include "bridge/lcm_bus.h"
#include "tools/commands.h"
#include "tools/control_link.h"
#include "tools/health_sender.h"
#include "tools/run_plan.h"
#include "tools/wall_clock.h"

namespace morphbus::tools {
namespace {

constexpr int64_t kWatchUs = 50000;
constexpr int64_t kJoinUs = 15000000;

struct Options {
  PlanSource plan;
  int control_fd = -1;
  bool no_logger = false;
};

/// What the launcher shows meanwhile.
Json Progress(const bridge::SimParty& party) {
  Json missing = Json::array();
  for (const std::string& process : party.missing_processes()) missing.push_back(process);
  return {{"tick", party.tick()}, {"missing", missing}};
}

int Simulate(const Options& options) {
  const std::optional<RunPlan> plan = LoadPlan(options.plan);
  if (!plan) return kUnusable;
  Result<bridge::SimPartyOptions> party_options = SimOptions(*plan, !options.no_logger);
  if (!party_options) return Unusable(party_options.error().message);
  // The launcher has started everyone: who is not there soon will not come.
  if (options.control_fd >= 0) party_options->timing.join_silence_us = kJoinUs;
  const auto robot = BuildAssembly(*plan);
  if (!robot) return Unusable(robot.error().message);
  const Result<std::unique_ptr<bridge::Bus>> lcm = bridge::OpenLcmBus(options.plan.options.lcm_url);
  if (!lcm) return Unusable(lcm.error().message);
  int64_t discarded = 0;
  bridge::LossyBus bus(lcm->get(), plan->description.loss(),
                       ReceiverSeed(plan->description.seed(), kSimReceiver), &discarded);
  bridge::MonotonicTime time;
  bridge::SimParty party(&bus, robot->get(), &time, *party_options);
  ControlLink link(options.control_fd);
  CatchSignals();
  WallTimer since_first_tick;
  party.OnBeforeTick([&](int64_t tick) {
    if (tick == 1) since_first_tick = WallTimer();  // tick 0 waits for everyone to join
  });
  bool stopping = false;
  Ticker watch(kWatchUs, [&] {
    const std::string reason = stopping ? "" : StopReason(&link);
    if (!reason.empty()) {
      stopping = true;
      party.RequestStop(reason);
    }
    link.Send(Progress(party));
  });
  HealthSender health(&bus, *plan, std::string(bridge::kSimProcess));
  bridge::RunParties(&bus, time, {&party, &watch}, nullptr,
                     [&] { health.Send(party.ledger(), discarded); });
  const bridge::SimOutcome& outcome = party.outcome();
  link.Deliver({{"outcome",
                 {{"ok", outcome.ok},
                  {"error", outcome.error},
                  {"reason", outcome.reason},
                  {"ticks", outcome.ticks},
                  {"hash", outcome.run_hash},
                  {"recorded_hash", outcome.recorded_hash},
                  {"messages", outcome.messages},
                  {"wall_seconds", since_first_tick.seconds()},
                  {"missed_deadlines", outcome.missed_deadlines}}}});
  if (options.control_fd < 0) {
    fmt::print("run {}: {} ticks, hash {}, {}\n", plan->description.run(), outcome.ticks,
               outcome.run_hash, outcome.reason);
  }
  return outcome.ok ? kDone : Failed(outcome.error);
}

}  // namespace

void AddSim(CLI::App& app, Action* action) {
  CLI::App* sub = app.add_subcommand("sim", "The simulator of a run, for starting by hand");
  auto options = std::make_shared<Options>();
  AddPlanSource(sub, &options->plan);
  sub->add_flag("--no-logger", options->no_logger, "Do not wait for a logger");
  sub->add_option("--control-fd", options->control_fd, "The launcher's line")->group("");
  sub->footer(
      "Example (three terminals, or three hosts with udpm ttl=1):\n"
      "  morphbus sim models/mtran.m3l models/programs/quadruped.dyn --robot quadruped --run walk "
      "--seconds 30\n"
      "  morphbus log models/mtran.m3l models/programs/quadruped.dyn --robot quadruped --run walk "
      "--seconds 30 -o walk.log\n"
      "  morphbus module --run walk --module m1 ...");
  sub->callback([options, action] { *action = [options] { return Simulate(*options); }; });
}

}  // namespace morphbus::tools
