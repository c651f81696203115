// What a ModuleParticipant is asked, what of that it believes, and what it tells of what it took.

#include <algorithm>
#include <morphbus/ask_t.hpp>
#include <string>
#include <utility>

#include "bridge/lockstep/module_participant.h"

namespace morphbus::bridge {

using morphbus::ask_t;

void ModuleParticipant::OnAsk(const uint8_t* data, size_t size) {
  ask_t ask;
  if (!Accept(data, size, &ask)) return;
  // Whoever asks for a message still runs, so the silence that ends our waiting begins anew.
  if (ask.kind == ask_t::KIND_RESEND) {
    machine_.OnAsked(ask.header.tick, now_us());
    outbox_.Answer(ask.channel, ask.first_sequence, ask.last_sequence, now_us());
    if (ask.sender == kSimProcess && ask.channel == channel_actuator_.channel()) NoteAwaited(ask);
  } else if (ask.kind == ask_t::KIND_BYE) {
    const bool of_sim = ask.sender == kSimProcess;
    if (!of_sim || !machine_.OnBye(ask.header.tick, &actions_)) {
      CountRefused(&Ledger::false_ends, options_.module + "/ASK",
                   "BYE at tick " + std::to_string(ask.header.tick) + " in tick " +
                       std::to_string(machine_.tick()));
    }
  } else if (ask.kind == ask_t::KIND_LEAVE) {
    TakeLeave(ask);
  } else if (ask.kind == ask_t::KIND_ADMIT && ask.sender == kSimProcess && machine_.joining()) {
    TakeAdmission(ask);
  } else if (ask.kind != ask_t::KIND_ADMIT || options_.incarnation == 1) {
    // The sim may have said ADMIT once more to whoever said HELLO twice.
    CountRefused(&Ledger::bad, options_.module + "/ASK",
                 "kind " + std::to_string(ask.kind) + ", which nobody says to a running module");
  }
  CarryOutActions();
}

void ModuleParticipant::TakeLeave(const ask_t& ask) {
  const int64_t tick = ask.header.tick;
  const bool possible = ask.sender == kSimProcess && !machine_.joining() &&
                        machine_.OnLeave(tick, now_us(), &actions_);
  if (!possible) {
    return CountRefused(
        &Ledger::false_ends, options_.module + "/ASK",
        "LEAVE at tick " + std::to_string(tick) + " in tick " + std::to_string(machine_.tick()));
  }
  // Saved before it is acknowledged: started again, the process must not take part once more,
  // unless the sim still wants its answers.
  if (!std::exchange(left_, true)) WriteSnapshot(machine_.tick());
}

void ModuleParticipant::NoteAwaited(const ask_t& ask) {
  // Of a module that it goes on without the sim wants nothing more than there is.
  if (ask.last_sequence >= outbox_.count(channel_actuator_) &&
      machine_.OnAwaited(now_us(), &actions_)) {
    left_ = false;
    CountRefused(
        &Ledger::false_ends, options_.module + "/ASK",
        "LEAVE, and then a request for the answer to tick " + std::to_string(machine_.tick()));
    return WriteSnapshot(machine_.tick());
  }
  // The sim asks for the present tick's answer: it was not the sim that told of another one.
  if (!admitted_ || options_.realtime || ask.first_sequence == machine_.tick()) return;
  admitted_ = false;
  CountRefused(&Ledger::false_ends, options_.module + "/ASK",
               "ADMIT to tick " + std::to_string(machine_.tick()) + ", and then a request for " +
                   std::to_string(ask.first_sequence));
  machine_.Begin(ModuleLockstep::kUnknownTick, now_us(), &actions_);
}

void ModuleParticipant::TakeAdmission(const ask_t& ask) {
  // Nobody is believed at the first word: the sim says the same to every HELLO.
  const auto says_as = [&](const ask_t& other) {
    const auto equal = [](const morphbus::channel_total_t& a, const morphbus::channel_total_t& b) {
      return a.channel == b.channel && a.count == b.count;
    };
    return (options_.realtime || ask.acknowledged_tick == other.acknowledged_tick) &&
           std::equal(ask.totals.begin(), ask.totals.end(), other.totals.begin(),
                      other.totals.end(), equal);
  };
  const bool same = admission_ && says_as(*admission_);
  if (admission_ && ask.header.sequence == admission_->header.sequence && same) return;
  if (admission_ && !same) {
    CountRefused(&Ledger::false_ends, options_.module + "/ASK",
                 "ADMIT to another place than before");
  }
  admission_ = ask;
  if (!same) {
    machine_.SayHelloSoon(now_us());
    return;
  }
  admission_.reset();
  admitted_ = true;
  // Numbers on our channels go on where the predecessor's ended.
  for (const morphbus::channel_total_t& total : ask.totals) {
    const std::optional<ChannelName> name = ParseChannel(total.channel);
    const bool ours = name && name->run == options_.run && name->process == options_.module;
    if (ours && IsHashed(name->topic)) outbox_.ContinueAfter(total.channel, total.count);
  }
  machine_.OnAdmit(ask.acknowledged_tick + 1, now_us());
  WriteSnapshot(machine_.tick());
}

void ModuleParticipant::AcknowledgeEnd() {
  if (now_us() < end_acked_until_us_) return;
  end_acked_until_us_ = now_us() + kResendPauseUs;
  TotalsReport report;
  for (const ChannelTotal& total : outbox_.totals()) report.totals.push_back(ToWire(total));
  report.taken = taken_.Report(options_.run, options_.module);
  ask_t pattern = MakeAsk(ask_t::KIND_END_ACK);
  if (options_.realtime) {
    AddSums(&report);
    // What the sim may have of the commands.
    for (size_t i = report.taken.size(); i-- > 0;) {
      if (report.taken[i].channel != channel_actuator_.channel()) continue;
      report.taken.push_back(report.taken[i]);
      report.taken.back().taker = kSimProcess;
      break;
    }
    pattern.verdict = first_conflict();
  }
  pattern.sender = options_.module;
  pattern.acknowledged_tick = machine_.tick() - 1;
  for (ask_t& part : SplitReport(pattern, report)) Ask(kSimProcess, std::move(part));
}

void ModuleParticipant::ReportTaken() {
  const int64_t last = machine_.tick() - 1;
  if (last < 0 || machine_.joining()) return;
  // The blocks that are over, once more, and as much as there is of the present one.
  const int64_t present = last - last % kBlockTicks;
  const int64_t oldest = present - (kToldBlocks - 1) * kBlockTicks;
  for (int64_t first = std::max<int64_t>(0, oldest); first <= present; first += kBlockTicks) {
    TellTaken(first, std::min(first + kBlockTicks - 1, last),
              taken_.Recent(options_.run, options_.module, first));
  }
}

}  // namespace morphbus::bridge
