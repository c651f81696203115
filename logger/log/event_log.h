#pragma once
// LCM's event-log file format, byte for byte, so that LCM's stock tools read what we write and we
// read what they write. A file is a row of events, nothing before, between or after them:
//
//   offset  size  field (all integers big-endian)
//        0     4  magic 0xEDA1DA01
//        4     8  event number, from 0, one more each event
//       12     8  timestamp, microseconds since 1970 (wall clock)
//       20     4  length of the channel name, 1..999
//       24     4  length of the data, 0..2^28
//       28        channel name without a NUL, then the data
//
// Concatenated logs are a readable log (numbers start again at 0).

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "compiler/base/result.h"
#include "logger/log/log_bytes.h"

namespace morphbus::logger {

/// The four bytes with which every event begins.
inline constexpr uint32_t kEventMagic = 0xEDA1DA01;
/// Size of an event's header: the table above up to the channel's name.
inline constexpr size_t kEventHeaderBytes = 28;
/// LCM's own reader refuses names of 1000 bytes and more.
inline constexpr size_t kMaxChannelBytes = 999;
/// LCM's largest message.
inline constexpr size_t kMaxDataBytes = size_t{1} << 28;

/// One event as it stands in a file. `channel` and `data` point into the reader's buffer and are
/// valid until its next call.
struct LogEvent {
  /// From 0, one more each event of a sound file; a damaged file may hold any number.
  int64_t number = 0;
  /// Wall clock at recording, microseconds since 1970; never sim time.
  int64_t timestamp_us = 0;
  /// Name of the LCM channel, 1..999 bytes; a damaged file may hold any bytes.
  std::string_view channel;
  /// The message as it was on the bus.
  std::span<const uint8_t> data;
  /// Byte of the file at which the event's header begins.
  uint64_t offset = 0;
};

/// Appends the bytes of one event to `out`: header, channel name, data. `timestamp_us` is wall
/// clock, microseconds since 1970. The channel must have 1..999 bytes, the data at most 2^28
/// (checked: both are the caller's doing).
void AppendEvent(int64_t number, int64_t timestamp_us, std::string_view channel,
                 std::span<const uint8_t> data, std::vector<uint8_t>* out);

/// Writes a log. While it is being written the file is called PATH.partial and is a readable log
/// at every flush; Close() gives it its name. A writer that is destroyed without Close(), or whose
/// process is killed, leaves PATH.partial: an interrupted run keeps its log.
class EventLogWriter {
 public:
  /// Opens PATH.partial, replacing an earlier one; an earlier PATH stays until Close(). Fails if
  /// the file cannot be written, another process is writing it, or PATH or PATH.partial is
  /// something else than a file.
  static Result<std::unique_ptr<EventLogWriter>> Create(const std::string& path);
  /// Opens the file PATH, which must be there, and empties it. It has this name from the start, and
  /// is not waited for at Close(): for a file in memory. Fails if it cannot be written.
  static Result<std::unique_ptr<EventLogWriter>> CreateInMemory(const std::string& path);
  /// Flushes what it can and leaves PATH.partial, unless Close() or Discard() came first.
  ~EventLogWriter();
  EventLogWriter(const EventLogWriter&) = delete;
  EventLogWriter& operator=(const EventLogWriter&) = delete;

  /// Appends an event with the next event number; `timestamp_us` is wall clock, microseconds since
  /// 1970. The event stays in a buffer of 1 MiB until that is full or flushed. Fails if the log is
  /// closed or a flush that became due fails.
  Result<void> Write(int64_t timestamp_us, std::string_view channel, std::span<const uint8_t> data);
  /// Hands everything to the operating system. Fails also if somebody removed, replaced or cut
  /// PATH.partial meanwhile: then what was written is not there any more. After a failure nothing
  /// more is written, and Write(), Flush() and Close() fail with its reason.
  Result<void> Flush();
  /// Flushes, waits until the disk has everything, and renames PATH.partial to PATH. Nothing can be
  /// written after. If any of it fails, the file keeps its partial name.
  Result<void> Close();
  /// Gives the log up: removes PATH.partial. Nothing can be written after.
  void Discard();

  /// The name that the log gets at Close().
  [[nodiscard]] const std::string& path() const { return path_; }
  /// Where the bytes are until Close(): PATH.partial, or PATH of a file in memory.
  [[nodiscard]] const std::string& partial_path() const { return partial_path_; }
  /// Whether PATH.partial is still the file that is being written.
  [[nodiscard]] bool IsThere() const;
  /// Events written, those in the buffer included.
  [[nodiscard]] int64_t num_events() const { return next_number_; }
  /// Bytes of these events.
  [[nodiscard]] uint64_t num_bytes() const { return num_bytes_; }

 private:
  EventLogWriter(std::string path, std::string partial_path, int fd);
  /// Whether PATH.partial is still the file that is being written, with all that was written to it.
  [[nodiscard]] Result<void> CheckFile() const;

  std::string path_;
  std::string partial_path_;
  std::string name_;  ///< What errors of writing call it.
  /// The open and locked PATH.partial; -1 once closed or discarded.
  int fd_ = -1;
  int64_t next_number_ = 0;
  uint64_t num_bytes_ = 0;
  /// Bytes of num_bytes_ that were handed to the operating system.
  uint64_t flushed_bytes_ = 0;
  /// Whole events that wait for the next flush.
  std::vector<uint8_t> buffer_;
  /// Why the first flush that failed did; empty while none has.
  std::string error_;
};

/// Something about a log's framing that a reader should know.
struct LogFinding {
  /// What was found; docs/log.md lists by what each kind is noticed.
  enum class Kind {
    kDamaged,    ///< Bytes that are no event; reading goes on at `end`.
    kTruncated,  ///< The file ends inside an event.
    kPayload,    ///< The event is whole, its message does not fit its CRC.
    kNumber,     ///< One event's number is wrong, its neighbours' are right.
    kMissing,    ///< Event numbers jump: events were taken out.
    kRestart,    ///< Numbers start again at 0: logs were concatenated. No damage.
    kClockStep,  ///< The timestamp stepped back over 1 s or ahead over 1 h. No damage.
  };
  Kind kind = Kind::kDamaged;
  /// The place in the file, bytes [begin, end); empty for a finding between two events.
  uint64_t begin = 0;
  uint64_t end = 0;
  std::string what;  ///< One sentence with the offsets, for people.

  /// True if the file is not as it was written. False for kRestart and kClockStep, which occur in
  /// sound logs.
  [[nodiscard]] bool is_damage() const {
    return kind != Kind::kRestart && kind != Kind::kClockStep;
  }
};

/// How far a reader has come: its log's path, and how much of the file it has read, 0…1.
using ReadingWatcher = std::function<void(const std::string& path, double part)>;
/// Has every EventLogReader of this process tell `watcher` about once a MiB, in the thread that
/// reads; null: nobody. There is one watcher at a time, set while no log is being read.
void WatchReading(ReadingWatcher watcher);

/// Reads a log front to back with one buffer. Never gives up on damage: it looks ahead to where the
/// next sound event begins, reports the bytes between, and goes on, so that one wrong byte costs at
/// most one event and never its neighbours. Memory is bounded by the largest event in the file.
///
/// A log that was compressed with zstd is read as well, whatever its name (LogBytes). All offsets
/// are those of the decompressed log; wrong bytes of the compressed file cost the rest of the frame
/// that they are in. Looking ahead for the end of damage takes at most some 600 MB then.
class EventLogReader {
 public:
  /// Opens a regular file; a pipe or device is refused at once. An empty file is a log without
  /// events.
  static Result<std::unique_ptr<EventLogReader>> Open(const std::string& path);
  ~EventLogReader();
  EventLogReader(const EventLogReader&) = delete;
  EventLogReader& operator=(const EventLogReader&) = delete;

  /// Reads the next sound event into `event`. Returns false at the end of the file, or where the
  /// operating system could not read on (io_error()); findings() then tell what was passed over.
  bool Next(LogEvent* event);

  /// Reads on at `offset`, which must be 0 or where an event begins; findings are kept. Backwards
  /// in a compressed log, that decompresses everything before `offset` once more.
  void Seek(uint64_t offset);

  /// What was found so far, in file order. At most 1000 are kept, so that a file full of damage
  /// cannot fill the memory; num_findings() counts all.
  [[nodiscard]] const std::vector<LogFinding>& findings() const { return findings_; }
  [[nodiscard]] int64_t num_findings() const { return num_findings_; }
  /// True if any finding so far is damage.
  [[nodiscard]] bool damaged() const { return damaged_; }
  /// Size of the file on the disk when it was opened, in bytes.
  [[nodiscard]] uint64_t file_size() const { return bytes_->file_size(); }
  /// Bytes of the log itself, as far as they are known: decompressed, if the file is compressed;
  /// fewer than the file's if that shrank while it was read.
  [[nodiscard]] uint64_t log_size() const { return bytes_->Extend(0); }
  /// Events that Next has read, Seek or not.
  [[nodiscard]] int64_t num_events() const { return num_events_; }
  /// Why the file holds nothing of a log, for a file that has bytes and was read to its end; empty
  /// if it holds an event.
  [[nodiscard]] std::string WhyNoLog() const;
  /// Whether the file was compressed with zstd.
  [[nodiscard]] bool compressed() const { return bytes_->compressed(); }
  /// The byte at which the next event is looked for.
  [[nodiscard]] uint64_t position() const { return position_; }
  /// Set if the operating system could not read the file to its end.
  [[nodiscard]] const std::string& io_error() const { return bytes_->io_error(); }

 private:
  /// The fixed part of an event as the file has it, in host byte order and unchecked: signed, so
  /// that absurd lengths show as negative ones.
  struct Header {
    uint32_t magic = 0;
    int64_t number = 0;
    int64_t timestamp_us = 0;
    int32_t channel_size = 0;
    int32_t data_size = 0;
    /// Bytes of the whole event, if the lengths are plausible.
    [[nodiscard]] uint64_t event_size() const {
      return kEventHeaderBytes + static_cast<uint64_t>(channel_size) +
             static_cast<uint64_t>(data_size);
    }
  };
  /// The watcher is told once in so many bytes of the log.
  static constexpr uint64_t kTellBytes = uint64_t{1} << 20;

  EventLogReader(std::string path, std::unique_ptr<LogBytes> bytes);
  /// Whether the log has all bytes before `end`.
  bool Reaches(uint64_t end) { return end <= bytes_->Extend(end); }
  /// The `size` bytes at `offset` in the buffer; null if the file does not have them. Bytes before
  /// `offset` may leave the buffer, so earlier pointers into it are void.
  const uint8_t* Need(uint64_t offset, size_t size);
  /// Copies up to `size` bytes at `offset` into `out` and leaves the buffer alone. Returns how many
  /// there were.
  size_t Peek(uint64_t offset, uint8_t* out, size_t size);
  static Header ParseHeader(const uint8_t* bytes);
  /// The header at `offset`; none if the file ends before its last byte.
  std::optional<Header> HeaderAt(uint64_t offset);
  /// True if a header at `offset` could be true: magic, lengths, and the event lies within the
  /// file.
  bool Plausible(const Header& header, uint64_t offset);
  /// True if at `end` the file ends or a magic begins, even one that the file's end cuts.
  bool FollowedWell(uint64_t end);
  /// True if a plausible event begins at `offset` and is followed well. `only_number`: it must have
  /// this event number; -1 for any.
  bool IsCandidate(uint64_t offset, int64_t only_number);
  /// The first offset in [begin, limit) at which such an event begins.
  std::optional<uint64_t> Scan(uint64_t begin, uint64_t limit, int64_t only_number);
  /// False if a plausible event that is not followed by its successor is itself the damaged one.
  bool IsSound(const Header& header);
  /// Reports why no event can be read at position_, and moves on to the next sound one.
  void SkipDamage();
  /// Compares the event's number with the expected one; `end` is where the event ends.
  void CheckNumber(const Header& header, uint64_t end);
  /// Reports what is wrong with the compression of the log before byte `end`.
  void CheckCompression(uint64_t end);
  /// Reports a wall clock that steps back over 1 s or ahead over 1 h.
  void CheckClock(const Header& header);
  /// Counts a finding, and keeps it while there is room.
  void Report(LogFinding::Kind kind, uint64_t begin, uint64_t end, std::string what);

  /// Tells whoever watches, if it is time.
  void TellWatcher();

  std::string path_;
  std::unique_ptr<LogBytes> bytes_;
  /// The byte from which on the watcher is told again.
  uint64_t tell_at_ = kTellBytes;
  /// The byte at which the next event is looked for.
  uint64_t position_ = 0;
  /// A window on the file, grown to the largest event.
  std::vector<uint8_t> buffer_;
  /// File offset of buffer_[0].
  uint64_t buffer_begin_ = 0;
  /// Bytes of the buffer that are filled.
  size_t buffer_size_ = 0;
  /// Number that the next event should have; none at the start and after damage.
  std::optional<int64_t> expected_number_;
  /// Timestamp of the event before; none at the start.
  std::optional<int64_t> last_timestamp_us_;
  /// Where damage ends, if a lookahead already found out: it need not be scanned again.
  std::optional<uint64_t> known_good_;
  std::vector<LogFinding> findings_;
  int64_t num_findings_ = 0;
  int64_t num_events_ = 0;
  bool damaged_ = false;
};

}  // namespace morphbus::logger
