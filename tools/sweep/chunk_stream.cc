#include "tools/sweep/chunk_stream.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <deque>

#include "compiler/base/version.h"
#include "sim/arithmetic.h"
#include "tools/base/lines.h"
#include "tools/launch/launcher_link.h"

namespace morphbus::tools {
namespace {

/// The rows of a stream.
class StreamRows : public RowSource {
 public:
  StreamRows(int input, int output) : input_(input), output_(output) {}

  Result<std::optional<RowTask>> Next() override {
    if (!read_) return Fail(read_.error().message);
    if (waiting_.empty()) return std::optional<RowTask>();
    ChunkRow row = std::move(waiting_.front());
    waiting_.pop_front();
    parts_ = std::move(row.parts);
    return std::optional(std::move(row.task));
  }

  /// Of the row that was given last, which is handed over before the next one is asked for.
  Result<std::string> Part(const std::string& hash) override { return *parts_.at(hash); }
  Result<RowInputs> Inputs(const std::string& /*key*/) override {
    return Fail("a row of a stream is given once");
  }

  Result<void> Take(const RowTask& task, const RowResult& result) override {
    // Whoever does not want results any more ends the input, too.
    open_ = open_ && WriteWhole(output_, ResultLine(task.place, task.key, result));
    return {};
  }

  bool GoOn() override {
    // Only what is there is read, for the rows under way do not wait.
    pollfd ready = {input_, POLLIN, 0};
    while (open_ && read_ && poll(&ready, 1, 0) > 0) {
      open_ = ReadSome(input_, &buffer_);
      while (const std::optional<std::string> line = TakeLine(&buffer_)) {
        Result<std::optional<ChunkRow>> row = reader_.Take(*line);
        if (!row) {
          read_ = Fail(row.error().message);
          break;
        }
        if (*row) waiting_.push_back(std::move(**row));
      }
    }
    return open_ && read_ && CaughtSignal() == 0;
  }

  [[nodiscard]] int arrivals() const override { return input_; }
  [[nodiscard]] const Result<void>& read() const { return read_; }

 private:
  int input_, output_;
  std::string buffer_;
  ChunkReader reader_;
  std::deque<ChunkRow> waiting_;
  std::map<std::string, HeldParts::Bytes> parts_;
  bool open_ = true;
  Result<void> read_;
};

}  // namespace

std::string HelloLine(int jobs) {
  return JsonText(Json{{"hello", 1},
                       {"version", Version()},
                       {"arithmetic", sim::ArithmeticFingerprint()},
                       {"jobs", jobs},
                       {"host", NewResult().host}}) +
         "\n";
}

Result<StreamHello> ReadHello(const std::string& line) {
  const Json json = Json::parse(line, nullptr, false);
  if (!json.is_object() || !json.contains("hello")) return Fail("it does not say hello");
  StreamHello hello;
  try {
    hello.version = json.value("version", std::string());
    hello.arithmetic = json.value("arithmetic", std::string());
    hello.host = json.value("host", std::string());
    // The library would cast any number to an integer.
    const Json jobs = json.value("jobs", Json());
    if (!jobs.is_number_integer()) return Fail("it does not say how many rows it runs at a time");
    hello.jobs = static_cast<int>(std::clamp<int64_t>(jobs.get<int64_t>(), 1, 65536));
  } catch (const Json::exception&) {
    return Fail("it does not say hello");
  }
  return hello;
}

Result<void> ServeStream(int input, int output, const LocalOptions& options) {
  StreamRows rows(input, output);
  if (!WriteWhole(output, HelloLine(options.jobs))) return {};
  const Result<void> run = RunLocally(options, &rows);
  return run ? rows.read() : run;
}

}  // namespace morphbus::tools
