#include "logger/log/replayer.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <morphbus/hello_t.hpp>
#include <morphbus/resend_t.hpp>
#include <morphbus/sim_clock_t.hpp>
#include <thread>

#include "bridge/observe/run_message.h"
#include "bridge/wire/channels.h"
#include "bridge/wire/codec.h"
#include "bridge/wire/info_parts.h"
#include "logger/log/description.h"
#include "logger/log/run_log.h"

namespace morphbus::logger {

using bridge::Topic;

namespace {

constexpr int64_t kIdleUs = 50'000;  ///< How long to sleep where nothing is due.
/// How often to look whether followers have answered.
constexpr int64_t kAnswerUs = 1'000;
constexpr int kBatch = 64;  ///< Messages published at most before the bus is handled again.
/// Names of runs that are remembered: a damaged log can hold any number.
constexpr size_t kMaxRuns = 64;
/// A timestamp that jumps ahead by a day or more is damaged, and does not move the time on.
constexpr int64_t kLongestGapUs = 86'400'000'000;
constexpr int64_t kRestartUs = 1'000'000;  ///< Sim time steps back by more only between runs.
constexpr double kLatestSeconds = 1e9;     ///< Of a range: its microseconds fit an integer.
/// Stands for "no sim time yet": such events lie before any range.
constexpr int64_t kEarliestSimTime = std::numeric_limits<int64_t>::min();

/// Seconds to whole microseconds.
int64_t Micros(double seconds) { return static_cast<int64_t>(std::llround(seconds * 1e6)); }

}  // namespace

Result<std::unique_ptr<Replayer>> Replayer::Open(const std::string& path, ReplayOptions options) {
  // What the user gave is checked before the file is read.
  auto reader = EventLogReader::Open(path);
  if (!reader) return tl::unexpected(reader.error());
  if (!std::isfinite(options.speed) || options.speed < 0) {
    return Fail("the speed must be 0 (as fast as possible) or more");
  }
  if (!(std::abs(options.from_s) <= kLatestSeconds) ||
      !(std::abs(options.to_s) <= kLatestSeconds)) {
    return Fail("the range must be times in seconds");
  }
  // The channel expression comes from the user and may be none.
  Result<NamePattern> channels = NamePattern::Parse(options.channel);
  if (!channels) return tl::unexpected(channels.error());
  std::unique_ptr<Replayer> replayer(
      new Replayer(std::move(*reader), options, std::move(*channels)));
  if (options.to_s >= 0) replayer->end_us_ = Micros(options.to_s);
  // One look at the whole file: which runs are in it, does it have sim time, what is damaged?
  Event event;
  int64_t events = 0;
  while (replayer->Read(&event)) {
    ++events;
    replayer->Survey(event);
  }
  if (events == 0) return Fail(path + " holds no event");
  replayer->progress_.damaged = replayer->reader_->num_findings();
  if (Result<void> lent = replayer->Borrow(path); !lent) return tl::unexpected(lent.error());
  replayer->Rewind();
  return replayer;
}

Result<void> Replayer::Borrow(const std::string& path) {
  if (options_.description.empty() || ReadDescription(path)) return {};
  // The loader knows whether the description fits, and what of another run's may be told.
  RunLogOptions load;
  load.series = false;
  load.description = options_.description;
  const Result<RunLog> log = LoadRunLog(path, load);
  if (!log) return tl::unexpected(log.error());
  lent_channel_ = bridge::Channel(log->facts.run, "", Topic::kInfo);
  for (morphbus::info_part_t& part : bridge::SplitInfo(log->description)) {
    part.header.protocol = morphbus::header_t::PROTOCOL;
    part.header.sequence = static_cast<int64_t>(lent_parts_.size());
    part.header.model_hash = static_cast<int64_t>(log->facts.model_hash);
    bridge::Encode(part, &lent_parts_.emplace_back());
  }
  return {};
}

void Replayer::PublishLent() {
  for (const std::vector<uint8_t>& part : lent_parts_) {
    Send(lent_channel_, part);
    ++progress_.published;
  }
}

bool Replayer::Read(Event* event) {
  if (!reader_->Next(event)) return false;
  event->name = bridge::ParseChannel(event->channel);
  const auto message = bridge::OpenMessage(event->channel, event->data.data(), event->data.size());
  event->message = message ? std::optional(*message) : std::nullopt;
  return true;
}

/// Takes what there is to know of the file before any of its events goes out.
void Replayer::Survey(const Event& event) {
  if (event.name && !event.message) ++progress_.damaged_messages;
  if (event.name && runs_.size() < kMaxRuns) runs_.emplace(event.name->run);
  if (event.name && first_run_.empty()) first_run_ = event.name->run;
  // The first message with sim time makes sim time the replay's time.
  if (event.OfTick()) {
    // Timestamps counted only until now; sim time decides from here on.
    if (!has_sim_time_) progress_.end_s = 0.0;  // so far by timestamps
    has_sim_time_ = true;
    if (event.message) {
      progress_.end_s = std::max(progress_.end_s, Seconds(event.message->header.sim_time_us));
    }
  }
  // Without sim time, the end is told by the timestamps of the file.
  if (has_sim_time_) return;
  TakeSimTime(event);
  progress_.end_s = static_cast<double>(log_time_us_) * 1e-6;
}

Replayer::Replayer(std::unique_ptr<EventLogReader> reader, ReplayOptions options,
                   NamePattern channels)
    : reader_(std::move(reader)),
      options_(std::move(options)),
      channels_(std::move(channels)),
      paused_(options_.paused) {}

Replayer::~Replayer() {
  for (const std::string& channel : listened_) bus_->Unsubscribe(channel);
}

void Replayer::Rewind() {
  reader_->Seek(0);
  log_time_us_ = has_sim_time_ ? kEarliestSimTime : 0;
  first_stamp_us_.reset();
  has_next_ = false;
  ahead_.clear();
  clock_sequence_ = -1;
}

void Replayer::Start(bridge::Bus* bus, int64_t now_us) {
  bus_ = bus;
  delivery_.emplace(bus, first_run_);
  listen_until_us_ = now_us + options_.listen_us;
  const auto listen = [&](const std::string& channel,
                          void (Replayer::*on)(const uint8_t*, size_t)) {
    bus->Subscribe(channel, [this, on](std::string_view, const uint8_t* data, size_t size) {
      (this->*on)(data, size);
    });
    listened_.push_back(channel);
  };
  // Every run of the log is listened to: any of them may be alive on this bus.
  for (const std::string& run : runs_) {
    listen(bridge::Channel(run, bridge::kLogProcess, Topic::kResend), &Replayer::OnResend);
    listen(bridge::Channel(run, "", Topic::kFollow), &Replayer::OnFollow);
    listen(bridge::Channel(run, "", Topic::kHello), &Replayer::OnHello);
    listen(bridge::Channel(run, "", Topic::kClock), &Replayer::OnClock);
  }
}

/// While we only listen, a CLOCK is somebody else's.
void Replayer::OnClock(const uint8_t*, size_t) {
  if (state_ != State::kListening || !error_.empty()) return;
  error_ = "a live run of that name is on this bus, and a replay would disturb it";
}

void Replayer::OnResend(const uint8_t* data, size_t size) {
  morphbus::resend_t ask;
  if (!bridge::Decode(data, size, {}, &ask)) return;
  const auto wanted = bridge::ParseChannel(ask.channel);
  if (wanted && wanted->topic == Topic::kInfo) AddListener(ask.sender);
}

void Replayer::OnFollow(const uint8_t* data, size_t size) {
  morphbus::replay_follow_t said;
  if (!bridge::Decode(data, size, {}, &said)) return;
  if (said.batch < 0) AddListener(said.follower);
  delivery_->Take(said);
}

void Replayer::OnHello(const uint8_t* data, size_t size) {
  morphbus::hello_t hello;
  if (bridge::Decode(data, size, {}, &hello)) {
    AddListener(fmt::format("{} {}", hello.process, hello.pid));
  }
}

void Replayer::AddListener(const std::string& name) {
  // The limit keeps a flood of names from filling the memory.
  if (listeners_.size() < 10'000) listeners_.insert(name);
  progress_.listeners = static_cast<int>(listeners_.size());
}

/// Moves log_time_us_ on to the event's time: sim time of hashed channels, else the timestamp.
void Replayer::TakeSimTime(const Event& event) {
  // A log without sim time is paced by its timestamps, counted from the first one.
  if (!has_sim_time_) {
    if (!first_stamp_us_) first_stamp_us_ = event.timestamp_us;
    int64_t since = 0;
    // A damaged timestamp must not stop the replay for years.
    if (__builtin_sub_overflow(event.timestamp_us, *first_stamp_us_, &since)) return;
    if (since - log_time_us_ < kLongestGapUs) log_time_us_ = std::max(log_time_us_, since);
    return;
  }
  // Only messages in the run's hash carry the sim time of the tick they belong to.
  if (!event.message || !event.OfTick()) return;
  const morphbus::header_t& header = event.message->header;
  if (log_time_us_ != kEarliestSimTime && header.sim_time_us < log_time_us_ - kRestartUs) {
    // Another run, or a concatenated log: time starts again.
    log_time_us_ = header.sim_time_us;
    reanchor_ = true;
    clock_sequence_ = -1;
  }
  // Within a run time never steps back, whatever order the messages stand in.
  log_time_us_ = std::max(log_time_us_, header.sim_time_us);
}

/// Whether the event goes out: not withheld, in the range, and of a wanted channel.
bool Replayer::Wanted(const Event& event) {
  // What would disturb a live run stays in the file, whatever the user asked for.
  if (event.name && !IsReplayed(event.name->topic)) {
    ++progress_.withheld;
    return false;
  }
  // INFO says what the rest means, so it goes out in any range; a range from 0 or below includes
  // what stands before the first sim time.
  const bool is_info = event.Is(Topic::kInfo);
  const bool begun =
      log_time_us_ >= Micros(options_.from_s) || (has_sim_time_ && options_.from_s <= 0);
  const bool in_range = is_info || (begun && log_time_us_ < end_us_);
  // What a seek passes over is neither published nor counted.
  if (!is_info && log_time_us_ < seek_us_) return false;
  // LCM cannot carry longer names.
  if (!in_range || event.channel.size() > bridge::kMaxChannelName ||
      !channels_.Matches(event.channel)) {
    ++progress_.filtered;
    return false;
  }
  return true;
}

/// Finds the next event to publish; false if there is none. What lies beyond the end of the range
/// is read, too: in concatenated logs another run may follow.
bool Replayer::ReadNext() {
  if (has_next_) return true;
  while (Read(&next_)) {
    TakeSimTime(next_);
    LookForCommands(next_);
    if (!Wanted(next_)) continue;
    // Events before the first sim time are due at the start of the range, and nobody waits for a
    // later run's description beyond its end.
    next_time_us_ = log_time_us_ == kEarliestSimTime ? Micros(options_.from_s)
                                                     : std::min(log_time_us_, end_us_);
    // The description that goes out again after a seek is due there, too.
    next_time_us_ = std::max(next_time_us_, seek_us_);
    has_next_ = true;
    return true;
  }
  return false;
}

void Replayer::Send(const std::string& channel, std::span<const uint8_t> data) {
  delivery_->Publish(channel, data);
}

void Replayer::CloseBatch(int64_t now_us) {
  delivery_->Close(now_us);
  delivery_->Beat(now_us);
  progress_.followers = delivery_->followers();
  progress_.lost_followers = delivery_->lost();
}

bool Replayer::AllDelivered(int64_t now_us) {
  CloseBatch(now_us);
  if (delivery_->Waiting(now_us)) return false;
  if (!end_told_) delivery_->End(now_us);
  end_told_ = true;
  return !delivery_->Waiting(now_us);
}

void Replayer::LookForCommands(const Event& event) {
  // Only those of the range; what a seek passes over is not replayed.
  if (!event.message || !event.Is(Topic::kClock)) return;
  if (log_time_us_ < std::max(Micros(options_.from_s), seek_us_) || log_time_us_ >= end_us_) return;
  const morphbus::header_t& header = event.message->header;
  if (header.sequence <= clock_sequence_) return;
  const auto clock = bridge::DecodeAs<morphbus::sim_clock_t>(*event.message);
  if (!clock) return;
  clock_sequence_ = header.sequence;
  for (const std::string& text : clock->controls) {
    ahead_.push_back({header.tick, header.sim_time_us, text});
  }
}

void Replayer::PassCommands() {
  constexpr size_t kMost = 10'000;  // where nobody takes them
  for (ClockCommand& command : ahead_) {
    if (passed_.size() < kMost) passed_.push_back(std::move(command));
  }
  ahead_.clear();
}

void Replayer::Publish() {
  PassCommands();
  Send(std::string(next_.channel), next_.data);
  ++progress_.published;
  progress_.time_s = static_cast<double>(next_time_us_) * 1e-6;
  has_next_ = false;
}

/// From now on, time passes from the next event on.
void Replayer::Anchor(int64_t now_us) {
  anchor_wall_us_ = now_us;
  anchor_log_us_ = has_next_ ? next_time_us_ : Micros(progress_.time_s);
  anchor_count_ = progress_.published;
  reanchor_ = false;
}

void Replayer::Pause(int64_t) { paused_ = true; }

void Replayer::Resume(int64_t now_us) {
  paused_ = false;
  stepping_ = false;
  ReadNext();
  Anchor(now_us);
}

void Replayer::Step() {
  stepping_ = paused_;
  step_begins_ = true;
}

void Replayer::Seek(double time_s, int64_t now_us) {
  // Within the range, and not behind the last message: there would be nothing to see.
  const double latest_s =
      options_.to_s >= 0 ? std::min(options_.to_s, progress_.end_s) : progress_.end_s;
  seek_us_ = Micros(std::clamp(time_s, options_.from_s, std::max(options_.from_s, latest_s)));
  // Whatever the direction, the log is read from its beginning: its description goes out again, and
  // a time is told apart from that of a later run.
  Rewind();
  if (state_ == State::kPlaying) PublishLent();
  ReadNext();
  // The place is known at once, though nothing has been published there yet.
  progress_.time_s = static_cast<double>(has_next_ ? next_time_us_ : seek_us_) * 1e-6;
  Step();
  Anchor(now_us);
}

void Replayer::SetSpeed(double speed, int64_t now_us) {
  if (!std::isfinite(speed) || speed < 0) return;
  // What was published so far keeps its pace; the new one holds from the next event.
  options_.speed = speed;
  ReadNext();
  Anchor(now_us);
}

std::optional<int64_t> Replayer::Play(int64_t now_us) {
  for (int i = 0; i < kBatch; ++i) {
    // Followers must have what went out before anything more does.
    if (delivery_->full()) CloseBatch(now_us);
    if (delivery_->Waiting(now_us)) return now_us + kAnswerUs;
    // A paused replay stays where it is, also behind its last message: one may seek back from
    // there.
    stepping_ = stepping_ && ReadNext();
    if (paused_ && !stepping_) {
      CloseBatch(now_us);
      return now_us + kIdleUs;
    }
    // At the end of the range, begin again or stop. A range without messages is not looped for
    // ever.
    if (!ReadNext()) {
      PassCommands();
      if (!options_.loop || progress_.published == 0) {
        if (!AllDelivered(now_us)) return now_us + kAnswerUs;
        ++progress_.loops;
        state_ = State::kDone;
        return std::nullopt;
      }
      ++progress_.loops;
      seek_us_ = kEarliestSimTime;
      Rewind();
      PublishLent();
      if (ReadNext()) Anchor(now_us);
      return now_us;
    }
    if (reanchor_) Anchor(now_us);
    // A step publishes one tick; the description alone is none, and the tick behind it goes out,
    // too.
    if (paused_) {
      if (step_begins_) step_us_ = next_time_us_;
      stepping_ = next_time_us_ == step_us_;
      if (!stepping_) continue;
      step_begins_ = step_begins_ && next_.Is(Topic::kInfo);
      Publish();
      continue;
    }
    // When the message is due: by its time, or as fast as listeners follow.
    double due = static_cast<double>(anchor_wall_us_);
    if (options_.speed > 0) {
      due += static_cast<double>(next_time_us_ - anchor_log_us_) / options_.speed;
    } else if (options_.max_rate > 0) {
      due += static_cast<double>(progress_.published - anchor_count_) * 1e6 / options_.max_rate;
    }
    if (due > static_cast<double>(now_us)) {
      // What went out of this tick is complete.
      CloseBatch(now_us);
      // Never asleep for long: people pause, and listeners ask.
      return now_us + std::min<int64_t>(
                          kIdleUs, std::max<int64_t>(
                                       1, static_cast<int64_t>(due - static_cast<double>(now_us))));
    }
    Publish();
  }
  return now_us;
}

std::optional<int64_t> Replayer::Advance(int64_t now_us) {
  if (!error_.empty()) state_ = State::kDone;
  // Go on to the next state: first listen, then wait for listeners, then play.
  if (state_ == State::kListening && now_us >= listen_until_us_) state_ = State::kWaiting;
  if (state_ == State::kWaiting && progress_.listeners >= options_.wait_for) {
    state_ = State::kPlaying;
    PublishLent();
    ReadNext();
    Anchor(now_us);
  }
  switch (state_) {
    case State::kListening:
      return std::min(listen_until_us_, now_us + kIdleUs);
    case State::kWaiting:
      return now_us + kIdleUs;
    case State::kPlaying:
      return Play(now_us);
    case State::kDone:
      break;
  }
  return std::nullopt;
}

Result<ReplayProgress> Replay(const std::string& path, const ReplayOptions& options,
                              bridge::Bus* bus, const volatile bool* stop,
                              const std::function<void(Replayer*)>& each) {
  auto replayer = Replayer::Open(path, options);
  if (!replayer) return tl::unexpected(replayer.error());
  // The caller's thread drives the replay until its end or a signal.
  const bridge::MonotonicTime time;
  (*replayer)->Start(bus, time.NowUs());
  int64_t next_call_us = 0;
  while (stop == nullptr || !*stop) {
    const std::optional<int64_t> again = (*replayer)->Advance(time.NowUs());
    if (!again) break;
    // Between messages the bus is handled: listeners ask, and live runs are heard.
    const int64_t wait_us = *again - time.NowUs();
    // Handle() counts in milliseconds; the rest is slept exactly.
    bus->Handle(wait_us > 0 ? static_cast<int>(wait_us / 1000) : 0);
    const int64_t rest_us = *again - time.NowUs();
    if (rest_us > 0 && rest_us < 1000) {
      std::this_thread::sleep_for(std::chrono::microseconds(rest_us));
    }
    // Whoever watches is told ten times a second.
    if (each && time.NowUs() >= next_call_us) {
      next_call_us = time.NowUs() + 100'000;
      each(replayer->get());
    }
  }
  if (!(*replayer)->error().empty()) return Fail((*replayer)->error());
  // What happened since then.
  if (each) each(replayer->get());
  return (*replayer)->progress();
}

}  // namespace morphbus::logger
