#include "test/bridge/forger.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <morphbus/admit_t.hpp>
#include <morphbus/health_t.hpp>
#include <morphbus/hello_t.hpp>
#include <morphbus/info_part_t.hpp>
#include <morphbus/leave_t.hpp>
#include <morphbus/progress_t.hpp>
#include <morphbus/resend_t.hpp>
#include <morphbus/sensors_t.hpp>
#include <morphbus/sim_clock_t.hpp>
#include <morphbus/status_t.hpp>
#include <morphbus/totals_t.hpp>
#include <morphbus/transform_t.hpp>
#include <morphbus/verdict_t.hpp>
#include <morphbus/world_t.hpp>

#include "bridge/wire/channels.h"

namespace morphbus::bridge {
namespace {

void Append(std::vector<uint8_t>* out, const void* data, size_t size) {
  const auto* bytes = static_cast<const uint8_t*>(data);
  out->insert(out->end(), bytes, bytes + size);
}

/// Adds the refusals of one process.
void AddRefusals(const Ledger& one, Ledger* sum) {
  sum->unauthentic += one.unauthentic;
  sum->bad += one.bad;
  sum->conflicts += one.conflicts;
  sum->outside_window += one.outside_window;
  sum->resent += one.resent;
}

/// Puts the message elsewhere in the run: a little later or earlier, or far from it.
template <class M>
void Displace(std::mt19937_64* random, M* message) {
  const std::vector<int64_t> steps = {1, 1, 1, 2, 3, 5, 15, 16, 17, 20, 100, -1, -2, -16};
  int64_t step = steps[(*random)() % steps.size()];
  if ((*random)() % 20 == 0) step = int64_t{1} << 62;
  // The time that belongs to the tick, or the greatest that there is.
  const int64_t later_us = step > (int64_t{1} << 40)
                               ? std::numeric_limits<int64_t>::max() - message->header.sim_time_us
                               : 20000 * step;
  message->header.tick = std::max<int64_t>(0, message->header.tick + step);
  message->header.sequence = std::max<int64_t>(0, message->header.sequence + step);
  message->header.sim_time_us = std::max<int64_t>(0, message->header.sim_time_us + later_us);
}

/// Changes what the message says. One overload for each type that a run carries.
void Change(std::mt19937_64* random, morphbus::actuator_t* m) {
  m->joints[(*random)() % m->joints.size()].target_si += 0.25;
}
void Change(std::mt19937_64*, morphbus::transform_t* m) { m->root_sequence ^= 5; }
void Change(std::mt19937_64*, morphbus::status_t* m) { m->role_name = "Forged"; }
void Change(std::mt19937_64* random, morphbus::sensors_t* m) {
  morphbus::module_sensors_t& reading = m->modules[(*random)() % m->modules.size()];
  switch ((*random)() % 4) {
    case 0:
      reading.docked.clear();
      reading.num_docked = 0;
      return;
    case 1:
      reading.name = "m9";
      return;
    default:
      reading.joint_position_si[0] += 0.25;
  }
}
void Change(std::mt19937_64*, morphbus::world_t* m) {
  if (!m->bodies.empty()) m->bodies[0].position_m[0] += 1;
}
void Change(std::mt19937_64* random, morphbus::sim_clock_t* m) {
  switch ((*random)() % 4) {
    case 0:
      m->phase = morphbus::sim_clock_t::PHASE_END;
      m->end_reason = "forged";
      return;
    case 1:
      m->phase = morphbus::sim_clock_t::PHASE_START;
      return;
    case 2:
      m->num_modules = 77;
      return;
    default:
      m->controls = {"forged"};
      m->num_controls = 1;
  }
}
void Change(std::mt19937_64* random, morphbus::hello_t* m) {
  switch ((*random)() % 3) {
    case 0:
      m->claim ^= 5;
      return;
    case 1:
      m->process = "m77";
      return;
    default:
      m->wire_hash ^= 5;
  }
}
void Change(std::mt19937_64* random, morphbus::health_t* m) {
  if ((*random)() % 4 == 0) m->process = "m77";
  m->conflicts += 5;
  for (morphbus::topic_total_t& total : m->totals) {
    (*random)() % 2 == 0 ? total.chained_hash ^= 5 : total.count += 1;
  }
}
void Change(std::mt19937_64*, morphbus::info_part_t* m) { m->part = m->num_parts - 1; }
void Change(std::mt19937_64* random, morphbus::resend_t* m) {
  if ((*random)() % 2 == 0) m->sender = m->sender == "m1" ? "m2" : "m1";
  m->last_sequence = int64_t{1} << 62;
}
void Change(std::mt19937_64* random, morphbus::progress_t* m) {
  m->complete_tick += static_cast<int64_t>((*random)() % 20);
  m->verdict_heard = (*random)() % 2 == 0;
}
void Change(std::mt19937_64* random, morphbus::totals_t* m) {
  switch ((*random)() % 4) {
    case 0:
      m->last_tick += static_cast<int64_t>((*random)() % 20);
      return;
    case 1:
      m->num_parts = static_cast<int16_t>(m->num_parts + 1);
      return;
    case 2:
      m->process = m->process == "m1" ? "m2" : "m1";
      return;
    default:
      if (!m->totals.empty()) m->totals[(*random)() % m->totals.size()].chained_hash ^= 5;
  }
}
void Change(std::mt19937_64*, morphbus::verdict_t* m) {
  m->error = m->error.empty() ? "forged" : "";
}
void Change(std::mt19937_64*, morphbus::leave_t* m) { m->process = m->process == "m1" ? "" : "m1"; }
void Change(std::mt19937_64*, morphbus::admit_t* m) { ++m->last_tick; }

/// Alters a message of any type: `alter` is called with it, decoded.
template <class Alter>
Spoken AlteredBy(const Spoken& original, const Alter& alter) {
  const auto as = [&]<class M>(M* /*type*/) { return Altered<M>(original, alter); };
  switch (ParseChannel(original.channel)->topic) {
    case Topic::kClock:
      return as(static_cast<morphbus::sim_clock_t*>(nullptr));
    case Topic::kSensors:
      return as(static_cast<morphbus::sensors_t*>(nullptr));
    case Topic::kWorld:
      return as(static_cast<morphbus::world_t*>(nullptr));
    case Topic::kTransform:
      return as(static_cast<morphbus::transform_t*>(nullptr));
    case Topic::kActuator:
      return as(static_cast<morphbus::actuator_t*>(nullptr));
    case Topic::kStatus:
      return as(static_cast<morphbus::status_t*>(nullptr));
    case Topic::kHello:
      return as(static_cast<morphbus::hello_t*>(nullptr));
    case Topic::kHealth:
      return as(static_cast<morphbus::health_t*>(nullptr));
    case Topic::kInfo:
      return as(static_cast<morphbus::info_part_t*>(nullptr));
    case Topic::kProgress:
      return as(static_cast<morphbus::progress_t*>(nullptr));
    case Topic::kTotals:
      return as(static_cast<morphbus::totals_t*>(nullptr));
    case Topic::kVerdict:
      return as(static_cast<morphbus::verdict_t*>(nullptr));
    case Topic::kLeave:
      return as(static_cast<morphbus::leave_t*>(nullptr));
    case Topic::kAdmit:
      return as(static_cast<morphbus::admit_t*>(nullptr));
    default:
      return as(static_cast<morphbus::resend_t*>(nullptr));
  }
}

}  // namespace

Outcome OutcomeOf(FakeRun* run) {
  Outcome outcome;
  run->RunUntil([run] {
    const std::vector<Participant*> all = run->participants();
    bool told = run->log != nullptr && run->log->done() && !run->log->error().empty();
    told |= run->sim->done() && !run->sim->outcome().ok;
    for (const FakeRun::Module& m : run->modules) told |= !m.participant->error().empty();
    return told || std::all_of(all.begin(), all.end(), [](Participant* p) { return p->done(); });
  });
  outcome.seconds_to_end = static_cast<double>(run->time.NowUs()) * 1e-6;
  const bool ended = run->Run();
  outcome.sim_ok = ended && run->sim->outcome().ok;
  outcome.log_clean = ended && run->log->complete() && run->log->error().empty();
  outcome.error = outcome.sim_ok ? run->log->error() : run->sim->outcome().error;
  outcome.published = run->sim->outcome().run_hash;
  outcome.recorded = run->log->run_hash();
  // The robot tells where it is, and every program all that it knows.
  std::vector<morphbus::body_pose_t> bodies;
  run->robot.Truth(&bodies);
  for (const morphbus::body_pose_t& body : bodies) {
    Append(&outcome.state, body.position_m, sizeof body.position_m);
  }
  for (const FakeRun::Module& module : run->modules) module.controller->Save(&outcome.state);
  outcome.moves = run->robot.actuations;
  for (const Ledger* ledger : run->ledgers()) AddRefusals(*ledger, &outcome.refused);
  outcome.seconds = static_cast<double>(run->time.NowUs()) * 1e-6;
  return outcome;
}

Forger::Forger(FakeRun* run, std::function<void(int64_t, const Spoken&)> on_message)
    : bus_(run->hub.Connect()) {
  bus_->SubscribePrefix(run->options.run + "/",
                        [this, on_message = std::move(on_message)](
                            std::string_view channel, const uint8_t* data, size_t size) {
                          if (said_.contains(MessageDigest(data, size))) return;
                          on_message(heard_++, {std::string(channel), {data, data + size}});
                        });
}

std::vector<Spoken> Overhear(const FakeRunOptions& options,
                             const std::function<void(FakeRun*)>& prepare) {
  FakeRun run(options);
  if (prepare) prepare(&run);
  std::vector<Spoken> all;
  const Forger ears(&run, [&all](int64_t, const Spoken& message) { all.push_back(message); });
  run.Run();
  return all;
}

Spoken MadeUp(Topic topic, const Spoken& command, std::mt19937_64* random) {
  // A module's command tells where the run is.
  morphbus::actuator_t pattern;
  const bool sound = Decode(command.bytes.data(), command.bytes.size(), {}, &pattern).has_value();
  if (!sound) return command;
  const ChannelName name = *ParseChannel(command.channel);
  const std::string module(name.process);
  const int64_t tick = pattern.header.tick;
  const auto made = [&](auto message) {
    message.header = pattern.header;
    message.header.program_hash = 0;
    message.header.tick = std::max<int64_t>(0, tick + static_cast<int64_t>((*random)() % 3) - 1);
    message.header.sequence = static_cast<int64_t>((*random)() % 1000);
    Spoken spoken{Channel(name.run, module, topic), {}};
    Encode(message, &spoken.bytes);
    return spoken;
  };
  const int64_t said = tick + static_cast<int64_t>((*random)() % 20) - 1;
  switch (topic) {
    case Topic::kProgress:
      return made(morphbus::progress_t{{}, said, (*random)() % 2 == 0});
    case Topic::kTotals:
      return made(morphbus::totals_t{{}, module, said, 0, 1, 0, 0, {}});
    case Topic::kVerdict:
      return made(morphbus::verdict_t());
    case Topic::kLeave:
      return made(morphbus::leave_t{{}, (*random)() % 2 == 0 ? module : ""});
    case Topic::kAdmit:
      return made(morphbus::admit_t{{}, module, 0, said, 0, 0});
    default: {
      const int64_t first = tick + static_cast<int64_t>((*random)() % 3);
      const int64_t last = (*random)() % 4 == 0 ? int64_t{1} << 62 : first;
      return made(morphbus::resend_t{{}, "SIM", command.channel, first, last});
    }
  }
}

Spoken Displaced(const Spoken& original, int64_t ticks) {
  return AlteredBy(original, [ticks](auto* message) {
    message->header.tick = std::max<int64_t>(0, message->header.tick + ticks);
    message->header.sequence = std::max<int64_t>(0, message->header.sequence + ticks);
    message->header.sim_time_us = std::max<int64_t>(0, message->header.sim_time_us + 20000 * ticks);
  });
}

Spoken AlteredContent(const Spoken& original, std::mt19937_64* random) {
  return AlteredBy(original, [random](auto* message) { Change(random, message); });
}

Spoken AlteredAnyhow(const Spoken& original, std::mt19937_64* random) {
  return AlteredBy(original, [random](auto* message) {
    const uint64_t what = (*random)() % 3;
    if (what != 0) Change(random, message);
    if (what != 1) Displace(random, message);
  });
}

}  // namespace morphbus::bridge
