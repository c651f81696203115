#include "logger/event_log.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "compiler/source/check.h"

namespace morphbus::logger {
namespace {

constexpr size_t kWriteBufferBytes = size_t{1} << 20;

void PutBigEndian(uint64_t value, int bytes, uint8_t* out) {
  for (int i = 0; i < bytes; ++i) out[i] = static_cast<uint8_t>(value >> (8 * (bytes - 1 - i)));
}

std::string SystemError() { return std::strerror(errno); }

Result<void> WriteAll(int fd, const uint8_t* data, size_t size, const std::string& path) {
  while (size > 0) {
    const ssize_t n = ::write(fd, data, size);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return Fail("cannot write " + path + ": " + SystemError());
    data += n;
    size -= static_cast<size_t>(n);
  }
  return {};
}

}  // namespace

void AppendEvent(int64_t number, int64_t timestamp_us, std::string_view channel,
                 std::span<const uint8_t> data, std::vector<uint8_t>* out) {
  MORPHBUS_CHECK(!channel.empty() && channel.size() <= kMaxChannelBytes);
  MORPHBUS_CHECK(data.size() <= kMaxDataBytes);
  const size_t begin = out->size();
  out->resize(begin + kEventHeaderBytes + channel.size() + data.size());
  uint8_t* p = out->data() + begin;
  PutBigEndian(kEventMagic, 4, p);
  PutBigEndian(static_cast<uint64_t>(number), 8, p + 4);
  PutBigEndian(static_cast<uint64_t>(timestamp_us), 8, p + 12);
  PutBigEndian(channel.size(), 4, p + 20);
  PutBigEndian(data.size(), 4, p + 24);
  std::memcpy(p + kEventHeaderBytes, channel.data(), channel.size());
  if (!data.empty()) {
    std::memcpy(p + kEventHeaderBytes + channel.size(), data.data(), data.size());
  }
}

Result<std::unique_ptr<EventLogWriter>> EventLogWriter::Create(const std::string& path) {
  // Renaming would put a file in the place of a device or folder.
  struct stat old = {};
  if (::stat(path.c_str(), &old) == 0 && !S_ISREG(old.st_mode)) {
    return Fail("cannot write a log to " + path + ": it is no regular file");
  }
  const std::string partial = path + ".partial";
  // Truncated only once the lock is ours: the file may be another run's that is still being
  // written.
  const int fd = ::open(partial.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644);
  if (fd < 0) return Fail("cannot create " + partial + ": " + SystemError());
  if (::flock(fd, LOCK_EX | LOCK_NB) != 0) {
    ::close(fd);
    return Fail("another process is writing " + partial);
  }
  if (::ftruncate(fd, 0) != 0) {
    const std::string reason = SystemError();
    ::close(fd);
    return Fail("cannot empty " + partial + ": " + reason);
  }
  return std::unique_ptr<EventLogWriter>(new EventLogWriter(path, partial, fd));
}

EventLogWriter::EventLogWriter(std::string path, std::string partial_path, int fd)
    : path_(std::move(path)), partial_path_(std::move(partial_path)), fd_(fd) {
  buffer_.reserve(kWriteBufferBytes);
}

EventLogWriter::~EventLogWriter() {
  if (fd_ < 0) return;
  static_cast<void>(Flush());
  ::close(fd_);
}

Result<void> EventLogWriter::Write(int64_t timestamp_us, std::string_view channel,
                                   std::span<const uint8_t> data) {
  if (fd_ < 0) return Fail("the log " + path_ + " is closed");
  const size_t size = kEventHeaderBytes + channel.size() + data.size();
  if (!buffer_.empty() && buffer_.size() + size > kWriteBufferBytes) {
    if (auto flushed = Flush(); !flushed) return flushed;
  }
  AppendEvent(next_number_, timestamp_us, channel, data, &buffer_);
  ++next_number_;
  num_bytes_ += size;
  return {};
}

Result<void> EventLogWriter::Flush() {
  if (fd_ < 0 || buffer_.empty()) return {};
  Result<void> written = WriteAll(fd_, buffer_.data(), buffer_.size(), partial_path_);
  buffer_.clear();
  return written;
}

Result<void> EventLogWriter::Close() {
  if (fd_ < 0) return {};
  Result<void> result = Flush();
  if (result && ::fsync(fd_) != 0) {
    result = Fail("cannot write " + partial_path_ + " to disk: " + SystemError());
  }
  if (result && ::rename(partial_path_.c_str(), path_.c_str()) != 0) {
    result = Fail("cannot rename " + partial_path_ + " to " + path_ + ": " + SystemError());
  }
  ::close(fd_);
  fd_ = -1;
  return result;
}

namespace {

/// Whether both paths name one file that is there.
bool IsSameFile(const std::string& a, const std::string& b) {
  struct stat sa = {};
  struct stat sb = {};
  return ::stat(a.c_str(), &sa) == 0 && ::stat(b.c_str(), &sb) == 0 && sa.st_dev == sb.st_dev &&
         sa.st_ino == sb.st_ino;
}

}  // namespace

Result<RepairReport> RepairLog(const std::string& in_path, const std::string& out_path) {
  // The writer empties PATH.partial, which is what an interrupted run leaves for repair.
  for (const std::string& written : {out_path, out_path + ".partial"}) {
    if (IsSameFile(in_path, written)) {
      return Fail("writing " + out_path + " would overwrite " + in_path +
                  ", the log to be repaired: choose another name");
    }
  }
  auto reader = EventLogReader::Open(in_path);
  if (!reader) return tl::unexpected(reader.error());
  LogEvent event;
  if (!(*reader)->Next(&event)) return Fail(in_path + " holds no sound event: nothing can be kept");
  auto writer = EventLogWriter::Create(out_path);
  if (!writer) return tl::unexpected(writer.error());
  RepairReport report;
  do {
    if (auto written = (*writer)->Write(event.timestamp_us, event.channel, event.data); !written) {
      return tl::unexpected(written.error());
    }
    ++report.events_kept;
  } while ((*reader)->Next(&event));
  if (!(*reader)->io_error().empty()) return Fail((*reader)->io_error());
  if (auto closed = (*writer)->Close(); !closed) return tl::unexpected(closed.error());
  report.findings = (*reader)->findings();
  report.num_findings = (*reader)->num_findings();
  report.bytes_dropped = (*reader)->file_size() - (*writer)->num_bytes();
  return report;
}

}  // namespace morphbus::logger
