#pragma once
// The lockstep's machines and what they have sent, for test/bridge/exploration_test.cc: no bytes,
// no bus, no controller; a message is what the machines look at.

#include <algorithm>
#include <array>
#include <cstdint>
#include <morphbus/sim_clock_t.hpp>
#include <string>
#include <vector>

#include "bridge/lockstep/log/log_lockstep.h"
#include "bridge/lockstep/module/module_lockstep.h"
#include "bridge/lockstep/participant.h"
#include "bridge/lockstep/sim/sim_lockstep.h"
#include "test/bridge/explored_message.h"
#include "test/bridge/machine_state.h"
#include "test/bridge/sent_messages.h"

namespace morphbus::bridge {

/// All nodes, and what they have sent.
class World : public SentMessages {
 public:
  explicit World(const Settings& settings)
      : sim(SimConfig(settings)),
        modules{ModuleLockstep({false, Patient()}), ModuleLockstep({false, Patient()})},
        log(LogConfig()),
        settings_(settings) {}

  /// The logger's number among the processes.
  [[nodiscard]] int LogNumber() const { return settings_.modules; }

  void Begin() {
    for (int i = 0; i < settings_.modules; ++i) {
      std::vector<ModuleAction> out;
      modules[Index(i)].Begin(0, 0, &out);
      Take(i, out);
    }
    if (settings_.logger) {
      std::vector<LogAction> out;
      log.Begin(0, &out);
      Take(out);
    }
    std::vector<SimAction> out;
    sim.Begin(0, &out);
    Take(out);
  }

  /// The state of the nodes as a text, in the place of what the text was.
  void PrintNodes(std::string* print) const {
    print->clear();
    MachineState::Print(sim, print);
    AddPrints(print, dead_, log_clean_);
    for (int i = 0; i < settings_.modules; ++i) {
      MachineState::Print(modules[Index(i)], print);
      AddPrint(computed[Index(i)], print);
    }
    if (settings_.logger) MachineState::Print(log, print);
  }

  /// The state of nodes and network.
  void Print(std::string* print) const {
    PrintNodes(print);
    AddFingerprint(print);
  }

  /// Everything was computed and is in the log, whose END may say `clean`.
  [[nodiscard]] bool EndedWell() const {
    return sim.ok() && EveryoneFinished() && (!settings_.logger || log_clean_);
  }

  /// The run ended as it must after a death: by name, and no END says `clean`.
  [[nodiscard]] bool EndedWithoutTheDead() const {
    if (dead_ < 0 || !sim.done()) return false;
    if (settings_.logger && (!log.verdict_heard() || log_clean_)) return false;
    // It may have acknowledged END and died before the logger had what it said last; then the
    // hashes differ, which is beyond the machines.
    return sim.silent() == std::vector<int>{dead_} || (settings_.logger && sim.silent().empty());
  }

  /// The module stops for good; nobody is told.
  void Die(int i) { dead_ = i; }
  [[nodiscard]] bool anyone_dead() const { return dead_ >= 0; }
  /// Logger and sim have waited long enough for what the dead module owes them; the logger is the
  /// less patient.
  void WaitInVain() {
    std::vector<LogAction> log_out;
    if (settings_.logger) log.AcknowledgeEnd(&log_out);
    Take(log_out);
    if (!log_out.empty()) return;
    std::vector<SimAction> out;
    sim.GiveUpOnSilent(now_us_, &out);
    Take(out);
  }

  /// One copy of the message reaches everybody who listens.
  void DeliverToAll(const Message& m) {
    for (int node = -1; node <= LogNumber(); ++node) Deliver(m, node);
  }

  /// Nodes: -1 the sim, then the modules, then the logger.
  void Deliver(const Message& m, int node) {
    if (node >= 0 && node == dead_) return;
    if (node == -1) return DeliverToSim(m);
    if (node == LogNumber()) return settings_.logger ? DeliverToLog(m) : void();
    DeliverToModule(m, node);
  }

  void FireTimer(int node) {
    if (node >= 0 && node == dead_) return;
    if (node == -1) {
      std::vector<SimAction> out;
      sim.OnTime(DueOf(sim.next_deadline_us()), &out);
      Take(out);
    } else if (node == LogNumber()) {
      std::vector<LogAction> out;
      log.OnTime(DueOf(log.next_deadline_us()), &out);
      Take(out);
    } else {
      std::vector<ModuleAction> out;
      ModuleLockstep& module = modules[Index(node)];
      module.OnTime(DueOf(module.next_deadline_us()), &out);
      Take(node, out);
    }
  }

  [[nodiscard]] int64_t NextDeadline() const {
    int64_t next = sim.next_deadline_us();
    for (int i = 0; i < settings_.modules; ++i) {
      next = std::min(next, modules[Index(i)].next_deadline_us());
    }
    return settings_.logger ? std::min(next, log.next_deadline_us()) : next;
  }

  void AdvanceTo(int64_t us) {
    now_us_ = us;
    for (int node = -1; node <= LogNumber(); ++node) {
      if (node == LogNumber() && !settings_.logger) continue;
      FireTimer(node);
    }
  }

  /// The process dies and is resumed from what it saved when it computed its last tick.
  void KillAndResume(int i) {
    modules[Index(i)] = ModuleLockstep({false, Patient()});
    std::vector<ModuleAction> out;
    modules[Index(i)].Begin(computed[Index(i)], now_us_, &out);
    if (LeftBefore(i)) modules[Index(i)].OnLeave(now_us_, &out);
    Take(i, out);
  }

  /// What must hold always; empty, or what does not.
  [[nodiscard]] std::string Violation() const {
    if (!violation_.empty()) return violation_;
    if (sim.done() && !sim.silent().empty() && sim.silent() != std::vector<int>{dead_}) {
      return "the sim blames somebody who is not to blame";
    }
    if (log_clean_ && !EveryoneFinished()) return "END says clean, but not everybody finished";
    for (int i = 0; i < settings_.modules; ++i) {
      if (modules[Index(i)].tick() != computed[Index(i)])
        return "a module's tick is not what it computed";
      if (computed[Index(i)] < std::min(sim.tick(), settings_.TicksOf(i)) && i != dead_)
        return "the sim went on without an answer";
      if (computed[Index(i)] > sim.tick() + 1) return "a module is ahead of the sim";
    }
    if (!settings_.logger) return {};
    if (!sim.ending() && sim.tick() - MachineState::AcknowledgedTick(sim) > settings_.window) {
      return "the sim is more than the window ahead of the logger";
    }
    for (int i = 0; i < settings_.modules; ++i) {
      const int64_t done = computed[Index(i)];
      if (done == settings_.TicksOf(i)) continue;
      // The module keeps the last `window` ticks.
      if (log.complete_tick() + 1 < done - settings_.window)
        return "what the logger lacks is not kept";
    }
    return {};
  }

  SimLockstep sim;
  std::array<ModuleLockstep, kMostModules> modules;
  LogLockstep log;
  std::array<int64_t, kMostModules> computed = {0, 0};

 private:
  [[nodiscard]] bool EveryoneFinished() const {
    bool all = true;
    for (int i = 0; i < settings_.modules; ++i) all &= computed[Index(i)] == settings_.TicksOf(i);
    return all;
  }

  [[nodiscard]] bool LeftBefore(int i) const { return left_ && i == settings_.LostNumber(); }
  static size_t Index(int i) { return static_cast<size_t>(i); }
  int64_t DueOf(int64_t deadline) {
    if (deadline != kNever) now_us_ = std::max(now_us_, deadline);
    return now_us_;
  }

  void DeliverToSim(const Message& m) {
    std::vector<SimAction> out;
    switch (m.kind) {
      case Kind::kHello:
        sim.OnHello(m.process, now_us_, &out);
        break;
      case Kind::kActuator:
        sim.OnActuator(m.process, m.number, now_us_, &out);
        break;
      case Kind::kAck:
        sim.OnLogAck(m.number, now_us_, &out);
        break;
      case Kind::kEndAck:
        sim.OnEndAck(m.process, now_us_, &out);
        break;
      case Kind::kVerdictAck:
        sim.OnVerdictAck(now_us_, &out);
        break;
      case Kind::kAskGap:
        if (m.process == -1) Resend(m);
        break;
      default:
        break;
    }
    Take(out);
  }

  void DeliverToModule(const Message& m, int i) {
    std::vector<ModuleAction> out;
    ModuleLockstep& module = modules[Index(i)];
    const uint16_t mate = static_cast<uint16_t>(1 - i);
    switch (m.kind) {
      case Kind::kClock:
        module.OnClock(m.number, static_cast<int>(m.last), now_us_, &out);
        break;
      case Kind::kSensors: {
        std::vector<uint16_t> mates;
        if (settings_.BothIn(m.number)) mates.push_back(mate);
        module.OnSensors(m.number, 0, 1, true, mates, now_us_, &out);
        break;
      }
      case Kind::kTransform:
        if (m.process != i) module.OnTransform(mate, m.number, m.number, now_us_, &out);
        break;
      case Kind::kAskActuator:
        if (m.process == i) module.OnAsked(m.number, now_us_);
        if (m.process == i && m.number < computed[Index(i)]) Send({Kind::kActuator, i, m.number});
        break;
      case Kind::kAskTransform:
        if (m.process == i && m.number < computed[Index(i)]) Send({Kind::kTransform, i, m.number});
        break;
      case Kind::kAskGap:
        if (m.process == i) Resend(m);
        break;
      case Kind::kProgress:
        module.OnProgress(m.number, now_us_, &out);
        break;
      case Kind::kLeaveAll:
        module.OnLeaveAll(&out);
        break;
      case Kind::kLeave:
        if (m.process != i) break;
        if (computed[Index(i)] != settings_.lose_tick) violation_ = "a module leaves too early";
        left_ = true;
        module.OnLeave(now_us_, &out);
        break;
      default:
        break;
    }
    Take(i, out);
  }

  void DeliverToLog(const Message& m) {
    std::vector<LogAction> out;
    switch (m.kind) {
      case Kind::kClock:
        HearClock(m, &out);
        break;
      case Kind::kSensors:
        for (int i = 0; i < settings_.modules; ++i) log.AddModule(i == 0 ? "m1" : "m2");
        log.OnPart(Topic::kSensors, m.number, m.number, now_us_, &out);
        break;
      case Kind::kTransform:
        log.OnModule(Topic::kTransform, Number(m.process), m.number, m.number, 0, now_us_, &out);
        break;
      case Kind::kActuator:
        log.OnModule(Topic::kActuator, Number(m.process), m.number, m.number,
                     StatusCount(m.process, m.number), now_us_, &out);
        break;
      case Kind::kStatus:
        log.OnModule(Topic::kStatus, Number(m.process), m.number, StatusTick(m.number), 0, now_us_,
                     &out);
        break;
      case Kind::kPoll:
        log.OnPoll(m.number, now_us_, &out);
        break;
      case Kind::kVerdict:
        log.OnVerdict(now_us_, &out);
        if (log.verdict_heard()) log_clean_ = m.number == 1 && log.complete();
        break;
      case Kind::kProgress:
        log.OnProgress(m.number, now_us_, &out);
        break;
      case Kind::kLeaveAll:
        log.OnLeaveAll(&out);
        break;
      default:
        break;
    }
    Take(out);
  }

  void HearClock(const Message& m, std::vector<LogAction>* out) {
    // Where the sim ends within a tick, END is the message after that tick's CLOCK.
    const LogLockstep::Taken taken =
        log.OnClock(m.number + (m.last == morphbus::sim_clock_t::PHASE_END ? 1 : 0), m.number,
                    static_cast<int>(m.last), settings_.modules, 1, 0, now_us_, out);
    const bool loses = m.number == settings_.lose_tick && m.number < settings_.ticks;
    if (taken != LogLockstep::Taken::kFresh || !loses) return;
    log.Lose(settings_.modules == 1 ? "m1" : "m2", m.number, now_us_, out);
  }

  [[nodiscard]] int Number(int module) const { return log.ModuleNumber(module == 0 ? "m1" : "m2"); }

  /// Answers a logger's request with what is kept.
  void Resend(const Message& ask) {
    for (int64_t n = ask.number; n <= ask.last; ++n) {
      const int64_t tick = ask.topic == Topic::kStatus ? StatusTick(n) : n;
      const int64_t newest = ask.process == -1 ? sim.tick() : computed[Index(ask.process)] - 1;
      if (tick > newest || tick <= newest - settings_.window) {
        // Only a request that was under way for long can ask for what is gone.
        continue;
      }
      switch (ask.topic) {
        case Topic::kClock:
          Send(Clock(n));
          break;
        case Topic::kSensors:
          if (n < settings_.ticks) Send({Kind::kSensors, -1, n});
          break;
        case Topic::kTransform:
          Send({Kind::kTransform, ask.process, n});
          break;
        case Topic::kActuator:
          Send({Kind::kActuator, ask.process, n});
          break;
        case Topic::kStatus:
          if (n < StatusCount(ask.process, newest)) Send({Kind::kStatus, ask.process, n});
          break;
        default:
          break;
      }
    }
  }

  [[nodiscard]] Message Clock(int64_t tick) const {
    int64_t phase = morphbus::sim_clock_t::PHASE_RUN;
    if (tick == 0) phase = morphbus::sim_clock_t::PHASE_START;
    if (sim.ending() && tick == sim.tick()) phase = morphbus::sim_clock_t::PHASE_END;
    return {Kind::kClock, -1, tick, phase};
  }

  void Take(const std::vector<SimAction>& actions) {
    for (const SimAction& action : actions) {
      switch (action.kind) {
        case SimAction::Kind::kPublishClock:
        case SimAction::Kind::kRepeatClock:
          Send(Clock(action.tick));
          break;
        case SimAction::Kind::kPublishReadings:
          if (action.tick == settings_.lose_tick - 1) LoseLast();
          [[fallthrough]];
        case SimAction::Kind::kRepeatReadings:
          Send({Kind::kSensors, -1, action.tick});
          break;
        case SimAction::Kind::kAskModule:
          Send({Kind::kAskActuator, action.process, action.tick});
          break;
        case SimAction::Kind::kPollLogger:
          Send({Kind::kPoll, LogNumber(), action.tick});
          break;
        case SimAction::Kind::kPublishEnd:
        case SimAction::Kind::kRepeatEnd:
          Send({Kind::kClock, -1, action.tick, morphbus::sim_clock_t::PHASE_END});
          break;
        case SimAction::Kind::kTellVerdict:
          Send({Kind::kVerdict, LogNumber(), sim.silent().empty() ? 1 : 0});
          break;
        case SimAction::Kind::kSayProgress:
          Send({Kind::kProgress, -1, action.tick});
          break;
        case SimAction::Kind::kLeaveAll:
          Send({Kind::kLeaveAll, 0, 0});
          break;
        case SimAction::Kind::kAdvance:
          if (action.tick != advanced_++) violation_ = "the robot was not advanced once a tick";
          break;
        case SimAction::Kind::kAskToLeave:
          if (settings_.logger && log.complete_tick() < action.tick) violation_ = "LEAVE too early";
          Send({Kind::kLeave, action.process, action.tick});
          break;
        case SimAction::Kind::kAtBarrier:
          violation_ = "nobody asked for a barrier";
          break;
        case SimAction::Kind::kFinish:
          break;
      }
    }
  }

  /// The last module is to be lost with the next tick.
  void LoseLast() {
    std::vector<SimAction> out;
    sim.Lose(settings_.LostNumber(), now_us_, &out);
    Take(out);
  }

  void Take(int i, const std::vector<ModuleAction>& actions) {
    for (const ModuleAction& action : actions) {
      switch (action.kind) {
        case ModuleAction::Kind::kHello:
          Send({Kind::kHello, i, 0});
          break;
        case ModuleAction::Kind::kCompute:
          Compute(i, action.tick);
          break;
        case ModuleAction::Kind::kAskMate:
          Send({Kind::kAskTransform, action.mate, action.tick});
          break;
        case ModuleAction::Kind::kEndAck:
          Send({Kind::kEndAck, i, 0});
          break;
        case ModuleAction::Kind::kDuplicateProcess:
          violation_ = "a module takes itself for an intruder";
          break;
        case ModuleAction::Kind::kLostSim:
          violation_ = "a module gave up";
          break;
        case ModuleAction::Kind::kFinish:
          break;
      }
    }
  }

  void Compute(int i, int64_t tick) {
    // The saved tick counts kills in: computing again would show here.
    if (tick != computed[Index(i)]) violation_ = "a tick was computed twice or left out";
    if (tick > 0 && settings_.BothIn(tick) && !Sent({Kind::kTransform, 1 - i, tick - 1})) {
      violation_ = "a tick was computed without the mate's message";
    }
    ++computed[Index(i)];
    const int64_t before = tick == 0 ? 0 : StatusCount(i, tick - 1);
    for (int64_t n = before; n < StatusCount(i, tick); ++n) Send({Kind::kStatus, i, n});
    Send({Kind::kTransform, i, tick});
    Send({Kind::kActuator, i, tick});
  }

  void Take(const std::vector<LogAction>& actions) {
    for (const LogAction& action : actions) {
      switch (action.kind) {
        case LogAction::Kind::kHello:
          Send({Kind::kHello, LogNumber(), 0});
          break;
        case LogAction::Kind::kAck:
          Send({Kind::kAck, LogNumber(), action.tick});
          break;
        case LogAction::Kind::kEndAck:
          Send({Kind::kEndAck, LogNumber(), 0});
          break;
        case LogAction::Kind::kVerdictAck:
          Send({Kind::kVerdictAck, LogNumber(), 0});
          break;
        case LogAction::Kind::kAskGap: {
          int to = -1;
          if (action.module >= 0) to = log.module_names()[Index(action.module)] == "m1" ? 0 : 1;
          Send({Kind::kAskGap, to, action.first, action.last, action.topic});
          break;
        }
        case LogAction::Kind::kLostSim:
          violation_ = "the logger gave up";
          break;
        case LogAction::Kind::kFinish:
          break;
      }
    }
  }

  Settings settings_;
  int64_t now_us_ = 0;
  int64_t advanced_ = 0;
  int dead_ = -1;           ///< The module that stopped for good; -1: none.
  bool left_ = false;       ///< The lost module has heard that it is.
  bool log_clean_ = false;  ///< The logger's END would say `clean`.
  std::string violation_;
};

}  // namespace morphbus::bridge
