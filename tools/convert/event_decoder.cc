#include "tools/convert/event_decoder.h"

#include <utility>

#include "compiler/base/bytes.h"
#include "compiler/model/run_description.pb.h"
#include "logger/log/description.h"
#include "tools/spy/lcm_sources.h"

namespace morphbus::tools {

Result<std::unique_ptr<EventDecoder>> EventDecoder::Open(const std::string& path,
                                                         const std::string& description,
                                                         bool in_order) {
  // A log of an older build has messages that only its own definitions fit.
  std::vector<LcmSchema> schemas;
  proto::RunDescription described;
  // The description is looked for in the whole log first, since it may stand behind messages that
  // need its definitions.
  std::string used = logger::ReadDescription(path).value_or(description);
  if (described.ParseFromString(used) && !described.lcm_schema().empty()) {
    Result<LcmSchema> schema = LcmSchema::Parse(described.lcm_schema());
    if (schema) schemas.push_back(std::move(*schema));
  }
  // Without a run's name the reader keeps the order of the file.
  auto reader = logger::OrderedLogReader::Open(path, in_order ? described.run() : "");
  if (!reader) return tl::unexpected(reader.error());
  // This build's own are for logs that hold none.
  Result<LcmSchema> ours = LcmSchema::Parse(LcmSources());
  if (!ours) return tl::unexpected(ours.error());
  schemas.push_back(std::move(*ours));
  return std::unique_ptr<EventDecoder>(
      new EventDecoder(std::move(*reader), std::move(used), std::move(schemas)));
}

bool EventDecoder::Next(DecodedEvent* decoded) {
  *decoded = DecodedEvent();
  if (!reader_->Next(&decoded->event)) return false;
  const auto& data = decoded->event.data;
  // The log's own definitions come first; a message that neither fits keeps the reason.
  for (const LcmSchema& schema : schemas_) {
    auto message = schema.Decode(data.data(), data.size());
    if (!message) {
      decoded->why_not = message.error().message;
      continue;
    }
    // Every message of LCM begins with the fingerprint of its type, eight bytes, the highest first.
    decoded->type = schema.Find(static_cast<int64_t>(ReadBig(data.data(), 8)));
    decoded->schema = &schema;
    decoded->message = std::move(*message);
    decoded->why_not.clear();
    break;
  }
  // Messages of ours say to which sim time they belong.
  if (const auto header = decoded->message.find("header");
      header != decoded->message.end() && header->is_object()) {
    const auto time = header->find("sim_time_us");
    if (time != header->end() && time->is_number_integer()) {
      decoded->sim_time_us = time->get<int64_t>();
    }
  }
  return true;
}

}  // namespace morphbus::tools
