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
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "compiler/source/result.h"

namespace morphbus::logger {

inline constexpr uint32_t kEventMagic = 0xEDA1DA01;
inline constexpr size_t kEventHeaderBytes = 28;
/// LCM's own reader refuses names of 1000 bytes and more.
inline constexpr size_t kMaxChannelBytes = 999;
/// LCM's largest message.
inline constexpr size_t kMaxDataBytes = size_t{1} << 28;

/// One event. The views are valid until the reader's next call.
struct LogEvent {
  int64_t number = 0;
  int64_t timestamp_us = 0;  ///< Wall clock, microseconds since 1970.
  std::string_view channel;
  std::span<const uint8_t> data;
  uint64_t offset = 0;  ///< Of the event's header in the file, bytes.
};

/// Appends the bytes of one event to `out`. The channel must have 1..999 bytes, the data at most
/// 2^28 (checked: both are the caller's doing).
void AppendEvent(int64_t number, int64_t timestamp_us, std::string_view channel,
                 std::span<const uint8_t> data, std::vector<uint8_t>* out);

/// Writes a log. While it is being written the file is called PATH.partial and is a readable log
/// at every flush; Close() gives it its name. A writer that is destroyed without Close(), or whose
/// process is killed, leaves PATH.partial: an interrupted run keeps its log.
class EventLogWriter {
 public:
  /// Opens PATH.partial, replacing an earlier one; an earlier PATH stays until Close(). Fails if
  /// the file cannot be written, another process is writing it, or PATH is a folder or device.
  static Result<std::unique_ptr<EventLogWriter>> Create(const std::string& path);
  ~EventLogWriter();
  EventLogWriter(const EventLogWriter&) = delete;
  EventLogWriter& operator=(const EventLogWriter&) = delete;

  /// Appends an event; event numbers are given here. Buffered (1 MiB).
  Result<void> Write(int64_t timestamp_us, std::string_view channel, std::span<const uint8_t> data);
  /// Hands everything to the operating system.
  Result<void> Flush();
  /// Flushes, waits for the disk, and renames PATH.partial to PATH. Nothing can be written after.
  Result<void> Close();

  [[nodiscard]] const std::string& path() const { return path_; }
  /// Where the bytes are until Close().
  [[nodiscard]] const std::string& partial_path() const { return partial_path_; }
  [[nodiscard]] int64_t num_events() const { return next_number_; }
  [[nodiscard]] uint64_t num_bytes() const { return num_bytes_; }

 private:
  EventLogWriter(std::string path, std::string partial_path, int fd);

  std::string path_;
  std::string partial_path_;
  int fd_ = -1;
  int64_t next_number_ = 0;
  uint64_t num_bytes_ = 0;
  std::vector<uint8_t> buffer_;
};

/// Something about a log's framing that a reader should know.
struct LogFinding {
  enum class Kind {
    kDamaged,    ///< Bytes that are no event; reading goes on at `end`.
    kTruncated,  ///< The file ends inside an event.
    kNumber,     ///< One event's number is wrong, its neighbours' are right.
    kMissing,    ///< Event numbers jump: events were taken out.
    kRestart,    ///< Numbers start again at 0: logs were concatenated. No damage.
    kClockStep,  ///< The timestamp stepped back over 1 s or ahead over 1 h. No damage.
  };
  Kind kind = Kind::kDamaged;
  uint64_t begin = 0;  ///< Byte range [begin, end) of the file.
  uint64_t end = 0;
  std::string what;  ///< One sentence with the offsets, for people.

  /// False for kRestart and kClockStep.
  [[nodiscard]] bool is_damage() const {
    return kind != Kind::kRestart && kind != Kind::kClockStep;
  }
};

/// Reads a log front to back with one buffer. Never gives up on damage: it looks ahead to where the
/// next sound event begins, reports the bytes between, and goes on, so that one wrong byte costs at
/// most one event and never its neighbours. Memory is bounded by the largest event in the file.
class EventLogReader {
 public:
  /// Opens a regular file. An empty file is a log without events.
  static Result<std::unique_ptr<EventLogReader>> Open(const std::string& path);
  ~EventLogReader();
  EventLogReader(const EventLogReader&) = delete;
  EventLogReader& operator=(const EventLogReader&) = delete;

  /// The next sound event; false at the end of the file, whose state `findings` then tells.
  bool Next(LogEvent* event);

  /// Reads on at `offset`, which must be 0 or where an event begins; findings are kept.
  void Seek(uint64_t offset);

  /// What was found so far, in file order; at most 1000 are kept.
  [[nodiscard]] const std::vector<LogFinding>& findings() const { return findings_; }
  [[nodiscard]] int64_t num_findings() const { return num_findings_; }
  /// True if any finding so far is damage.
  [[nodiscard]] bool damaged() const { return damaged_; }
  [[nodiscard]] uint64_t file_size() const { return file_size_; }
  /// Where the next event is looked for.
  [[nodiscard]] uint64_t position() const { return position_; }
  /// Set if the operating system could not read the file to its end.
  [[nodiscard]] const std::string& io_error() const { return io_error_; }

 private:
  struct Header {
    uint32_t magic = 0;
    int64_t number = 0;
    int64_t timestamp_us = 0;
    int32_t channel_size = 0;
    int32_t data_size = 0;
  };
  enum class Verdict { kAccept, kReject };

  EventLogReader(int fd, uint64_t file_size);
  const uint8_t* Need(uint64_t offset, size_t size);
  size_t Peek(uint64_t offset, uint8_t* out, size_t size);
  std::optional<Header> HeaderAt(uint64_t offset);
  [[nodiscard]] bool Plausible(const Header& header, uint64_t offset) const;
  bool FollowedWell(uint64_t end);
  bool IsCandidate(uint64_t offset, int64_t only_number);
  std::optional<uint64_t> Scan(uint64_t begin, uint64_t limit, int64_t only_number);
  Verdict Judge(const Header& header);
  void SkipDamage();
  void CheckNumber(const Header& header, uint64_t end);
  void CheckClock(const Header& header);
  void Report(LogFinding::Kind kind, uint64_t begin, uint64_t end, std::string what);

  int fd_ = -1;
  uint64_t file_size_ = 0;
  uint64_t position_ = 0;
  std::vector<uint8_t> buffer_;
  uint64_t buffer_begin_ = 0;  ///< File offset of buffer_[0].
  size_t buffer_size_ = 0;     ///< Bytes of the buffer that are filled.
  std::optional<int64_t> expected_number_;
  std::optional<int64_t> last_timestamp_us_;
  std::optional<uint64_t> known_good_;  ///< Damage that a lookahead already found ends here.
  std::vector<LogFinding> findings_;
  int64_t num_findings_ = 0;
  bool damaged_ = false;
  std::string io_error_;
};

/// What RepairLog() did and found.
struct RepairReport {
  int64_t events_kept = 0;
  uint64_t bytes_dropped = 0;
  std::vector<LogFinding> findings;  ///< At most 1000.
  int64_t num_findings = 0;
};

/// Copies every sound event of `in_path` to `out_path`, numbered anew, timestamps kept. Returns
/// what was wrong with the input. An END event is copied as it is, so a log that lost events stays
/// visibly incomplete. Fails, and then leaves `in_path` as it is, if that cannot be read or holds
/// no sound event, if `out_path` cannot be written (EventLogWriter), or if writing it, or
/// `out_path`.partial, would overwrite `in_path`.
Result<RepairReport> RepairLog(const std::string& in_path, const std::string& out_path);

}  // namespace morphbus::logger
