#include "logger/log/repair.h"

#include <fmt/format.h>
#include <algorithm>
#include <filesystem>
#include <optional>
#include <utility>

#include "bridge/observe/run_message.h"
#include "bridge/wire/channels.h"
#include "compiler/base/temporary_files.h"
#include "logger/log/run_facts.h"

namespace morphbus::logger {
namespace {

constexpr size_t kMaxFindings = 1000;

/// Whether the payload is what was sent, as far as a message can say that of itself.
Result<void> CheckPayload(const LogEvent& event) {
  // Of a foreign channel nothing is known but the framing, which the reader has checked.
  if (!bridge::ParseChannel(event.channel)) return {};
  const auto message = bridge::OpenMessage(event.channel, event.data.data(), event.data.size());
  if (!message) return tl::unexpected(message.error());
  return {};
}

/// Copies what is sound; `report` takes what is not.
Result<void> Copy(EventLogReader* reader, EventLogWriter* writer, RepairReport* report) {
  LogEvent event;
  while (reader->Next(&event)) {
    // A message whose CRC is wrong is left out, and listed with its bytes.
    if (const Result<void> sound = CheckPayload(event); !sound) {
      ++report->num_findings;
      const uint64_t end =
          event.offset + kEventHeaderBytes + event.channel.size() + event.data.size();
      report->findings.push_back(
          {LogFinding::Kind::kPayload, event.offset, end,
           fmt::format("the message on {} at byte {} is damaged: {}", EscapeControl(event.channel),
                       event.offset, sound.error().message)});
      if (report->findings.size() > kMaxFindings) report->findings.pop_back();
      continue;
    }
    // Everything else is copied as it is; the writer numbers it anew.
    if (auto r = writer->Write(event.timestamp_us, event.channel, event.data); !r) return r;
    ++report->events_kept;
  }
  if (!reader->io_error().empty()) return Fail(reader->io_error());
  if (report->events_kept == 0) return Fail("no sound event");
  return writer->Close();
}

}  // namespace

Result<RepairReport> RepairLog(const std::string& in_path, const std::string& out_path) {
  // The writer empties PATH.partial, which is what an interrupted run leaves for repair.
  for (const std::string& written : {out_path, out_path + ".partial"}) {
    std::error_code not_there;
    if (std::filesystem::equivalent(in_path, written, not_there)) {
      return Fail("writing " + out_path + " would overwrite " + in_path +
                  ", the log to be repaired: choose another name");
    }
  }
  // Both files are opened before anything is copied, so that a failure leaves nothing behind.
  auto reader = EventLogReader::Open(in_path);
  if (!reader) return tl::unexpected(reader.error());
  // Half of a repaired log helps nobody: what is interrupted leaves nothing.
  std::optional<SignalsBlocked> blocked(std::in_place);
  auto writer = EventLogWriter::Create(out_path);
  if (!writer) return tl::unexpected(writer.error());
  TemporaryPath partial((*writer)->partial_path());
  blocked.reset();
  RepairReport report;
  if (auto copied = Copy(reader->get(), writer->get(), &report); !copied) {
    (*writer)->Discard();
    partial.Keep();  // the name may be somebody else's by now
    if (report.events_kept > 0) return tl::unexpected(copied.error());
    return Fail(in_path + " holds no sound event: nothing can be kept");
  }
  partial.Keep();

  // Findings of the framing and of the payloads in one row.
  const auto& framing = (*reader)->findings();
  report.findings.insert(report.findings.end(), framing.begin(), framing.end());
  std::ranges::stable_sort(report.findings, {}, &LogFinding::begin);
  if (report.findings.size() > kMaxFindings) report.findings.resize(kMaxFindings);
  report.num_findings += (*reader)->num_findings();
  report.bytes_dropped = (*reader)->log_size() - (*writer)->num_bytes();
  return report;
}

}  // namespace morphbus::logger
