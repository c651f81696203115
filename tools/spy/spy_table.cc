#include "tools/spy/spy_table.h"

#include <algorithm>
#include <morphbus/status_t.hpp>

#include "bridge/observe/run_message.h"
#include "bridge/wire/codec.h"

namespace morphbus::tools {
namespace {

/// Gives the faults of a STATUS their sentences, under "text".
void AddFaultTexts(const morphbus::status_t& status, const RunNames& names, Json* decoded) {
  for (size_t i = 0; i < status.faults.size(); ++i) {
    (*decoded)["faults"][i]["text"] =
        names.Fault(status.header.program_hash, status.type_name, status.faults[i]);
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
  if (!message) return;
  processes_.Take(*message, arrival_ns);
  descriptions_.Take(*message, arrival_ns);
}

SpySnapshot SpyTable::Snapshot(int64_t now_ns) const {
  SpySnapshot snapshot;
  if (begin_ns_ >= 0) {
    snapshot.seconds = std::max(0.0, static_cast<double>(now_ns - begin_ns_) * 1e-9);
  }
  channels_.Snapshot(now_ns, &snapshot);
  processes_.Snapshot(now_ns, &snapshot);
  for (RunRow& run : snapshot.runs) run.names = descriptions_.NamesOf(run.run);
  return snapshot;
}

Result<Json> SpyTable::LastOf(const std::string& channel) const {
  const std::vector<uint8_t>* last = channels_.Last(channel);
  if (last == nullptr) return Fail("too long to be kept beside all others");
  Result<Json> decoded = schema_.Decode(last->data(), last->size());
  const LcmType* type = schema_.Find(bridge::FingerprintOf(last->data(), last->size()));
  if (!decoded) {
    // What is shorter than a fingerprint has no type that anybody could name.
    const bool nameless = type == nullptr && last->size() >= sizeof(type->fingerprint);
    return Fail(decoded.error().message + (nameless ? ": name its .lcm files by --types" : ""));
  }
  WriteHashes(schema_, *type, &*decoded);
  // Whatever is no STATUS stays as it is.
  const auto message = bridge::OpenMessage(channel, last->data(), last->size());
  const auto status = message ? bridge::DecodeAs<morphbus::status_t>(*message) : std::nullopt;
  if (status) AddFaultTexts(*status, NamesOf(*message), &*decoded);
  return decoded;
}

Result<MessageFields> SpyTable::FieldsOfLast(const std::string& channel) const {
  const Result<Json> decoded = LastOf(channel);
  if (!decoded) return tl::unexpected(decoded.error());
  const std::vector<uint8_t>& last = *channels_.Last(channel);
  FieldWords words;
  words.schema = &schema_;
  words.type = schema_.Find(bridge::FingerprintOf(last.data(), last.size()));
  if (const auto message = bridge::OpenMessage(channel, last.data(), last.size())) {
    words.names = NamesOf(*message);
    words.process = message->name.process;
  }
  return FieldsOf(*decoded, words);
}

}  // namespace morphbus::tools
