// How fast logs are written, read, loaded and compared; LCM's own reader beside ours, on the same
// file.

#include <benchmark/benchmark.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <lcm/lcm-cpp.hpp>
#include <string>
#include <utility>

#include "logger/compare/comparer.h"
#include "logger/log/event_log.h"
#include "logger/log/run_log.h"
#include "test/support/synthetic_log.h"

namespace morphbus::logger {
namespace {

constexpr int kEvents = 500'000;
constexpr int kPayload = 200;  ///< Bytes: a usual message.

/// A file that lives as long as the program.
class BenchFile {
 public:
  explicit BenchFile(const char* name)
      : path_("/tmp/morphbus_bench_" + std::to_string(getpid()) + name) {}
  ~BenchFile() { std::remove(path_.c_str()); }
  BenchFile(const BenchFile&) = delete;
  BenchFile& operator=(const BenchFile&) = delete;
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
};

const std::string& ManyEvents() {
  static const BenchFile file("events.log");
  static const bool written = [] {
    auto writer = EventLogWriter::Create(file.path());
    const std::vector<uint8_t> payload(kPayload, 0x5A);
    for (int i = 0; i < kEvents; ++i) {
      static_cast<void>(
          (*writer)->Write(1000 * i, "walk/m" + std::to_string(i % 10) + "/TRANSFORM", payload));
    }
    return (*writer)->Close().has_value();
  }();
  if (!written) std::abort();
  return file.path();
}

void CountEvents(benchmark::State& state, int64_t events) {
  if (events != kEvents) state.SkipWithError("events are missing");
  state.SetItemsProcessed(state.iterations() * kEvents);
}

void StockReader(benchmark::State& state) {
  const std::string& path = ManyEvents();
  int64_t events = 0;
  for (auto _ : state) {
    lcm::LogFile log(path, "r");
    events = 0;
    while (log.readNextEvent() != nullptr) ++events;
  }
  CountEvents(state, events);
}
BENCHMARK(StockReader)->Unit(benchmark::kMillisecond);

void OurReader(benchmark::State& state) {
  const std::string& path = ManyEvents();
  int64_t events = 0;
  for (auto _ : state) {
    auto reader = EventLogReader::Open(path);
    LogEvent event;
    events = 0;
    while ((*reader)->Next(&event)) ++events;
  }
  CountEvents(state, events);
}
BENCHMARK(OurReader)->Unit(benchmark::kMillisecond);

void Writer(benchmark::State& state) {
  const BenchFile file("written.log");
  const std::vector<uint8_t> payload(kPayload, 0x5A);
  for (auto _ : state) {
    // Without Close(): how fast the disk syncs is not the question.
    auto writer = EventLogWriter::Create(file.path());
    for (int i = 0; i < kEvents; ++i) {
      static_cast<void>((*writer)->Write(i, "walk/m1/TRANSFORM", payload));
    }
  }
  std::remove((file.path() + ".partial").c_str());
  state.SetItemsProcessed(state.iterations() * kEvents);
}
BENCHMARK(Writer)->Unit(benchmark::kMillisecond);

const std::string& LongRun() {
  static const BenchFile file("run.log");
  static const bool written = [] {
    test::SyntheticOptions options;
    options.ticks = 3000;
    test::WriteSyntheticLog(file.path(), options);
    return true;
  }();
  static_cast<void>(written);
  return file.path();
}

void Load(benchmark::State& state) {
  const std::string& path = LongRun();
  int64_t events = 0;
  for (auto _ : state) {
    const Result<RunLog> log = LoadRunLog(path);
    events += log->facts.events;
  }
  state.SetItemsProcessed(events);
}
BENCHMARK(Load)->Unit(benchmark::kMillisecond);

void CompareLoaded(benchmark::State& state) {
  const Result<RunLog> log = LoadRunLog(LongRun());
  int64_t events = 0;
  for (auto _ : state) {
    if (Compare(*log, *log).verdict != Verdict::kEquivalent) state.SkipWithError("not equivalent");
    events += 2 * log->facts.events;
  }
  state.SetItemsProcessed(events);
}
BENCHMARK(CompareLoaded)->Unit(benchmark::kMillisecond);

/// Two logs of a million events each. They are written by a process of their own, whose memory is
/// gone when the comparison is measured.
const std::pair<std::string, std::string>& MillionEvents() {
  static const BenchFile a("million_a.log"), b("million_b.log");
  static const std::pair<std::string, std::string> paths = [] {
    const pid_t writer = fork();
    if (writer == 0) {
      for (const auto& [path, robot] : {std::pair(a.path(), "one"), std::pair(b.path(), "two")}) {
        test::SyntheticOptions options;
        options.robot = robot;
        options.ticks = 110'000;
        test::WriteSyntheticLog(path, options);
      }
      _exit(0);
    }
    int status = 0;
    if (writer < 0 || waitpid(writer, &status, 0) != writer || status != 0) std::abort();
    return std::pair(a.path(), b.path());
  }();
  return paths;
}

/// The most memory that this process had since it was asked last (MB), as the kernel counts it.
double PeakMegabytes() {
  std::ifstream file("/proc/self/status");
  double kilobytes = 0.0;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("VmHWM:")) kilobytes = std::strtod(line.c_str() + 6, nullptr);
  }
  // 5 begins the count anew.
  std::ofstream("/proc/self/clear_refs") << "5";
  return kilobytes / 1024;
}

void CompareMillionEvents(benchmark::State& state) {
  const auto& [a, b] = MillionEvents();
  int64_t events = 0;
  PeakMegabytes();
  for (auto _ : state) {
    const Result<Comparison> comparison = logger::CompareFiles(a, b);
    if (!comparison || comparison->verdict != Verdict::kEquivalent) {
      state.SkipWithError("not equivalent");
      break;
    }
    events += comparison->a.events + comparison->b.events;
  }
  state.SetItemsProcessed(events);
  state.counters["peak_MB"] = PeakMegabytes();
}
BENCHMARK(CompareMillionEvents)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace morphbus::logger

BENCHMARK_MAIN();
