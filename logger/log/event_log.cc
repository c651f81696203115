#include "logger/log/event_log.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "compiler/base/bytes.h"
#include "compiler/base/check.h"

namespace morphbus::logger {
namespace {

/// Events are handed to the operating system in pieces of about this size.
constexpr size_t kWriteBufferBytes = size_t{1} << 20;

/// Why the last system call failed, in words.
std::string SystemError() { return std::strerror(errno); }

/// Writes all bytes, however few the system takes at a time.
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
  // The header, field by field as in the table of the header file, then name and data.
  const size_t begin = out->size();
  out->resize(begin + kEventHeaderBytes + channel.size() + data.size());
  uint8_t* p = out->data() + begin;
  WriteBig(kEventMagic, 4, p);
  WriteBig(static_cast<uint64_t>(number), 8, p + 4);
  WriteBig(static_cast<uint64_t>(timestamp_us), 8, p + 12);
  WriteBig(channel.size(), 4, p + 20);
  WriteBig(data.size(), 4, p + 24);
  std::memcpy(p + kEventHeaderBytes, channel.data(), channel.size());
  if (!data.empty()) std::memcpy(p + kEventHeaderBytes + channel.size(), data.data(), data.size());
}

Result<std::unique_ptr<EventLogWriter>> EventLogWriter::Create(const std::string& path) {
  // Renaming would put a file in the place of a device or folder; opening a pipe would wait for its
  // reader.
  const std::string partial = path + ".partial";
  for (const std::string& written : {path, partial}) {
    struct stat old = {};
    if (::stat(written.c_str(), &old) == 0 && !S_ISREG(old.st_mode)) {
      return Fail("cannot write a log to " + written + ": it is no regular file");
    }
  }
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

Result<std::unique_ptr<EventLogWriter>> EventLogWriter::CreateInMemory(const std::string& path) {
  const int fd = ::open(path.c_str(), O_WRONLY | O_TRUNC | O_CLOEXEC);
  if (fd < 0) return Fail("cannot write to memory, " + path + ": " + SystemError());
  std::unique_ptr<EventLogWriter> writer(new EventLogWriter(path, path, fd));
  // The path of a file in memory (/proc/self/fd/…) says nothing to people.
  writer->name_ = "the run in memory";
  return writer;
}

EventLogWriter::EventLogWriter(std::string path, std::string partial_path, int fd)
    : path_(std::move(path)),
      partial_path_(std::move(partial_path)),
      name_(partial_path_),
      fd_(fd) {
  buffer_.reserve(kWriteBufferBytes);
}

EventLogWriter::~EventLogWriter() {
  if (fd_ < 0) return;
  // There is nobody to tell of a failure here; Close() is for those who want to know.
  static_cast<void>(Flush());
  ::close(fd_);
}

Result<void> EventLogWriter::Write(int64_t timestamp_us, std::string_view channel,
                                   std::span<const uint8_t> data) {
  if (fd_ < 0) return Fail("the log " + path_ + " is closed");
  if (!error_.empty()) return Fail(error_);
  // An event is never split between two writes: what reaches the disk ends with a whole event.
  const size_t size = kEventHeaderBytes + channel.size() + data.size();
  if (!buffer_.empty() && buffer_.size() + size > kWriteBufferBytes) {
    if (auto flushed = Flush(); !flushed) return flushed;
  }
  AppendEvent(next_number_, timestamp_us, channel, data, &buffer_);
  ++next_number_;
  num_bytes_ += size;
  return {};
}

bool EventLogWriter::IsThere() const {
  struct stat open = {};
  struct stat named = {};
  return ::fstat(fd_, &open) == 0 && ::stat(partial_path_.c_str(), &named) == 0 &&
         named.st_dev == open.st_dev && named.st_ino == open.st_ino;
}

/// Whether PATH.partial is still the file that is being written, with all that was written to it.
Result<void> EventLogWriter::CheckFile() const {
  // Another process may have removed the file, put another in its place, or written to it.
  struct stat open = {};
  struct stat named = {};
  if (::fstat(fd_, &open) != 0)
    return Fail("cannot look at " + partial_path_ + ": " + SystemError());
  if (::stat(partial_path_.c_str(), &named) != 0) {
    return Fail(partial_path_ + " was removed while it was written");
  }
  if (named.st_dev != open.st_dev || named.st_ino != open.st_ino) {
    return Fail(partial_path_ + " was replaced while it was written");
  }
  if (static_cast<uint64_t>(open.st_size) != flushed_bytes_) {
    return Fail(partial_path_ + " was altered by somebody else while it was written");
  }
  return {};
}

Result<void> EventLogWriter::Flush() {
  if (fd_ < 0) return {};
  // Behind an event that was cut off nothing may stand.
  if (!error_.empty()) return Fail(error_);
  Result<void> result = CheckFile();
  if (result) result = WriteAll(fd_, buffer_.data(), buffer_.size(), name_);
  if (!result) error_ = result.error().message;
  // What could not be written is given up with the error: the log must not grow in memory.
  flushed_bytes_ += buffer_.size();
  buffer_.clear();
  return result;
}

void EventLogWriter::Discard() {
  if (fd_ < 0) return;
  // The lock is held until the name is gone, so nobody else's file can be removed.
  ::unlink(partial_path_.c_str());
  ::close(fd_);
  fd_ = -1;
}

Result<void> EventLogWriter::Close() {
  if (fd_ < 0) return {};
  // Everything is written, and the file is still ours.
  Result<void> result = Flush();
  if (result) result = CheckFile();
  // Only what the disk has, whole, gets the name of a finished log. One in memory has its name.
  const bool renamed = partial_path_ != path_;
  if (result && renamed && ::fsync(fd_) != 0) {
    result = Fail("cannot write " + partial_path_ + " to disk: " + SystemError());
  }
  if (result && renamed && ::rename(partial_path_.c_str(), path_.c_str()) != 0) {
    result = Fail("cannot rename " + partial_path_ + " to " + path_ + ": " + SystemError());
  }
  ::close(fd_);
  fd_ = -1;
  return result;
}

}  // namespace morphbus::logger
