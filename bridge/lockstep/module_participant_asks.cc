// What a ModuleParticipant is asked and told.

#include <morphbus/admit_t.hpp>
#include <morphbus/leave_t.hpp>
#include <morphbus/resend_t.hpp>
#include <utility>

#include "bridge/lockstep/module_participant.h"

namespace morphbus::bridge {

void ModuleParticipant::OnResend(const uint8_t* data, size_t size) {
  morphbus::resend_t ask;
  if (!Accept(data, size, &ask)) return;
  // Who asks for a message still runs, so the silence that ends our waiting begins anew.
  machine_.OnAsked(now_us());
  outbox_.Answer(ask.channel, ask.first_sequence, ask.last_sequence, now_us());
}

void ModuleParticipant::OnLeave(const uint8_t* data, size_t size) {
  morphbus::leave_t leave;
  if (!Accept(data, size, &leave)) return;
  if (leave.process.empty()) {
    machine_.OnBye(&actions_);
  } else if (leave.process == options_.module && !machine_.joining()) {
    machine_.OnLeave(now_us(), &actions_);
    // Saved before it is acknowledged: started again, the process must not take part once more.
    if (!std::exchange(left_, true)) WriteSnapshot(machine_.tick());
  }
  CarryOutActions();
}

void ModuleParticipant::OnAdmit(const uint8_t* data, size_t size) {
  morphbus::admit_t admit;
  if (!Accept(data, size, &admit)) return;
  // The sim answers every HELLO, and one that was said by a process before this one.
  if (!machine_.joining() || admit.module_name != options_.module || admit.claim != options_.claim)
    return;
  // Numbers on our channels go on where the predecessor's ended.
  outbox_.ContinueAfter(channel_transform_.channel(), admit.actuator_count);
  outbox_.ContinueAfter(channel_actuator_.channel(), admit.actuator_count);
  outbox_.ContinueAfter(channel_status_.channel(), admit.status_count);
  machine_.OnAdmit(admit.last_tick + 1, now_us());
  WriteSnapshot(machine_.tick());
}

}  // namespace morphbus::bridge
