#include "tools/sweep/chunk_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <set>

#include "tools/base/descriptor.h"
#include "tools/base/lines.h"
#include "tools/base/messages.h"
#include "tools/launch/launcher_link.h"
#include "tools/machine/wall_clock.h"

namespace morphbus::tools {
namespace {

/// How long a result may stay with the operating system before it is on the disk, or the server of
/// the disk, s.
constexpr double kSyncSeconds = 1;

/// The rows of a chunk's file.
class FileRows : public RowSource {
 public:
  /// Opens both files. Fails if one of them cannot be used.
  Result<void> Open(const std::string& chunk, const std::string& results) {
    results_path_ = results;
    ResultsFile before(results);
    Result<void> read = before.ReadNew([this](const PlacedResult& one) -> Result<void> {
      done_.insert(one.key);
      return {};
    });
    if (!read) return read;
    chunk_.open(chunk, std::ios::binary);
    if (!chunk_) return Fail(fmt::format("cannot read {}: {}", chunk, std::strerror(errno)));
    results_.emplace(open(results.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0666));
    if (results_->get() < 0) return CannotWrite();
    return EndTornLine();
  }

  Result<std::optional<RowTask>> Next() override {
    std::string line;
    while (CaughtSignal() == 0 && std::getline(chunk_, line)) {
      Result<std::optional<ChunkRow>> row = reader_.Take(line);
      unreadable_ = !row;
      if (!row) return Fail(row.error().message);
      if (!*row || !done_.insert((*row)->task.key).second) continue;
      parts_ = std::move((*row)->parts);
      return std::optional(std::move((*row)->task));
    }
    return std::optional<RowTask>();
  }

  /// Of the row that was given last, which is handed over before the next one is asked for.
  Result<std::string> Part(const std::string& hash) override { return *parts_.at(hash); }
  Result<RowInputs> Inputs(const std::string& /*key*/) override {
    return Fail("a row of a chunk is given once");
  }

  Result<void> Take(const RowTask& task, const RowResult& result) override {
    // The line in one piece, so that little can come between its beginning and its end.
    if (!WriteWhole(results_->get(), ResultLine(task.place, task.key, result)))
      return CannotWrite();
    unsynced_ = true;
    return Sync(kSyncSeconds);
  }

  /// The first error of GoOn comes here, too.
  Result<void> Settle() override { return synced_ ? Sync(0) : synced_; }

  bool GoOn() override {
    if (synced_) synced_ = Sync(kSyncSeconds);
    return synced_ && CaughtSignal() == 0;
  }

  /// A line of the chunk made no sense.
  [[nodiscard]] bool unreadable() const { return unreadable_; }

 private:
  [[nodiscard]] tl::unexpected<Error> CannotWrite() const {
    return Fail(fmt::format("cannot write {}: {}", results_path_, std::strerror(errno)));
  }

  /// Half a line gets its end, so that the next one does not become part of it.
  Result<void> EndTornLine() {
    const off_t end = lseek(results_->get(), 0, SEEK_END);
    char last = '\n';
    if (end > 0 && pread(results_->get(), &last, 1, end - 1) != 1) return CannotWrite();
    if (last != '\n' && !WriteWhole(results_->get(), "\n")) return CannotWrite();
    return {};
  }

  /// Has the disk take what was written, unless that was done within the last `seconds`.
  Result<void> Sync(double seconds) {
    if (!unsynced_ || since_sync_.seconds() < seconds) return {};
    since_sync_ = WallTimer();
    unsynced_ = false;
    if (fdatasync(results_->get()) != 0) return CannotWrite();
    return {};
  }

  std::string results_path_;
  std::ifstream chunk_;
  ChunkReader reader_;
  std::map<std::string, HeldParts::Bytes> parts_;
  /// Keys of rows that need not be run any more.
  std::set<std::string> done_;
  std::optional<Descriptor> results_;
  WallTimer since_sync_;
  bool unsynced_ = false, unreadable_ = false;
  Result<void> synced_;
};

}  // namespace

Result<void> ResultsFile::ReadNew(const std::function<Result<void>(const PlacedResult&)>& each) {
  // It is opened anew each time: only then does a network's file system ask its server.
  const Descriptor file(open(path_.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.get() < 0 && errno == ENOENT) return {};
  if (file.get() < 0 || lseek(file.get(), read_bytes_, SEEK_SET) < 0) {
    return Fail(fmt::format("cannot read {}: {}", path_, std::strerror(errno)));
  }
  std::string buffer;
  while (ReadSome(file.get(), &buffer)) {
    while (const std::optional<std::string> line = TakeLine(&buffer)) {
      read_bytes_ += static_cast<int64_t>(line->size()) + 1;
      const Result<PlacedResult> result = ReadResult(*line);
      if (!result) continue;
      if (Result<void> taken = each(*result); !taken) return taken;
    }
  }
  return {};
}

int ServeChunkFile(const std::string& chunk, const std::string& results,
                   const LocalOptions& options) {
  FileRows rows;
  if (Result<void> open = rows.Open(chunk, results); !open) return Unusable(open.error().message);
  const Result<void> run = RunLocally(options, &rows);
  const Result<void> settled = rows.Settle();
  if (rows.unreadable()) return Unusable(run.error().message);
  if (!run || !settled) return Failed((run ? settled : run).error().message);
  return CaughtSignal() == 0 ? kDone : kNo;
}

}  // namespace morphbus::tools
