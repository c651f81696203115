// What a ModuleParticipant is asked and told.

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
    machine_.OnAsked(now_us());
    outbox_.Answer(ask.channel, ask.first_sequence, ask.last_sequence, now_us());
  } else if (ask.kind == ask_t::KIND_BYE) {
    machine_.OnBye(&actions_);
  } else if (ask.kind == ask_t::KIND_LEAVE) {
    TakeLeave();
  } else if (ask.kind == ask_t::KIND_ADMIT) {
    TakeAdmission(ask);
  } else {
    CountRefused(&Ledger::bad, options_.module + "/ASK",
                 "kind " + std::to_string(ask.kind) + ", which nobody says to a running module");
  }
  CarryOutActions();
}

void ModuleParticipant::TakeLeave() {
  if (machine_.joining()) return;
  machine_.OnLeave(now_us(), &actions_);
  // Saved before it is acknowledged: started again, the process must not take part once more.
  if (!std::exchange(left_, true)) WriteSnapshot(machine_.tick());
}

void ModuleParticipant::TakeAdmission(const ask_t& ask) {
  // The sim answers every HELLO, and one that was said by a process before this one.
  if (!machine_.joining() || ask.claim != options_.claim) return;
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
  WireTotals published;
  for (const ChannelTotal& total : outbox_.totals()) published.push_back(ToWire(total));
  ask_t pattern = MakeAsk(ask_t::KIND_END_ACK);
  pattern.sender = options_.module;
  pattern.acknowledged_tick = machine_.tick() - 1;
  for (ask_t& part : SplitTotals(pattern, published)) Ask(kSimProcess, std::move(part));
}

}  // namespace morphbus::bridge
