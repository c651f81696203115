// The reading half of logger/log/event_log.h: framing, lookahead and resynchronisation.
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <limits>

#include "compiler/base/big_endian.h"
#include "logger/log/event_log.h"

namespace morphbus::logger {
namespace {

/// The file is read in pieces of this size, unless an event is larger.
constexpr size_t kReadBufferBytes = size_t{1} << 20;
/// So many findings are kept; all are counted.
constexpr size_t kMaxFindings = 1000;
constexpr size_t kLookaheadBytes = 12;  ///< Magic and number of the next event.
/// Stands for "whatever its number" where an event is looked for.
constexpr int64_t kAnyNumber = -1;
/// The wall clock may step back by so much, as when it is set by the network, and be no finding.
constexpr int64_t kBackwardStepUs = 1'000'000;
/// A pause of more than an hour between two events is told, since it may be a damaged timestamp.
constexpr int64_t kForwardStepUs = 3'600'000'000;
/// Behind an event that seems damaged, the next sound one is looked for so far at most before it is
/// decided: a compressed log keeps all of it in memory.
constexpr uint64_t kDecisionBytes = uint64_t{64} << 20;
/// For a search through all that follows.
constexpr uint64_t kToTheEnd = std::numeric_limits<uint64_t>::max();
constexpr uint8_t kMagicBytes[4] = {0xED, 0xA1, 0xDA, 0x01};

/// Event numbers of a damaged file may be anything: they wrap instead of overflowing.
int64_t Shift(int64_t number, int64_t by) {
  return static_cast<int64_t>(static_cast<uint64_t>(number) + static_cast<uint64_t>(by));
}

/// Set by WatchReading.
ReadingWatcher g_watcher;

}  // namespace

void WatchReading(ReadingWatcher watcher) { g_watcher = std::move(watcher); }

std::string EventLogReader::WhyNoLog() const {
  if (num_events_ > 0 || file_size() == 0) return "";
  return path_ + " holds no sound event: it is no log, or nothing of it is left";
}

void EventLogReader::TellWatcher() {
  if (position_ < tell_at_) return;
  tell_at_ = position_ + kTellBytes;
  if (!g_watcher) return;
  // Of a compressed log nobody knows the length, but how much of the file has been taken.
  const uint64_t read = compressed() ? bytes_->file_bytes_read() : position_;
  const auto all = static_cast<double>(std::max<uint64_t>(file_size(), 1));
  g_watcher(path_, std::min(1.0, static_cast<double>(read) / all));
}

Result<std::unique_ptr<EventLogReader>> EventLogReader::Open(const std::string& path) {
  auto bytes = LogBytes::Open(path);
  if (!bytes) return tl::unexpected(bytes.error());
  return std::unique_ptr<EventLogReader>(new EventLogReader(path, std::move(*bytes)));
}

EventLogReader::EventLogReader(std::string path, std::unique_ptr<LogBytes> bytes)
    : path_(std::move(path)), bytes_(std::move(bytes)) {
  // A small plain log needs no large buffer; how large a compressed one is, nobody knows yet.
  const uint64_t known = compressed() ? kReadBufferBytes : log_size();
  buffer_.resize(std::max<size_t>(std::min<uint64_t>(kReadBufferBytes, known), 64));
}

EventLogReader::~EventLogReader() = default;

void EventLogReader::Seek(uint64_t offset) {
  position_ = std::min(offset, bytes_->Extend(offset));
  expected_number_.reset();
  last_timestamp_us_.reset();
  known_good_.reset();
}

/// The bytes [offset, offset + size) in the buffer; null if the file does not have them. Bytes
/// before `offset` may leave the buffer.
const uint8_t* EventLogReader::Need(uint64_t offset, size_t size) {
  if (offset >= buffer_begin_ && offset + size <= buffer_begin_ + buffer_size_) {
    return buffer_.data() + (offset - buffer_begin_);
  }
  if (!Reaches(offset + size)) return nullptr;
  // Keep what is already there of the wanted bytes at the front of the buffer.
  if (offset >= buffer_begin_ && offset < buffer_begin_ + buffer_size_) {
    const size_t begin = offset - buffer_begin_;
    std::memmove(buffer_.data(), buffer_.data() + begin, buffer_size_ - begin);
    buffer_size_ -= begin;
  } else {
    buffer_size_ = 0;
  }
  buffer_begin_ = offset;
  if (size > buffer_.size()) buffer_.resize(size + kLookaheadBytes);
  // Fill the buffer; a file that shrank meanwhile gives less than it promised.
  buffer_size_ += bytes_->ReadAt(buffer_begin_ + buffer_size_, buffer_.data() + buffer_size_,
                                 buffer_.size() - buffer_size_);
  bytes_->Forget(offset);
  return buffer_size_ < size ? nullptr : buffer_.data();
}

/// Copies up to `size` bytes at `offset` without moving the buffer; returns how many there were.
size_t EventLogReader::Peek(uint64_t offset, uint8_t* out, size_t size) {
  if (offset >= buffer_begin_ && offset + size <= buffer_begin_ + buffer_size_) {
    std::memcpy(out, buffer_.data() + (offset - buffer_begin_), size);
    return size;
  }
  return bytes_->ReadAt(offset, out, size);
}

EventLogReader::Header EventLogReader::ParseHeader(const uint8_t* bytes) {
  return {LoadBigEndian<uint32_t>(bytes), static_cast<int64_t>(LoadBigEndian<uint64_t>(bytes + 4)),
          static_cast<int64_t>(LoadBigEndian<uint64_t>(bytes + 12)),
          static_cast<int32_t>(LoadBigEndian<uint32_t>(bytes + 20)),
          static_cast<int32_t>(LoadBigEndian<uint32_t>(bytes + 24))};
}

std::optional<EventLogReader::Header> EventLogReader::HeaderAt(uint64_t offset) {
  uint8_t bytes[kEventHeaderBytes];
  if (Peek(offset, bytes, sizeof bytes) != sizeof bytes) return std::nullopt;
  return ParseHeader(bytes);
}

/// True if a header at `offset` could be true: magic, lengths, and its event lies within the file.
bool EventLogReader::Plausible(const Header& header, uint64_t offset) {
  return header.magic == kEventMagic && header.channel_size > 0 &&
         header.channel_size <= static_cast<int>(kMaxChannelBytes) && header.data_size >= 0 &&
         header.data_size <= static_cast<int>(kMaxDataBytes) &&
         Reaches(offset + header.event_size());
}

/// True if at `end` the log ends, or what there is of it is a magic.
bool EventLogReader::FollowedWell(uint64_t end) {
  uint8_t bytes[4];
  const size_t n = Peek(end, bytes, sizeof bytes);
  return std::memcmp(bytes, kMagicBytes, n) == 0;
}

bool EventLogReader::IsCandidate(uint64_t offset, int64_t only_number) {
  const std::optional<Header> header = HeaderAt(offset);
  if (!header || !Plausible(*header, offset)) return false;
  if (only_number != kAnyNumber && header->number != only_number) return false;
  return FollowedWell(offset + header->event_size());
}

/// First offset in [begin, limit) at which a sound event begins.
std::optional<uint64_t> EventLogReader::Scan(uint64_t begin, uint64_t limit, int64_t only_number) {
  constexpr size_t kChunk = 65536;
  if (begin >= limit) return std::nullopt;
  std::vector<uint8_t> chunk(std::min<uint64_t>(kChunk - 3, limit - begin) + 3);
  // Look for the first byte of a magic, chunk by chunk; chunks overlap by three bytes, so that a
  // magic across their border is found.
  while (begin < limit) {
    const size_t n = Peek(begin, chunk.data(), chunk.size());
    if (n < sizeof kMagicBytes) return std::nullopt;
    const uint8_t* p = chunk.data();
    const uint8_t* end = chunk.data() + n - 3;
    while ((p = static_cast<const uint8_t*>(
                std::memchr(p, kMagicBytes[0], static_cast<size_t>(end - p)))) != nullptr) {
      const uint64_t offset = begin + static_cast<uint64_t>(p - chunk.data());
      if (offset >= limit) return std::nullopt;
      if (std::memcmp(p, kMagicBytes, 4) == 0 && IsCandidate(offset, only_number)) return offset;
      if (++p >= end) break;
    }
    begin += n - 3;
    // What was searched to the end of the log is not looked at again.
    if (limit == kToTheEnd) bytes_->Forget(begin);
  }
  return std::nullopt;
}

void EventLogReader::Report(LogFinding::Kind kind, uint64_t begin, uint64_t end, std::string what) {
  ++num_findings_;
  LogFinding finding{kind, begin, end, std::move(what)};
  damaged_ = damaged_ || finding.is_damage();
  if (findings_.size() < kMaxFindings) findings_.push_back(std::move(finding));
}

/// Called when no event can be read at position_: reports why and moves to the next sound one.
void EventLogReader::SkipDamage() {
  const uint64_t begin = position_;
  uint8_t bytes[kEventHeaderBytes];
  const size_t n = Peek(begin, bytes, sizeof bytes);
  // A lookahead may already know where the next sound event begins.
  const std::optional<uint64_t> next =
      known_good_ ? known_good_ : Scan(begin + 1, kToTheEnd, kAnyNumber);
  known_good_.reset();
  // Reading goes on at the next sound event; the numbers on both sides tell how many were lost.
  if (next) {
    int64_t lost = 0;
    const std::optional<Header> header = HeaderAt(*next);
    if (header && expected_number_) lost = Shift(header->number, -*expected_number_);
    Report(LogFinding::Kind::kDamaged, begin, *next,
           fmt::format(
               "bytes {} to {} are no event{}", begin, *next,
               lost > 0 ? fmt::format(" ({} lost, number {} on)", lost, *expected_number_) : ""));
    expected_number_.reset();
    position_ = *next;
    return;
  }
  // No sound event follows. A file that ends with the beginning of an event was cut.
  const uint64_t log_end = log_size();
  bool cut = std::memcmp(bytes, kMagicBytes, std::min<size_t>(n, 4)) == 0;
  if (cut && n == kEventHeaderBytes) {
    const uint32_t channel_size = LoadBigEndian<uint32_t>(bytes + 20);
    cut = channel_size > 0 && channel_size <= kMaxChannelBytes &&
          LoadBigEndian<uint32_t>(bytes + 24) <= kMaxDataBytes;
  }
  if (cut) {
    Report(LogFinding::Kind::kTruncated, begin, log_end,
           fmt::format("the {} ends at byte {} inside the event that begins at byte {}",
                       compressed() ? "log" : "file", log_end, begin));
  } else {
    Report(LogFinding::Kind::kDamaged, begin, log_end,
           fmt::format("bytes {} to {}, the end of the {}, are no event", begin, log_end,
                       compressed() ? "log" : "file"));
  }
  position_ = log_end;
}

/// The event at position_ is plausible by itself, but is not followed by its successor. False if it
/// is the one that is damaged; then position_ moves on.
bool EventLogReader::IsSound(const Header& header) {
  const uint64_t begin = position_;
  const uint64_t end = begin + header.event_size();
  const int64_t successor = Shift(header.number, 1);
  std::optional<uint64_t> next;
  if (FollowedWell(end)) {
    // Wrong lengths may span whole events and end at a magic: then the successor is inside.
    next = Scan(begin + 4, end, successor);
    if (!next) return true;
  } else {
    next = Scan(begin + 4, end + kDecisionBytes, kAnyNumber);
    const std::optional<Header> found = next ? HeaderAt(*next) : std::nullopt;
    if (!next) return true;  // What follows is damaged to the end of the file.
    if (*next >= end && found->number != successor) {
      known_good_ = *next;
      return true;
    }
  }
  // The event claims bytes in which a sound one begins: it is the damaged one.
  Report(LogFinding::Kind::kDamaged, begin, *next,
         fmt::format("the event at byte {} (number {}) is damaged, reading goes on at byte {}",
                     begin, header.number, *next));
  expected_number_.reset();
  position_ = *next;
  return false;
}

void EventLogReader::CheckNumber(const Header& header, uint64_t end) {
  // A number that is not the expected one is itself wrong, or tells what became of the events
  // between.
  if (expected_number_ && header.number != *expected_number_) {
    const int64_t expected = *expected_number_;
    uint8_t ahead[kLookaheadBytes];
    // If the next event has the number after the expected one, only this number is wrong.
    const bool has_next = Peek(end, ahead, sizeof ahead) == sizeof ahead;
    if (has_next &&
        static_cast<int64_t>(LoadBigEndian<uint64_t>(ahead + 4)) == Shift(expected, 1)) {
      Report(LogFinding::Kind::kNumber, position_, position_ + kEventHeaderBytes,
             fmt::format("the event at byte {} has number {} where {} belongs", position_,
                         header.number, expected));
      expected_number_ = Shift(expected, 1);
      return;
    }
    if (header.number == 0) {
      Report(LogFinding::Kind::kRestart, position_, position_,
             fmt::format("event numbers start again at byte {}", position_));
    } else {
      Report(LogFinding::Kind::kMissing, position_, position_,
             fmt::format("event numbers jump from {} to {} at byte {}", Shift(expected, -1),
                         header.number, position_));
    }
  }
  expected_number_ = Shift(header.number, 1);
}

void EventLogReader::CheckClock(const Header& header) {
  // The step is taken with an overflow check, since a damaged timestamp may be any number.
  const int64_t now = header.timestamp_us;
  const int64_t last = last_timestamp_us_.value_or(now);
  last_timestamp_us_ = now;
  int64_t step = 0;
  const bool overflow = __builtin_sub_overflow(now, last, &step);
  if (!overflow && step >= -kBackwardStepUs && step <= kForwardStepUs) return;
  Report(LogFinding::Kind::kClockStep, position_, position_,
         fmt::format("the wall clock steps from {} to {} us at byte {}", last, now, position_));
}

void EventLogReader::CheckCompression(uint64_t end) {
  std::deque<CompressionFinding>& findings = bytes_->findings();
  while (!findings.empty() && findings.front().offset < end) {
    const CompressionFinding& finding = findings.front();
    Report(finding.truncated ? LogFinding::Kind::kTruncated : LogFinding::Kind::kDamaged,
           finding.offset, finding.offset, finding.what);
    findings.pop_front();
  }
}

bool EventLogReader::Next(LogEvent* event) {
  // Every round hands out an event, or passes over damage and moves position_ on.
  while (Reaches(position_ + 1)) {
    CheckCompression(position_);
    // Bytes that can be no event are skipped up to the next one.
    const uint8_t* p = Need(position_, kEventHeaderBytes);
    const Header header = p == nullptr ? Header{} : ParseHeader(p);
    if (p == nullptr || !Plausible(header, position_)) {
      SkipDamage();
      TellWatcher();
      continue;
    }
    const size_t channel_size = static_cast<size_t>(header.channel_size);
    const size_t size = header.event_size();
    const uint64_t end = position_ + size;
    const size_t ahead =
        std::min<uint64_t>(kLookaheadBytes, bytes_->Extend(end + kLookaheadBytes) - end);
    p = Need(position_, size + ahead);
    if (p == nullptr) continue;  // The file shrank; look at it again.
    // An event whose successor follows at once is sound without a further look.
    const bool sound =
        ahead == kLookaheadBytes && LoadBigEndian<uint32_t>(p + size) == kEventMagic &&
        static_cast<int64_t>(LoadBigEndian<uint64_t>(p + size + 4)) == Shift(header.number, 1);
    if (!sound) {
      if (!IsSound(header)) continue;
      p = Need(position_, size + ahead);
      if (p == nullptr) continue;
    }
    // The number says whether events are missing before this one.
    CheckNumber(header, end);
    // The event is accepted: hand it out and move on.
    CheckClock(header);
    event->number = header.number;
    event->timestamp_us = header.timestamp_us;
    event->channel = {reinterpret_cast<const char*>(p + kEventHeaderBytes), channel_size};
    event->data = {p + kEventHeaderBytes + channel_size, static_cast<size_t>(header.data_size)};
    event->offset = position_;
    position_ = end;
    ++num_events_;
    TellWatcher();
    return true;
  }
  CheckCompression(kToTheEnd);
  return false;
}

}  // namespace morphbus::logger
