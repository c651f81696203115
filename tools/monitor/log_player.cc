#include "tools/monitor/log_player.h"

#include <algorithm>
#include <cmath>

#include "bridge/observe/run_message.h"
#include "bridge/wire/channels.h"

namespace morphbus::tools {

LogPlayer::LogPlayer(std::shared_ptr<const LogIndex> index,
                     std::unique_ptr<logger::OrderedLogReader> reader, double now_s)
    : index_(std::move(index)),
      reader_(std::move(reader)),
      clock_channel_(bridge::Channel(index_->run->run, "", bridge::Topic::kClock)),
      converter_(index_->checkpoints.front().converter),
      until_us_(index_->end_us),
      anchor_s_(now_s),
      anchor_us_(index_->begin_us) {}

Result<std::unique_ptr<LogPlayer>> LogPlayer::Create(std::shared_ptr<const LogIndex> index,
                                                     double now_s) {
  auto reader = logger::OrderedLogReader::Open(index->path, index->run->run, index->disorder);
  if (!reader) return Fail(reader.error().message);
  return std::unique_ptr<LogPlayer>(new LogPlayer(std::move(index), std::move(*reader), now_s));
}

bool LogPlayer::Peek() {
  if (peeked_) return true;
  if (!reader_->Next(&event_)) return false;
  peeked_ = true;
  // A tick begins with its CLOCK; all that follows is due with it.
  if (event_.channel != clock_channel_) return true;
  const Result<bridge::RunMessage> clock =
      bridge::OpenMessage(event_.channel, event_.data.data(), event_.data.size());
  // A damaged CLOCK may tell any time; time never goes back while a log plays.
  if (clock) {
    event_time_us_ = std::clamp(clock->header.sim_time_us, event_time_us_, index_->end_us);
  }
  return true;
}

void LogPlayer::SendCounts(const bridge::OutwardSink& sink) {
  const auto& counts = index_->counts;
  const auto later =
      std::upper_bound(counts.begin(), counts.end(), converter_.time_us(),
                       [](int64_t time_us, const auto& entry) { return time_us < entry.first; });
  const auto passed = later - counts.begin();
  if (passed <= next_count_) return;
  next_count_ = passed;
  const auto& [time_us, bytes] = counts[passed - 1];
  sink(bridge::OutwardTopic::kChannels, time_us * 1000, bytes);
}

void LogPlayer::TakeEvent(const bridge::OutwardSink& sink) {
  converter_.Take(event_.channel, event_.data.data(), event_.data.size(), sink);
  peeked_ = false;
  if (event_.channel == clock_channel_) SendCounts(sink);
}

bool LogPlayer::Advance(double now_s, int most, const bridge::OutwardSink& sink) {
  // What never changes is sent before the first event.
  if (!begun_) {
    begun_ = true;
    converter_.Begin(sink);
  }
  if (!playing_) return false;
  // In time with the wall, only what is due by now.
  const bool paced = speed_ > 0 && !stepping_;
  const double due_us =
      static_cast<double>(anchor_us_) + (now_s - anchor_s_) * std::max(speed_, 0.0) * 1e6;
  for (int i = 0; i < most; ++i) {
    const bool more = Peek();
    if (!more) converter_.Finish(sink);
    // The event that was looked at stays for when it goes on.
    if (!more || event_time_us_ > until_us_) {
      Play(false, now_s);
      return false;
    }
    if (paced && static_cast<double>(event_time_us_) > due_us) return false;
    TakeEvent(sink);
  }
  return true;
}

void LogPlayer::Seek(int64_t time_us, double now_s, const bridge::OutwardSink& sink) {
  time_us = std::clamp(time_us, index_->begin_us, index_->end_us);
  // The last checkpoint that is earlier, so that what every tick tells is told of that time; the
  // rest of what it knows already is told by Repeat.
  const auto later = std::lower_bound(
      index_->checkpoints.begin(), index_->checkpoints.end(), time_us,
      [](const LogCheckpoint& checkpoint, int64_t t) { return checkpoint.time_us < t; });
  const LogCheckpoint& from = later == index_->checkpoints.begin() ? *later : *(later - 1);
  converter_ = from.converter;
  reader_->Seek(from.offset);
  peeked_ = false;
  // From the checkpoint on the converter knows all that came before.
  event_time_us_ = from.time_us;
  begun_ = true;
  next_count_ = 0;
  converter_.Begin(sink);
  // Of what leads there only the last message of each topic is sent.
  struct Last {
    int64_t time_ns = 0;
    std::string bytes;
  };
  std::map<bridge::OutwardTopic, Last> last;
  const bridge::OutwardSink keep = [&](bridge::OutwardTopic topic, int64_t time_ns,
                                       const std::string& bytes) {
    if (bridge::RowOf(topic).is_state) last[topic] = {time_ns, bytes};
  };
  // From the checkpoint to the time itself.
  while (Peek() && event_time_us_ <= time_us) TakeEvent(keep);
  converter_.Repeat(keep);
  next_count_ = 0;
  SendCounts(keep);
  for (const auto& [topic, message] : last) sink(topic, message.time_ns, message.bytes);
  stepping_ = false;
  anchor_s_ = now_s;
  anchor_us_ = time_us;
}

void LogPlayer::Play(bool playing, double now_s) {
  playing_ = playing;
  if (!playing) stepping_ = false;
  anchor_s_ = now_s;
  anchor_us_ = converter_.time_us();
  // Beyond the place where it paused, it goes on to the end.
  if (playing && event_time_us_ > until_us_) until_us_ = index_->end_us;
}

void LogPlayer::SetSpeed(double speed, double now_s) {
  // From here on time is counted anew, so that a change of speed makes no leap.
  speed_ = speed;
  anchor_s_ = now_s;
  anchor_us_ = converter_.time_us();
}

void LogPlayer::Step(int64_t ticks, double now_s) {
  const int64_t tick_us = std::max<int64_t>(1, index_->run->tick_us);
  // In a log nobody steps further than it is long.
  ticks = std::clamp<int64_t>(ticks, 1, (index_->end_us - index_->begin_us) / tick_us + 1);
  Play(true, now_s);
  until_us_ = converter_.time_us() + ticks * tick_us;
  stepping_ = true;
}

}  // namespace morphbus::tools
