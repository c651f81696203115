#include "logger/log/log_bytes.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zstd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>
#include <vector>

#include "compiler/base/bytes.h"
#include "logger/log/event_log.h"

namespace morphbus::logger {
namespace {

/// A frame of zstd begins with these bytes (RFC 8878, 3.1.1).
constexpr uint8_t kFrameMagic[4] = {0x28, 0xB5, 0x2F, 0xFD};
/// Decompressed bytes are kept in pieces of this size.
constexpr size_t kPieceBytes = size_t{1} << 20;
/// So much may any file decompress to; beyond it at most kMaxRatio times its size. Messages carry
/// numbers, times and CRCs, so that logs shrink some tenfold: what expands further is no log but a
/// trap, and would be read for hours.
constexpr uint64_t kFreeBytes = uint64_t{1} << 30;
constexpr uint64_t kMaxRatio = 1000;
/// After so many damaged frames the rest is given up, which bounds the work on a hostile file.
constexpr int kMaxDamagedFrames = 1000;

/// Reads at a place of a file, however often the system is interrupted; -1 as pread.
ssize_t ReadFileAt(int fd, uint64_t offset, uint8_t* out, size_t size) {
  ssize_t n = 0;
  do {
    n = ::pread(fd, out, size, static_cast<off_t>(offset));
  } while (n < 0 && errno == EINTR);
  return n;
}

/// A skippable frame (RFC 8878, 3.1.2), with which parallel compressors begin, or a plain one.
bool IsFrameMagic(const uint8_t* bytes) {
  const bool skippable =
      (bytes[0] & 0xF0) == 0x50 && bytes[1] == 0x2A && bytes[2] == 0x4D && bytes[3] == 0x18;
  return skippable || std::memcmp(bytes, kFrameMagic, sizeof kFrameMagic) == 0;
}

/// A log as LCM writes it: its bytes are those of the file.
class PlainBytes : public LogBytes {
 public:
  PlainBytes(int fd, uint64_t size) : LogBytes(false, size), fd_(fd), size_(size) {
    ::posix_fadvise(fd, 0, 0, POSIX_FADV_SEQUENTIAL);
  }
  ~PlainBytes() override { ::close(fd_); }

  size_t ReadAt(uint64_t offset, uint8_t* out, size_t size) override {
    if (offset >= size_) return 0;
    size = std::min<uint64_t>(size, size_ - offset);
    size_t done = 0;
    while (done < size) {
      const ssize_t n = ReadFileAt(fd_, offset + done, out + done, size - done);
      // The file shrank under us, or the disk failed: what is there is all there is.
      if (n <= 0) {
        io_error_ = n < 0 ? std::strerror(errno) : "the file became shorter while it was read";
        size_ = offset + done;
        break;
      }
      done += static_cast<size_t>(n);
    }
    return done;
  }
  uint64_t Extend(uint64_t) override { return size_; }
  [[nodiscard]] uint64_t file_bytes_read() const override { return size_; }
  void Forget(uint64_t) override {}

 private:
  int fd_;
  /// As file_size(), but smaller if the file shrank while it was read.
  uint64_t size_;
};

/// A log that was compressed afterwards. It is decompressed as far as it is asked for; what was
/// decompressed stays in memory until it is forgotten.
class CompressedBytes : public LogBytes {
 public:
  CompressedBytes(int fd, uint64_t size)
      : LogBytes(true, size),
        fd_(fd),
        stream_(ZSTD_createDStream()),
        input_(ZSTD_DStreamInSize()) {}
  ~CompressedBytes() override {
    ZSTD_freeDStream(stream_);
    ::close(fd_);
  }
  CompressedBytes(const CompressedBytes&) = delete;
  CompressedBytes& operator=(const CompressedBytes&) = delete;

  size_t ReadAt(uint64_t offset, uint8_t* out, size_t size) override {
    // What was forgotten is decompressed again, and what lies before it dropped on the way.
    if (offset < begin_) {
      Restart();
      forget_ = offset;
    }
    Extend(offset + size);
    size_t done = 0;
    while (done < size && offset + done < end_) {
      const uint64_t at = offset + done - begin_;
      const std::vector<uint8_t>& piece = pieces_[at / kPieceBytes];
      const size_t n = std::min(size - done, piece.size() - at % kPieceBytes);
      std::memcpy(out + done, piece.data() + at % kPieceBytes, n);
      done += n;
    }
    return done;
  }

  [[nodiscard]] uint64_t file_bytes_read() const override { return read_; }

  uint64_t Extend(uint64_t wanted) override {
    while (end_ < wanted && !at_end_) {
      Decompress();
      Forget(forget_);
    }
    return end_;
  }

  void Forget(uint64_t offset) override {
    forget_ = std::max(forget_, offset);
    while (pieces_.size() > 1 && begin_ + kPieceBytes <= forget_) {
      pieces_.pop_front();
      begin_ += kPieceBytes;
    }
  }

 private:
  /// Begins to decompress anew at the file's first byte.
  void Restart() {
    ZSTD_DCtx_reset(stream_, ZSTD_reset_session_only);
    pieces_.clear();
    findings_.clear();
    begin_ = end_ = forget_ = read_ = frame_begin_ = input_begin_ = 0;
    input_size_ = input_used_ = 0;
    num_damaged_ = 0;
    in_frame_ = at_end_ = false;
  }

  /// Notes what is wrong at the present end of what was decompressed.
  void Report(bool truncated, std::string what) {
    findings_.push_back({end_, truncated, std::move(what)});
  }

  /// Reads more of the file into the input buffer; false at its end.
  bool ReadInput() {
    input_begin_ = read_;
    input_used_ = input_size_ = 0;
    const ssize_t n = ReadFileAt(fd_, read_, input_.data(), input_.size());
    if (n < 0) io_error_ = std::strerror(errno);
    if (n <= 0) return false;
    read_ += static_cast<uint64_t>(n);
    input_size_ = static_cast<size_t>(n);
    return true;
  }

  /// Decompresses until the last piece is full, a frame is found damaged, or the file ends.
  void Decompress() {
    if (pieces_.empty() || pieces_.back().size() == kPieceBytes) {
      pieces_.emplace_back().reserve(kPieceBytes);
    }
    std::vector<uint8_t>& piece = pieces_.back();
    const uint64_t piece_begin = end_ - piece.size();
    ZSTD_outBuffer output = {piece.data(), kPieceBytes, piece.size()};
    piece.resize(kPieceBytes);
    bool good = true;
    while (good && output.pos < kPieceBytes && !at_end_) {
      ZSTD_inBuffer input = {input_.data(), input_size_, input_used_};
      const size_t result = ZSTD_decompressStream(stream_, &output, &input);
      const bool idle = input.pos == input_used_ && piece_begin + output.pos == end_;
      input_used_ = input.pos;
      end_ = piece_begin + output.pos;
      // A result of 0 ends a frame; the next one begins at the next byte of the file.
      good = ZSTD_isError(result) == 0;
      if (good && !idle) in_frame_ = result != 0;
      if (!in_frame_) frame_begin_ = input_begin_ + input_used_;
      if (!good) Resynchronise(ZSTD_getErrorName(result));
      if (good && idle && !ReadInput()) EndOfFile();
    }
    piece.resize(output.pos);
    // A file that would be read for hours is a trap.
    if (end_ > std::max(kFreeBytes, kMaxRatio * file_size_)) {
      Report(false, fmt::format("the compressed file expands to more than {} times its size, as no "
                                "log does: nothing after byte {} is read",
                                kMaxRatio, end_));
      at_end_ = true;
    }
  }

  /// The file has no more bytes: it must end where a frame does.
  void EndOfFile() {
    at_end_ = true;
    if (!in_frame_ || !io_error_.empty()) return;
    Report(true, fmt::format("the compressed file ends at its byte {} inside a frame of zstd: the "
                             "log is cut at byte {}",
                             read_, end_));
  }

  /// Goes on at the next frame of zstd after one that is wrong.
  void Resynchronise(const char* why) {
    const uint64_t bad = frame_begin_;
    const uint64_t next = ++num_damaged_ < kMaxDamagedFrames ? FindFrame(bad + 1) : file_size_;
    Report(false,
           fmt::format("the compressed file is damaged between its bytes {} and {} (zstd: {})"
                       ", at byte {} of the log",
                       bad, next, why, end_));
    // The decoder starts afresh at the next frame, or there is none.
    ZSTD_DCtx_reset(stream_, ZSTD_reset_session_only);
    in_frame_ = false;
    frame_begin_ = read_ = input_begin_ = next;
    input_size_ = input_used_ = 0;
    if (next >= file_size_) at_end_ = true;
  }

  /// The first byte of the file, at `begin` or later, at which a frame begins; else its size.
  uint64_t FindFrame(uint64_t begin) {
    std::vector<uint8_t> chunk(65536);
    // Chunks overlap by three bytes, so that a magic across their border is found.
    while (begin < file_size_) {
      const ssize_t n = ReadFileAt(fd_, begin, chunk.data(), chunk.size());
      if (n < static_cast<ssize_t>(sizeof kFrameMagic)) break;
      const auto* end = chunk.data() + n;
      const auto* found = std::search(chunk.data(), chunk.data() + n, std::begin(kFrameMagic),
                                      std::end(kFrameMagic));
      if (found != end) return begin + static_cast<uint64_t>(found - chunk.data());
      begin += static_cast<uint64_t>(n) - 3;
    }
    return file_size_;
  }

  int fd_;
  ZSTD_DStream* stream_;
  /// A part of the file that waits to be decompressed: `input_size_` bytes from `input_begin_` on,
  /// `input_used_` of which are.
  std::vector<uint8_t> input_;
  uint64_t input_begin_ = 0;
  size_t input_size_ = 0;
  size_t input_used_ = 0;
  /// The byte of the file at which is read on, and at which the present frame began.
  uint64_t read_ = 0;
  uint64_t frame_begin_ = 0;
  bool in_frame_ = false;
  /// What was decompressed and not forgotten: log bytes [begin_, end_), in pieces of which all but
  /// the last are full.
  std::deque<std::vector<uint8_t>> pieces_;
  uint64_t begin_ = 0;
  uint64_t end_ = 0;
  uint64_t forget_ = 0;
  int num_damaged_ = 0;
  bool at_end_ = false;
};

}  // namespace

Result<std::unique_ptr<LogBytes>> LogBytes::Open(const std::string& path) {
  // Opening a pipe would wait for somebody to write to it.
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (fd < 0) return Fail("cannot open " + path + ": " + std::strerror(errno));
  struct stat info {};
  if (::fstat(fd, &info) != 0 || !S_ISREG(info.st_mode)) {
    ::close(fd);
    return Fail("cannot read " + path + ": not a regular file");
  }
  // What the file is, its first bytes say.
  uint8_t magic[4];
  const auto size = static_cast<uint64_t>(info.st_size);
  if (ReadFileAt(fd, 0, magic, sizeof magic) == sizeof magic && IsFrameMagic(magic)) {
    return std::unique_ptr<LogBytes>(new CompressedBytes(fd, size));
  }
  return std::unique_ptr<LogBytes>(new PlainBytes(fd, size));
}

bool BeginsAsLog(const std::string& path) {
  const Result<std::unique_ptr<LogBytes>> bytes = LogBytes::Open(path);
  uint8_t magic[4];
  return bytes && (*bytes)->ReadAt(0, magic, sizeof magic) == sizeof magic &&
         ReadBig(magic, sizeof magic) == kEventMagic;
}

}  // namespace morphbus::logger
