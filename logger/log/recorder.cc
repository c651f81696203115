#include "logger/log/recorder.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <morphbus/log_end_t.hpp>
#include <morphbus/totals_t.hpp>
#include <tuple>

#include "bridge/wire/channels.h"
#include "bridge/wire/codec.h"
#include "bridge/wire/health.h"
#include "bridge/wire/info_parts.h"
#include "compiler/base/text.h"

namespace morphbus::logger {

using bridge::Topic;

namespace {

/// After the end, how long to wait for the last ledgers, which nobody sends again.
constexpr int64_t kLedgerPatienceUs = 250'000;

}  // namespace

int64_t WallClockUs() {
  const auto since = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::microseconds>(since).count();
}

Result<std::unique_ptr<Recorder>> Recorder::Create(bridge::Bus* bus, const bridge::TimeSource* time,
                                                   RecorderOptions options) {
  // The description must say which run this is, and a name must fit into channel names.
  if (options.description.size() > bridge::kMaxInfoBytes) {
    return Fail("the run's description is larger than 16 MiB");
  }
  Result<bridge::DescribedRun> described = bridge::ReadDescribedRun(options.description);
  if (!described) return tl::unexpected(described.error());
  if (Result<void> name = bridge::CheckRunName(described->run); !name) {
    return tl::unexpected(name.error());
  }
  // From here on the file exists, and begins with the description.
  auto writer = options.in_memory ? EventLogWriter::CreateInMemory(options.path)
                                  : EventLogWriter::Create(options.path);
  if (!writer) return tl::unexpected(writer.error());
  if (!options.wall_clock) options.wall_clock = WallClockUs;
  std::unique_ptr<Recorder> recorder(
      new Recorder(bus, time, std::move(options), *std::move(described), std::move(*writer)));
  recorder->WriteInfo();
  if (!recorder->error_.empty()) return Fail(recorder->error_);
  return recorder;
}

Recorder::Recorder(bridge::Bus* bus, const bridge::TimeSource* time, RecorderOptions options,
                   bridge::DescribedRun described, std::unique_ptr<EventLogWriter> writer)
    : time_(time),
      options_(std::move(options)),
      described_(std::move(described)),
      writer_(std::move(writer)) {
  bridge::LogParticipantOptions participant;
  participant.run = described_.run;
  participant.model_hash = described_.model_hash;
  participant.realtime = options_.realtime;
  participant.claim = options_.claim;
  participant.timing = options_.timing;
  participant.build = described_.build;
  participant_ = std::make_unique<bridge::LogParticipant>(
      bus, time, std::move(participant), [this](const bridge::LoggedMessage& m) { Take(m); });
  participant_->OnInfoRequest([this] { PublishInfo(); });
}

Recorder::~Recorder() = default;

void Recorder::Start() {
  participant_->Start();
  // Viewers that listen already get the description without asking.
  PublishInfo();
}

void Recorder::OnTime() {
  participant_->OnTime();
  Release(participant_->complete_ticks());
  // Nobody sends ledgers again, so the wait for them is short, and none after a failure.
  if (participant_->done() && ledgers_due_us_ < 0) {
    ledgers_due_us_ = time_->NowUs() + (participant_->error().empty() ? kLedgerPatienceUs : 0);
  }
}

int64_t Recorder::next_deadline_us() const {
  return participant_->done() ? ledgers_due_us_ : participant_->next_deadline_us();
}

bool Recorder::HasAllLedgers() const {
  return std::all_of(ledgers_.begin(), ledgers_.end(), [](const auto& l) { return l.second; });
}

bool Recorder::done() const {
  if (!error_.empty()) return true;
  return participant_->done() &&
         (HasAllLedgers() || (ledgers_due_us_ >= 0 && time_->NowUs() >= ledgers_due_us_));
}

template <class M>
void Recorder::WriteOwn(const std::string& channel, int64_t sequence, M* message) {
  message->header.auth = 0;  // It never travels on the bus.
  message->header.protocol = morphbus::header_t::PROTOCOL;
  message->header.tick = std::max<int64_t>(last_tick_, 0);
  message->header.sim_time_us = last_time_us_;
  message->header.sequence = sequence;
  message->header.model_hash = static_cast<int64_t>(described_.model_hash);
  message->header.program_hash = 0;
  std::vector<uint8_t> payload;
  bridge::Encode(*message, &payload);
  Write(ChannelNamed(channel), payload, options_.wall_clock(), false);
}

/// The description is the head of the log, whatever the bus does.
void Recorder::WriteInfo() {
  // The parts are numbered from 0, like the messages of any channel.
  int64_t sequence = 0;
  for (morphbus::info_part_t& part : bridge::SplitInfo(options_.description)) {
    WriteOwn(bridge::Channel(described_.run, "", Topic::kInfo), sequence++, &part);
  }
}

void Recorder::PublishInfo() {
  const std::string channel = bridge::Channel(described_.run, "", Topic::kInfo);
  for (morphbus::info_part_t& part : bridge::SplitInfo(options_.description)) {
    participant_->outbox().Send(channel, std::max<int64_t>(last_tick_, 0), last_time_us_, &part);
  }
}

void Recorder::EachSecond() {
  participant_->PublishHealth();
  // A recorder that is killed then loses a second at most.
  if (auto flushed = writer_->Flush(); !flushed && error_.empty()) error_ = flushed.error().message;
}

void Recorder::TakeTotals(const uint8_t* data, size_t size) {
  morphbus::totals_t totals;
  // The logger's own are of what was recorded.
  if (!bridge::Decode(data, size, {}, &totals) || totals.process == bridge::kLogProcess) return;
  // Of what is told again the higher counts hold.
  for (const morphbus::channel_total_t& total : totals.totals) {
    published_[total.channel] = std::max(published_[total.channel], total.count);
  }
}

void Recorder::Take(const bridge::LoggedMessage& message) {
  // A message that does not decode, cannot be of this run, or was had before, has no place in the
  // log.
  if (message.bad || message.refused || message.duplicate) return;
  const std::optional<bridge::ChannelName> name = bridge::ParseChannel(message.channel);
  // The description stands at the head of the log once; END is ours to write.
  if (!name || name->topic == Topic::kInfo || name->topic == Topic::kEnd) return;
  if (name->topic == Topic::kTotals) TakeTotals(message.data, message.size);
  // A ledger that came after the end is the process's last: nothing more need be waited for.
  if (name->topic == Topic::kHealth && name->process != bridge::kLogProcess) {
    ledgers_[std::string(name->process)] = participant_->complete();
  }
  // Messages outside the hash are written as they come.
  const int64_t now = options_.wall_clock();
  if (!bridge::IsHashed(name->topic)) {
    Write(ChannelNamed(message.channel), {message.data, message.data + message.size}, now, false);
    return;
  }
  // The latest tick heard of dates the messages that only the log gets.
  morphbus::header_t header;
  if (!bridge::DecodeHeader(message.data, message.size, &header)) return;
  Channels::value_type* channel = ChannelOf(message);
  if (header.tick > last_tick_) {
    last_tick_ = header.tick;
    last_time_us_ = header.sim_time_us;
  }
  // In real time no tick is ever known to be whole, so order of arrival is the order of the log.
  if (options_.realtime) {
    WriteNumbered(channel, header.sequence, {message.data, message.data + message.size}, now);
    return;
  }
  Hold(channel, message, name->topic, header, now);
}

Recorder::Channels::value_type* Recorder::ChannelNamed(std::string_view name) {
  const auto found = written_.find(name);
  if (found != written_.end()) return &*found;
  // A new channel may stand between known ones.
  in_order_ = false;
  return &*written_.emplace(std::string(name), Written()).first;
}

Recorder::Channels::value_type* Recorder::ChannelOf(const bridge::LoggedMessage& message) {
  // The index spares comparing names for the many messages of hashed channels.
  if (message.channel_index < 0) return ChannelNamed(message.channel);
  const auto index = static_cast<size_t>(message.channel_index);
  if (index >= by_index_.size()) by_index_.resize(index + 1, nullptr);
  if (by_index_[index] == nullptr) by_index_[index] = ChannelNamed(message.channel);
  return by_index_[index];
}

void Recorder::Hold(Channels::value_type* channel, const bridge::LoggedMessage& message,
                    Topic topic, const morphbus::header_t& header, int64_t timestamp_us) {
  // As many buffers as messages were ever held at a time, which the lockstep bounds.
  std::vector<uint8_t> payload;
  if (!spare_.empty()) {
    payload = std::move(spare_.back());
    spare_.pop_back();
  }
  payload.assign(message.data, message.data + message.size);
  // What ends the run comes behind all of its ticks, also behind one that is not whole.
  const int64_t tick = header.tick + (message.end ? 1 : 0);
  held_[tick].push_back({channel, topic, header.sequence, timestamp_us, std::move(payload)});
}

void Recorder::Sort(std::vector<Held>* tick) {
  // Names are compared once for all ticks: each channel then knows its place among them.
  if (!in_order_) {
    std::vector<Channels::value_type*> channels;
    for (Channels::value_type& channel : written_) channels.push_back(&channel);
    std::ranges::sort(channels, {}, &Channels::value_type::first);
    for (size_t i = 0; i < channels.size(); ++i) channels[i]->second.order = static_cast<int>(i);
    in_order_ = true;
  }
  // Topics stand in the order of their numbers: what was sensed, what was told, what was commanded.
  std::ranges::sort(*tick, {}, [](const Held& held) {
    return std::tuple(held.topic, held.channel->second.order, held.sequence);
  });
}

void Recorder::Release(int64_t complete_ticks) {
  while (!held_.empty() && held_.begin()->first < complete_ticks) {
    std::vector<Held>& tick = held_.begin()->second;
    Sort(&tick);
    for (Held& held : tick) {
      // What was written while this was held has later stamps; a log never steps back for that.
      Write(held.channel, held.payload, std::max(held.timestamp_us, last_stamp_us_), true);
      spare_.push_back(std::move(held.payload));
    }
    held_.erase(held_.begin());
  }
}

void Recorder::Write(Channels::value_type* channel, const std::vector<uint8_t>& payload,
                     int64_t timestamp_us, bool hashed) {
  Written& written = channel->second;
  written.hashed = hashed;
  ++written.count;
  written.hash.Update(payload.data(), payload.size());
  last_stamp_us_ = timestamp_us;
  // The first failure is kept: what fails after it only follows from it.
  if (auto result = writer_->Write(timestamp_us, channel->first, payload);
      !result && error_.empty()) {
    error_ = result.error().message;
  }
}

void Recorder::WriteNumbered(Channels::value_type* channel, int64_t sequence,
                             const std::vector<uint8_t>& payload, int64_t timestamp_us) {
  std::unique_ptr<ChannelStream>& numbers = channel->second.by_number;
  if (!numbers) numbers = std::make_unique<ChannelStream>();
  // The run's hash is over the messages in order of their numbers, though they are written as they
  // come.
  numbers->Take(sequence, payload);
  Write(channel, payload, timestamp_us, true);
}

/// Messages that the modules say they published, and the log does not have.
int64_t Recorder::CountLost(std::string* what) const {
  // Some are named; a large robot has thousands.
  constexpr int kNamed = 5;
  int64_t lost = 0;
  int channels = 0;
  for (const auto& [channel, count] : published_) {
    const auto found = written_.find(channel);
    const int64_t missing = count - (found == written_.end() ? 0 : found->second.count);
    if (missing <= 0) continue;
    lost += missing;
    if (++channels > kNamed) continue;
    *what += fmt::format("{}{} of {}", what->empty() ? "" : ", ", missing, channel);
  }
  if (channels > kNamed) {
    *what += fmt::format(", and some of {}", Counted(channels - kNamed, "more channel"));
  }
  return lost;
}

void Recorder::WriteEnd(const RecordSummary& summary,
                        const std::vector<bridge::ChannelTotal>& totals) {
  morphbus::log_end_t end;
  // The run's own facts come first, then the totals by which a reader checks the log.
  end.run = described_.run;
  end.open = described_.open;
  end.clean = summary.complete;
  end.reason = bridge::CutText(summary.reason, bridge::kLongestText);
  end.run_hash = summary.run_hash;
  end.num_ticks = participant_->complete_ticks();
  // The totals may be more than one message can count.
  constexpr size_t kMostTotals = 30'000;
  int64_t sequence = 0;
  size_t told = 0;
  do {
    end.channels.clear();
    for (; told < totals.size() && end.channels.size() < kMostTotals; ++told) {
      end.channels.push_back(totals[told]);
    }
    end.num_channels = static_cast<int16_t>(end.channels.size());
    WriteOwn(bridge::Channel(described_.run, "", Topic::kEnd), sequence++, &end);
  } while (told < totals.size());
}

Result<RecordSummary> Recorder::Finish(const std::string& interrupted) {
  // What is held of ticks that never became whole is still part of the run.
  Release(std::numeric_limits<int64_t>::max());
  // The logger's own last ledger: it hears nothing of its own any more.
  participant_->CountBusLosses();
  morphbus::health_t health =
      bridge::MakeHealth(std::string(bridge::kLogProcess), participant_->ledger());
  const std::string own = bridge::Channel(described_.run, bridge::kLogProcess, Topic::kHealth);
  WriteOwn(own, participant_->outbox().count(own), &health);
  // What END vouches for: count and hash of every channel, and the hash of the run.
  std::vector<bridge::ChannelTotal> totals;
  std::vector<bridge::ChannelTotal> hashed;
  for (auto& [channel, written] : written_) {
    totals.push_back(
        {channel, written.count, static_cast<int64_t>(written.hash.Digest()), written.hashed});
    if (written.by_number) {
      written.by_number->Finish();
      totals.back().count = written.by_number->count();
      totals.back().chained_hash = static_cast<int64_t>(written.by_number->hash());
    }
    if (written.hashed) hashed.push_back(totals.back());
  }
  std::ranges::sort(totals, {}, &bridge::ChannelTotal::channel);
  RecordSummary summary;
  summary.run_hash = bridge::RunHash(std::move(hashed));
  // Why the run ended: the recorder was stopped, it failed, or the simulator said so.
  summary.reason = !interrupted.empty()             ? interrupted
                   : !participant_->error().empty() ? participant_->error()
                                                    : participant_->end_reason();
  std::string missing;
  summary.lost = CountLost(&missing);
  if (summary.lost > 0) summary.reason += "; not in the log: " + missing;
  // In real time loss is counted, and no failure.
  summary.complete = interrupted.empty() && participant_->complete() &&
                     participant_->error().empty() && error_.empty() &&
                     (options_.realtime || summary.lost == 0);
  // END goes last. A log that could not be written keeps its name for unfinished ones.
  if (error_.empty()) WriteEnd(summary, totals);
  if (!error_.empty()) {
    // Nobody can look at what is in memory, nor at a file whose name is gone.
    const bool kept = !options_.in_memory && writer_->IsThere();
    return Fail(error_ + (kept ? "; the log up to there is " + writer_->partial_path()
                          : options_.in_memory ? ""
                                               : "; nothing is left of the log"));
  }
  if (auto r = writer_->Close(); !r) return tl::unexpected(r.error());
  summary.path = writer_->path();
  summary.events = writer_->num_events();
  summary.bytes = writer_->num_bytes();
  return summary;
}

}  // namespace morphbus::logger
