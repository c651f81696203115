#include "bridge/lockstep/lockstep_participant.h"

#include <unistd.h>

#include <algorithm>
#include <morphbus/resend_t.hpp>
#include <utility>

#include "bridge/wire/arithmetic_hash.h"
#include "bridge/wire/health.h"

namespace morphbus::bridge {

ParticipantBase::ParticipantBase(Bus* bus, const TimeSource* time, Sender sender)
    : bus_(bus), outbox_(bus, std::move(sender), &ledger_), time_(time) {}

std::string ParticipantBase::ChannelOf(std::string_view process, Topic topic) const {
  return Channel(outbox_.sender().run, process, topic);
}

void ParticipantBase::CountRefused(int64_t Ledger::*count, std::string_view channel,
                                   const std::string& why) {
  // Every refusal counts; only the first is told in words, since the others are mostly like it.
  ++(ledger_.*count);
  if (!ledger_.first_refused.empty()) return;
  // The run's name is the same for all.
  const std::string& run = outbox_.sender().run;
  if (channel.starts_with(run + "/")) channel.remove_prefix(run.size() + 1);
  ledger_.first_refused = CutText(std::string(channel) + ": " + why, kLongestText);
}

bool ParticipantBase::IsRepeat(const ChannelName& name, const uint8_t* data, size_t size) {
  if (!repeats_.IsRepeat(name, data, size)) return false;
  ++ledger_.duplicates;
  return true;
}

SequenceTracker::Kind ParticipantBase::Track(SequenceTracker* tracker, std::string_view channel,
                                             int64_t sequence, uint64_t digest) {
  const SequenceTracker::Kind kind = tracker->Take(sequence, digest, &ledger_);
  if (kind == SequenceTracker::Kind::kConflict) {
    CountRefused(
        &Ledger::conflicts, channel,
        "other bytes under number " + std::to_string(sequence) + ", which was had already");
  }
  return kind;
}

namespace {

/// What was published on channels that count for the run's hash.
void AddTotals(const Outbox& outbox, morphbus::health_t* health) {
  for (const ChannelTotal& total : outbox.totals()) {
    if (health->totals.size() == kMostTopicTotals) break;
    morphbus::topic_total_t& entry = health->totals.emplace_back();
    entry.topic = TopicName(ParseChannel(total.channel)->topic);
    entry.count = total.count;
    entry.chained_hash = total.chained_hash;
  }
  health->num_totals = static_cast<int8_t>(health->totals.size());
}

}  // namespace

void ParticipantBase::PublishHealth() {
  CountBusLosses();
  const std::string& process = outbox_.sender().process;
  const std::vector<morphbus::lateness_t> lateness = Lateness();
  size_t told = 0;
  // One message even if nobody was late; as many as it takes if there were many.
  do {
    morphbus::health_t health = MakeHealth(process, ledger_);
    const size_t end = std::min(lateness.size(), told + kMostLateness);
    for (; told < end; ++told) health.lateness.push_back(lateness[told]);
    health.num_lateness = static_cast<int8_t>(health.lateness.size());
    // The logger finds out by these, while the run goes on, whether it was told something else.
    if (told == health.lateness.size()) AddTotals(outbox_, &health);
    // HEALTH is not in the run's hash: wall time and luck may show in it.
    Say(process, Topic::kHealth, std::move(health));
  } while (told < lateness.size());
}

void ParticipantBase::AskForResend(std::string_view to, Topic topic, int64_t first, int64_t last) {
  // The addressee gets the full name of its own channel back, and need not know our topics.
  ++ledger_.asked;
  Say(to, Topic::kResend,
      morphbus::resend_t{{}, outbox_.sender().process, ChannelOf(to, topic), first, last});
}

void ParticipantBase::SayTotals(int64_t last_tick, const std::vector<ChannelTotal>& totals) {
  if (now_us() < end_acked_until_us_) return;
  std::vector<morphbus::totals_t> parts = SplitTotals(outbox_.sender().process, last_tick, totals);
  // A log of many channels takes many messages.
  end_acked_until_us_ = now_us() + kResendPauseUs * static_cast<int64_t>(parts.size());
  for (morphbus::totals_t& part : parts) Say("", Topic::kTotals, std::move(part));
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
  hello.arithmetic_hash = static_cast<int64_t>(ArithmeticHash());
  hello.build = build;
  // A process says HELLO before it has any part in the run's time, hence tick 0.
  outbox_.Send(ChannelOf("", Topic::kHello), 0, 0, &hello);
}

}  // namespace morphbus::bridge
