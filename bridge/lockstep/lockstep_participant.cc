#include "bridge/lockstep/lockstep_participant.h"

#include <unistd.h>

#include <utility>

#include "bridge/wire/health.h"

namespace morphbus::bridge {

using morphbus::ask_t;

// Sim and logger word it alike, so that whoever reads both outputs sees one cause.
std::string HashesDiffer(const std::string& recorded, const std::string& published) {
  return "LOG recorded other messages (hash " + recorded + ") than were published (hash " +
         published + ")";
}

ParticipantBase::ParticipantBase(Bus* bus, const TimeSource* time, Sender sender)
    : bus_(bus), outbox_(bus, std::move(sender), &ledger_), time_(time) {}

std::string ParticipantBase::ChannelOf(std::string_view process, Topic topic) const {
  return Channel(outbox_.sender().run, process, topic);
}

void ParticipantBase::CountBusLosses() {
  // The bus counts from its beginning, so its sums replace what the ledger had.
  ledger_.queue_overflows = bus_->queue_overflows();
  ledger_.discarded = bus_->discarded();
}

void ParticipantBase::PublishHealth() {
  CountBusLosses();
  const std::string& process = outbox_.sender().process;
  morphbus::health_t health = MakeHealth(process, ledger_);
  // HEALTH is not in the run's hash: wall time and luck may show in it.
  const Moment now = CurrentMoment();
  outbox_.Send(ChannelOf(process, Topic::kHealth), now.tick, now.sim_time_us, &health);
}

ask_t ParticipantBase::MakeAsk(int8_t kind) {
  ask_t ask;
  ask.kind = kind;
  // LCM's structs leave their numbers unset, and uninitialized bytes must not travel.
  ask.first_sequence = ask.last_sequence = 0;
  ask.acknowledged_tick = -1;
  ask.num_totals = 0;
  return ask;
}

void ParticipantBase::Ask(std::string_view to, ask_t ask) {
  // ASK has many publishers, so the message itself says who speaks.
  ask.sender = outbox_.sender().process;
  const Moment now = CurrentMoment();
  outbox_.Send(ChannelOf(to, Topic::kAsk), now.tick, now.sim_time_us, &ask);
}

void ParticipantBase::AskForResend(std::string_view to, Topic topic, int64_t first, int64_t last) {
  // The addressee gets the full name of its own channel back, and need not know our topics.
  ask_t ask = MakeAsk(ask_t::KIND_RESEND);
  ask.channel = ChannelOf(to, topic);
  ask.first_sequence = first;
  ask.last_sequence = last;
  ++ledger_.asked;
  Ask(to, std::move(ask));
}

void ParticipantBase::SayHello(int64_t claim, const std::string& build, uint32_t incarnation,
                               const std::string& type_name, uint64_t kinematics_hash) {
  morphbus::hello_t hello;
  hello.process = outbox_.sender().process;
  hello.pid = getpid();
  hello.claim = claim;
  hello.incarnation = static_cast<int32_t>(incarnation);
  hello.type_name = type_name;
  hello.kinematics_hash = static_cast<int64_t>(kinematics_hash);
  // The wire hash tells builds apart whose messages differ.
  hello.wire_hash = static_cast<int64_t>(WireHash());
  hello.build = build;
  // A process says HELLO before it has any part in the run's time, hence tick 0.
  outbox_.Send(ChannelOf("", Topic::kHello), 0, 0, &hello);
}

}  // namespace morphbus::bridge
