#include "logger/log_node.h"

#include <fmt/format.h>
#include <signal.h>

#include <cstdio>
#include <random>

#include "bridge/bus_adapters.h"
#include "bridge/lcm_bus.h"
#include "bridge/party.h"
#include "logger/description.h"
#include "logger/recorder.h"

namespace morphbus::logger {
namespace {

volatile bool stop_requested = false;

void OnSignal(int) { stop_requested = true; }

void CatchSignals() {
  struct sigaction action {};
  action.sa_handler = OnSignal;
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

int Complain(int status, const std::string& message) {
  fmt::print(stderr, "morphbus log: {}\n", message);
  return status;
}

}  // namespace

int RunLogNode(const LogOptions& options) {
  const Result<std::string> description = ReadDescriptionFile(options.description_path);
  if (!description) return Complain(2, description.error().message);
  const Result<DescriptionKey> key = ReadDescriptionKey(*description);
  if (!key) return Complain(2, options.description_path + ": " + key.error().message);
  auto bus = bridge::OpenLcmBus(options.lcm_url);
  if (!bus) return Complain(2, bus.error().message);
  CatchSignals();

  int64_t discarded = 0;
  bridge::Bus* heard = bus->get();
  bridge::LossyBus lossy(bus->get(), options.loss, options.loss_seed, &discarded);
  if (options.loss > 0) heard = &lossy;
  bridge::MonotonicTime time;
  RecorderOptions recording;
  recording.path = options.log_path;
  recording.description = *description;
  recording.realtime = options.realtime || key->realtime;
  recording.claim = static_cast<int64_t>(std::random_device{}()) + 1;
  auto recorder = Recorder::Create(heard, &time, std::move(recording));
  if (!recorder) return Complain(2, recorder.error().message);

  bridge::RunParties(heard, time, {recorder->get()}, &stop_requested,
                     [&] { (*recorder)->EachSecond(); });
  const bool interrupted = stop_requested && !(*recorder)->done();
  const Result<RecordSummary> summary =
      (*recorder)->Finish(interrupted ? "the logger was stopped" : "");
  if (!summary) return Complain(3, summary.error().message);
  if (!summary->complete) {
    return Complain(3, fmt::format("{}; the log so far is {}", summary->reason, summary->path));
  }
  if (!options.quiet) {
    fmt::print(stderr, "morphbus log: {}: {} events, {} bytes, hash {}\n", summary->path,
               summary->events, summary->bytes, summary->run_hash);
  }
  return 0;
}

}  // namespace morphbus::logger
