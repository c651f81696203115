#pragma once
// What the simulator's, a module's and the logger's side of the lockstep have in common: a bus, an
// outbox, a ledger that travels in HEALTH, requests for messages, and a pure state machine whose
// actions the participant carries out. The machine decides and knows no bytes; the participant
// knows the bytes and decides nothing about the order of the run. Whatever comes from outside is
// decoded and checked here before the machine hears of it.

#include <cstdint>
#include <morphbus/hello_t.hpp>
#include <morphbus/lateness_t.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/lockstep/outbox.h"
#include "bridge/lockstep/participant.h"
#include "bridge/lockstep/repeat_filter.h"
#include "bridge/lockstep/run_totals.h"
#include "bridge/lockstep/sequence_tracker.h"

namespace morphbus::bridge {

/// What every participant of a lockstep can do, whatever its state machine: it sends through its
/// outbox, counts in its ledger, and asks other processes.
/// The part that does not depend on the kind of state machine.
class ParticipantBase : public Participant {
 public:
  /// What was sent, received and missed so far, the bus's own losses included (as of the last
  /// OnTime).
  [[nodiscard]] const Ledger& ledger() const { return ledger_; }
  /// Brings what the bus itself lost, by overflow or on purpose, into the ledger.
  void CountBusLosses() { CountLosses(*bus_, &ledger_); }
  /// Sends HEALTH: the ledger and the resources of the process, and what it has published. Several
  /// messages if one cannot hold all that Lateness has.
  void PublishHealth();

 protected:
  /// When a message outside the run's hash is sent: what its header says.
  struct Moment {
    /// The tick that the message speaks of; 0 before the run.
    int64_t tick = 0;
    /// Time since tick 0, microseconds of sim time.
    int64_t sim_time_us = 0;
  };

  /// `bus` and `time` outlive the participant.
  ParticipantBase(Bus* bus, const TimeSource* time, Sender sender);

  /// What the header of a message says that is sent now and belongs to no tick.
  [[nodiscard]] virtual Moment CurrentMoment() const = 0;
  /// Who was late in real time, for HEALTH; only the simulator knows.
  [[nodiscard]] virtual std::vector<morphbus::lateness_t> Lateness() const { return {}; }
  /// The participant's clock: wall time, or a test's.
  [[nodiscard]] int64_t now_us() const { return time_->NowUs(); }
  /// Full name of a channel of this run. `process` is whose channel it is, empty for those that
  /// belong to nobody (HELLO).
  [[nodiscard]] std::string ChannelOf(std::string_view process, Topic topic) const;

  /// Calls `method` of this participant with each message on `channel`, during Bus::Handle; `who`
  /// goes before the bytes. Outside the hash a repetition goes no further. The bus keeps the
  /// participant's address, so the participant stays where it is until the bus is gone.
  template <class Self, class... Arguments, class... Who>
  void Listen(const std::string& channel, void (Self::*method)(Arguments...), Who... who) {
    ListenFor(Interest(), channel, method, who...);
  }
  /// The same for what of the channel is of `interest`.
  template <class Self, class... Arguments, class... Who>
  void ListenFor(const Interest& interest, const std::string& channel,
                 void (Self::*method)(Arguments...), Who... who);
  /// Whether a message outside the hash has come before; counts it as a duplicate if so.
  bool IsRepeat(const ChannelName& name, const uint8_t* data, size_t size);
  /// Decodes a message that speaks of this run's model and for which `fits` holds (if given; it is
  /// called once `*out` is filled), and counts it as received; else counts it as bad and returns
  /// false, and `*out` is unspecified.
  template <class M, class Fits = bool (*)()>
  bool Accept(
      const uint8_t* data, size_t size, M* out, const Fits& fits = [] { return true; });

  /// Counts a message that was sound and is refused all the same in `count`, one of the ledger's;
  /// the first one is named there as `channel` (without the run's name) and `why`.
  void CountRefused(int64_t Ledger::*count, std::string_view channel, const std::string& why);
  /// The same for one of a tick that cannot be now.
  void CountOutside(std::string_view channel, int64_t tick) {
    CountRefused(
        &Ledger::outside_window, channel,
        "tick " + std::to_string(tick) + " in tick " + std::to_string(CurrentMoment().tick));
  }
  /// Notes a message of a numbered channel with its number and bytes, and counts a conflict if
  /// other bytes came under that number before.
  SequenceTracker::Kind Track(SequenceTracker* tracker, std::string_view channel, int64_t sequence,
                              uint64_t digest);

  /// Sends a message that is of no tick, on the channel of a process (ChannelOf). The header is
  /// filled in here.
  template <class M>
  void Say(std::string_view process, Topic topic, M message) {
    const Moment now = CurrentMoment();
    outbox_.Send(ChannelOf(process, topic), now.tick, now.sim_time_us, &message);
  }
  /// Asks a process to send messages first..last of its channel `topic` again, and counts that in
  /// the ledger.
  void AskForResend(std::string_view to, Topic topic, int64_t first, int64_t last);
  /// Acknowledges END: says on TOTALS what the process has published or recorded, unless that was
  /// done a moment ago. `last_tick` is as in totals_t.
  void SayTotals(int64_t last_tick, const std::vector<ChannelTotal>& totals);
  /// Publishes HELLO, by which the sim decides whether the process fits the run: what every process
  /// says of itself, its claim and build, and of a module its cold starts, type and kinematics.
  void SayHello(int64_t claim, const std::string& build, uint32_t incarnation,
                const std::string& type_name, uint64_t kinematics_hash);

  // The bus is not owned. All messages go out through the outbox; gaps and repeats in what comes in
  // are counted by trackers that derived classes keep, one for each channel.
  Bus* bus_;
  Ledger ledger_;
  Outbox outbox_;

 private:
  /// The clock of now_us(); not owned.
  const TimeSource* time_;
  /// Of everything that came outside the hash.
  RepeatFilter repeats_;
  /// Wall time before which END is not acknowledged again, however often it is repeated.
  int64_t end_acked_until_us_ = 0;
};

/// A participant around a `Machine` of its own: SimLockstep, ModuleLockstep or LogLockstep. A
/// derived class tells the machine what has come, with `&actions_` as the place for what follows
/// from it, and then calls CarryOutActions.
template <class Machine>
class LockstepParticipant : public ParticipantBase {
 public:
  /// Lets the machine do what is due.
  void OnTime() override {
    CountBusLosses();
    machine_.OnTime(now_us(), &actions_);
    CarryOutActions();
  }
  /// Wall time at which OnTime must be called at the latest; kNever if only a message can change
  /// anything.
  [[nodiscard]] int64_t next_deadline_us() const final { return machine_.next_deadline_us(); }
  /// The run is over for this participant, well or not.
  [[nodiscard]] bool done() const final { return machine_.done(); }

 protected:
  // What the machine decides: a list of actions, to be carried out in order.
  using Actions = typename Machine::Actions;
  using Action = typename Actions::value_type;

  /// `bus` and `time` outlive the participant.
  LockstepParticipant(Bus* bus, const TimeSource* time, Sender sender,
                      const typename Machine::Config& config)
      : ParticipantBase(bus, time, std::move(sender)), machine_(config) {}

  /// Does what the machine has decided. May tell the machine more.
  virtual void CarryOut(const Action& action) = 0;

  /// Carries out the machine's actions until there are none left. Carrying one out may tell the
  /// machine something and so add further ones; a call from within leaves those to the loop that
  /// is already running.
  void CarryOutActions() {
    if (carrying_out_) return;
    carrying_out_ = true;
    for (size_t i = 0; i < actions_.size(); ++i) {
      const Action action = actions_[i];  // The vector may grow meanwhile.
      CarryOut(action);
    }
    actions_.clear();
    carrying_out_ = false;
  }

  /// Tells the machine of an event that happens now, and carries out what follows from it.
  template <class Event, class... Arguments>
  void Tell(Event event, const Arguments&... arguments) {
    (machine_.*event)(arguments..., now_us(), &actions_);
    CarryOutActions();
  }

  // The actions wait here until they are carried out.
  Machine machine_;
  Actions actions_;

 private:
  /// CarryOutActions is at work further up the stack.
  bool carrying_out_ = false;
};

// Implementation of the templates.

template <class Self, class... Arguments, class... Who>
void ParticipantBase::ListenFor(const Interest& interest, const std::string& channel,
                                void (Self::*method)(Arguments...), Who... who) {
  const std::optional<ChannelName> name = ParseChannel(channel);
  // Repetitions on a hashed channel are the participant's own machine's business.
  const bool once = name && !IsHashed(name->topic);
  bus_->Subscribe(
      channel,
      [self = static_cast<Self*>(this), once, method, who...](std::string_view on,
                                                              const uint8_t* data, size_t size) {
        if (once && self->IsRepeat(*ParseChannel(on), data, size)) {
          ++self->ledger_.received;
          return;
        }
        (self->*method)(who..., data, size);
      },
      interest);
}

template <class M, class Fits>
bool ParticipantBase::Accept(const uint8_t* data, size_t size, M* out, const Fits& fits) {
  const bool good = Decode(data, size, {outbox_.sender().model_hash, 0}, out).has_value() && fits();
  ++(good ? ledger_.received : ledger_.bad);
  return good;
}

}  // namespace morphbus::bridge
