#include "logger/log/ordered_log.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "bridge/observe/run_message.h"

namespace morphbus::logger {

Result<std::unique_ptr<OrderedLogReader>> OrderedLogReader::Open(const std::string& path,
                                                                 const std::string& run) {
  auto scan = Open(path, run, 0);
  if (!scan || run.empty()) return scan;
  // The file is read once through, without holding anything: by how much its messages are late says
  // how many ticks must be held afterwards.
  int64_t disorder = 0;
  LogEvent event;
  while ((*scan)->Next(&event)) {
    const int64_t tick = std::get<0>((*scan)->PlaceOf(event));
    disorder = std::max(disorder, (*scan)->newest_ - tick);
  }
  // What was found belongs to the reading that follows.
  return Open(path, run, disorder);
}

Result<std::unique_ptr<OrderedLogReader>> OrderedLogReader::Open(const std::string& path,
                                                                 const std::string& run,
                                                                 int64_t disorder) {
  auto file = EventLogReader::Open(path);
  if (!file) return tl::unexpected(file.error());
  return std::unique_ptr<OrderedLogReader>(new OrderedLogReader(std::move(*file), run, disorder));
}

OrderedLogReader::Place OrderedLogReader::PlaceOf(const LogEvent& event) {
  constexpr int kBehindAllTopics = std::numeric_limits<int>::max();
  const auto message = bridge::OpenMessage(event.channel, event.data.data(), event.data.size());
  // What is no message of a tick stays beside the messages that it came with.
  if (!message || message->name.run != run_ || !bridge::IsHashed(message->name.topic)) {
    return {newest_, kBehindAllTopics, "", 0, event.offset};
  }
  const morphbus::header_t& header = message->header;
  // A tick that lies far behind is the beginning of another recording of the run, and no late
  // message.
  if (header.tick > newest_ || header.tick < newest_ - kMostTicks) newest_ = header.tick;
  return {header.tick, static_cast<int>(message->name.topic), std::string(event.channel),
          header.sequence, event.offset};
}

bool OrderedLogReader::Next(LogEvent* event) {
  // Our own logs are in order, and are handed on as they are.
  if (disorder_ == 0) return file_->Next(event);
  while (true) {
    // Nothing of a tick comes any more once the file is so far ahead, or begins anew.
    if (!held_.empty()) {
      const int64_t tick = std::get<0>(held_.begin()->first);
      if (ended_ || tick < newest_ - disorder_ || tick > newest_) break;
    }
    if (ended_) return false;
    if (!file_->Next(event)) {
      ended_ = true;
      continue;
    }
    held_.emplace(
        PlaceOf(*event),
        Held{*event, std::string(event->channel), {event->data.begin(), event->data.end()}});
  }
  // The event's views must stay valid until the next call, so that its bytes are kept until then.
  given_ = std::move(held_.begin()->second);
  held_.erase(held_.begin());
  *event = given_.event;
  event->channel = given_.channel;
  event->data = given_.data;
  return true;
}

void OrderedLogReader::Seek(uint64_t offset) {
  file_->Seek(offset);
  held_.clear();
  newest_ = 0;
  ended_ = false;
}

uint64_t OrderedLogReader::position() const {
  uint64_t first = file_->position();
  for (const auto& [place, held] : held_) first = std::min(first, held.event.offset);
  return first;
}

}  // namespace morphbus::logger
