#include "tools/spy/spy_table.h"

#include <algorithm>
#include <morphbus/status_t.hpp>

#include "bridge/observe/run_message.h"

namespace morphbus::tools {
namespace {

/// Gives the faults of a STATUS their sentences, under "text".
void AddFaultTexts(const morphbus::status_t& status, Json* decoded) {
  for (size_t i = 0; i < status.faults.size(); ++i) {
    (*decoded)["faults"][i]["text"] = HeardFaultText(status.faults[i]);
  }
}

}  // namespace

SpyTable::SpyTable(LcmSchema schema) : schema_(std::move(schema)), channels_(&schema_) {}

void SpyTable::Take(std::string_view channel, const uint8_t* data, size_t size,
                    int64_t arrival_ns) {
  // Time begins with the first message, so that waiting for it counts for nothing.
  if (begin_ns_ < 0) begin_ns_ = arrival_ns;
  // Repetitions and damaged messages say nothing new of a process.
  const std::optional<bridge::RunMessage> message = channels_.Take(channel, data, size, arrival_ns);
  if (message) processes_.Take(*message, arrival_ns);
}

SpySnapshot SpyTable::Snapshot(int64_t now_ns) const {
  SpySnapshot snapshot;
  if (begin_ns_ >= 0) {
    snapshot.seconds = std::max(0.0, static_cast<double>(now_ns - begin_ns_) * 1e-9);
  }
  channels_.Snapshot(now_ns, &snapshot);
  processes_.Snapshot(now_ns, &snapshot);
  return snapshot;
}

Result<Json> SpyTable::LastOf(const std::string& channel) const {
  const std::vector<uint8_t>* last = channels_.Last(channel);
  if (last == nullptr) return Fail("too long to be kept beside all others");
  Result<Json> decoded = schema_.Decode(last->data(), last->size());
  // Whatever is no STATUS stays as it is.
  const auto message = bridge::OpenMessage(channel, last->data(), last->size());
  const auto status = message ? bridge::DecodeAs<morphbus::status_t>(*message) : std::nullopt;
  if (decoded && status) AddFaultTexts(*status, &*decoded);
  return decoded;
}

}  // namespace morphbus::tools
