#include "tools/spy/spy_table.h"

#include <fmt/format.h>

#include <algorithm>

#include "bridge/wire/channels.h"
#include "bridge/wire/codec.h"
#include "bridge/wire/vm_codec.h"
#include "compiler/base/text.h"
#include "tools/base/json.h"
#include "vm/image/fault_text.h"

namespace morphbus::tools {
namespace {

constexpr size_t kMaxChannels = 4096;  // a flood of names must not make us grow
constexpr std::string_view kPackage = "morphbus.";

/// Gives the faults of a STATUS their sentences, under "text". The spy has no images of the run, so
/// they have numbers in place of names.
void AddFaultTexts(const std::vector<uint8_t>& payload, Json* decoded) {
  morphbus::status_t status;
  // Whatever is no STATUS stays as it is.
  if (!bridge::Decode(payload.data(), payload.size(), {}, &status)) return;
  for (size_t i = 0; i < status.faults.size(); ++i) {
    const vm::Fault fault = bridge::FromFault(status.faults[i]);
    (*decoded)["faults"][i]["text"] = vm::FaultLine("", fault.line, vm::FaultSentence(fault, {}),
                                                    vm::FaultFunction(fault, nullptr));
  }
}

}  // namespace

void SpyTable::Take(std::string_view channel, const uint8_t* data, size_t size, double now_s) {
  // Time begins with the first message, so that waiting for it lowers no rate.
  if (begin_s_ < 0) begin_s_ = interval_begin_s_ = now_s;
  now_s_ = now_s;
  // A channel beyond the limit is not noted at all.
  auto found = streams_.find(channel);
  if (found == streams_.end()) {
    if (streams_.size() >= kMaxChannels) return;
    found = streams_.emplace(std::string(channel), Stream()).first;
  }
  Stream& stream = found->second;
  // Counts of all channels, also those of other programs.
  ++stream.messages;
  ++stream.interval_messages;
  stream.bytes += static_cast<int64_t>(size);
  stream.interval_bytes += static_cast<int64_t>(size);
  stream.last.assign(data, data + size);
  // Our own channels have a header, whose numbers tell of losses.
  const std::optional<bridge::ChannelName> name = bridge::ParseChannel(channel);
  if (!name) return;  // foreign: nothing more to know
  morphbus::header_t header;
  if (!bridge::DecodeHeader(data, size, &header)) {
    ++stream.bad;
    return;
  }
  // The type is what the message says, whatever its channel is called.
  const LcmType* type = schema_.Find(bridge::FingerprintOf(data, size));
  if (type != nullptr) stream.type = type->name;
  // Requests on one ASK channel come from many senders, each with numbers of its own.
  if (name->topic == bridge::Topic::kAsk || name->topic == bridge::Topic::kHello ||
      name->topic == bridge::Topic::kControl) {
    return;
  }
  if (stream.tracker.Take(header.sequence, &stream.ledger) == bridge::SequenceTracker::Kind::kLate)
    ++stream.late;
  if (name->topic != bridge::Topic::kStatus) return;
  const Result<Json> status = schema_.Decode(data, size);
  if (status) roles_[std::string(name->process)] = status->value("role_name", "");
}

void SpyTable::Roll(double now_s) {
  now_s_ = now_s;
  // Rates of the interval that ends; what was lost and bad is counted from the beginning.
  const double seconds = now_s - interval_begin_s_;
  for (auto& [channel, stream] : streams_) {
    stream.hz = seconds > 0 ? static_cast<double>(stream.interval_messages) / seconds : 0.0;
    stream.bytes_per_s = seconds > 0 ? static_cast<double>(stream.interval_bytes) / seconds : 0.0;
    stream.interval_messages = stream.interval_bytes = 0;
  }
  // The next interval begins where this one ends, so that no message is left out.
  interval_begin_s_ = now_s;
}

Json SpyTable::ToJson(const ChannelFilter& selected) const {
  Json channels = Json::array();
  for (const auto& [channel, stream] : streams_) {
    Json entry = {{"channel", channel},
                  {"type", stream.type.empty() ? Json(nullptr) : Json(stream.type)},
                  {"messages", stream.messages},
                  {"hz", stream.hz},
                  {"bytes_per_s", stream.bytes_per_s},
                  {"lost", std::max<int64_t>(0, stream.ledger.lost - stream.late)},
                  {"bad", stream.bad}};
    // Decoding every message would cost more than the table: only what is shown is decoded.
    if (selected(channel)) {
      Result<Json> decoded = schema_.Decode(stream.last.data(), stream.last.size());
      entry["last"] = decoded ? std::move(*decoded) : Json(decoded.error().message);
      AddFaultTexts(stream.last, &entry["last"]);
    }
    channels.push_back(std::move(entry));
  }
  // Roles as the modules' last STATUS had them.
  Json modules = Json::object();
  for (const auto& [module, role] : roles_) {
    modules[module] = {{"role", role.empty() ? Json(nullptr) : Json(role)}};
  }
  return {{"seconds", begin_s_ < 0 ? 0.0 : now_s_ - begin_s_},
          {"channels", channels},
          {"modules", modules}};
}

namespace {

/// A section of the text, without line feeds.
using Lines = std::vector<std::string>;

/// One line a channel, under a heading.
Lines ChannelLines(const Json& channels) {
  Lines lines = {fmt::format("{:<40} {:<18} {:>9} {:>9} {:>9} {:>7} {:>6}", "channel", "type",
                             "messages", "Hz", "kB/s", "lost", "bad")};
  for (const Json& c : channels) {
    std::string type = c["type"].is_null() ? "?" : c["type"].get<std::string>();
    // Our own package goes without saying; that of others is shown.
    if (type.starts_with(kPackage)) type = type.substr(kPackage.size());
    lines.push_back(fmt::format("{:<40} {:<18} {:>9} {:>9.1f} {:>9.2f} {:>7} {:>6}",
                                EscapeControl(c["channel"].get<std::string>()), type,
                                c["messages"].get<int64_t>(), c["hz"].get<double>(),
                                c["bytes_per_s"].get<double>() / 1000.0, c["lost"].get<int64_t>(),
                                c["bad"].get<int64_t>()));
  }
  if (channels.empty()) lines.emplace_back("(nothing heard yet)");
  return lines;
}

/// One line a module.
Lines RoleLines(const Json& modules) {
  Lines lines;
  for (const auto& [module, entry] : modules.items()) {
    const Json& role = entry["role"];
    lines.push_back(
        fmt::format("{:<8} {}", EscapeControl(module),
                    role.is_null() ? "(no role)" : EscapeControl(role.get<std::string>())));
  }
  return lines;
}

/// The decoded messages, one line a field.
Lines FieldLines(const Json& channels, const std::string& pattern) {
  Lines lines;
  for (const Json& c : channels) {
    if (!c.contains("last")) continue;
    lines.push_back(EscapeControl(c["channel"].get<std::string>()) + ":");
    // The fields are cut into lines, so that the table can be cut to the terminal's height.
    const std::string text = JsonText(c["last"], 1);
    for (size_t begin = 0, end = 0; begin < text.size(); begin = end + 1) {
      end = std::min(text.find('\n', begin), text.size());
      lines.push_back(EscapeControl(text.substr(begin, end - begin)));
    }
  }
  if (lines.empty() && !pattern.empty()) lines.push_back(pattern + ": nothing heard");
  return lines;
}

/// Cuts `sections` so that they and the empty lines between them fit `height` lines. All get the
/// same share; what one does not need goes to the others, to the last ones first.
void FitHeight(std::vector<Lines>* sections, int height) {
  // First an equal share each, of at least a heading and a line.
  const int count = static_cast<int>(sections->size());
  int free = height - (count - 1);
  std::vector<int> share;
  for (const Lines& lines : *sections) {
    share.push_back(std::min(static_cast<int>(lines.size()), std::max(2, free / count)));
  }
  for (const int taken : share) free -= taken;
  // Then what is left: the fields were asked for, so they come first.
  for (int i = count - 1; i >= 0; --i) {
    Lines& lines = (*sections)[i];
    const int size = static_cast<int>(lines.size());
    const int more = std::clamp(free, 0, size - share[i]);
    share[i] += more;
    free -= more;
    if (share[i] == size) continue;
    lines.resize(share[i]);
    lines.back() = fmt::format("and {} more (a taller terminal shows them)", size - share[i] + 1);
  }
}

}  // namespace

std::string SpyText(const Json& spy, const std::string& pattern, int width, int height) {
  std::vector<Lines> sections = {ChannelLines(spy["channels"]), RoleLines(spy["modules"]),
                                 FieldLines(spy["channels"], pattern)};
  // A section without a line takes no empty line either.
  std::erase_if(sections, [](const Lines& lines) { return lines.empty(); });
  if (height > 0) FitHeight(&sections, height);
  std::string out;
  int shown = 0;
  for (const Lines& lines : sections) {
    if (&lines != &sections.front()) {
      out += '\n';
      ++shown;
    }
    // A line that is too long is cut: a wrapped line would push the table off the screen.
    for (const std::string& line : lines) {
      if (height > 0 && shown++ >= height) return out;
      out += width > 0 ? line.substr(0, width) : line;
      out += '\n';
    }
  }
  return out;
}

}  // namespace morphbus::tools
