#include "tools/spy_table.h"

#include <fmt/format.h>

#include <algorithm>

#include "bridge/channels.h"
#include "bridge/codec.h"
#include "tools/json_text.h"

namespace morphbus::tools {
namespace {

constexpr size_t kMaxChannels = 4096;  // a flood of names must not make us grow
constexpr const char* kPackage = "morphbus.";

}  // namespace

void SpyTable::Take(std::string_view channel, const uint8_t* data, size_t size, double now_s) {
  if (begin_s_ < 0) begin_s_ = interval_begin_s_ = now_s;
  now_s_ = now_s;
  auto found = rows_.find(channel);
  if (found == rows_.end()) {
    if (rows_.size() >= kMaxChannels) return;
    found = rows_.emplace(std::string(channel), Row()).first;
  }
  Row& row = found->second;
  ++row.messages;
  ++row.interval_messages;
  row.bytes += static_cast<int64_t>(size);
  row.interval_bytes += static_cast<int64_t>(size);
  row.last.assign(data, data + size);
  const std::optional<bridge::ChannelName> name = bridge::ParseChannel(channel);
  if (!name) return;  // foreign: nothing more to know
  morphbus::header_t header;
  if (!bridge::DecodeHeader(data, size, &header)) {
    ++row.bad;
    return;
  }
  const LcmType* type = schema_.Find(bridge::FingerprintOf(data, size));
  if (type != nullptr) row.type = type->name;
  // Requests on one ASK channel come from many senders, each with numbers of its own.
  if (name->topic == bridge::Topic::kAsk || name->topic == bridge::Topic::kHello) return;
  if (row.tracker.Take(header.sequence, &row.ledger) == bridge::SequenceTracker::Kind::kLate)
    ++row.late;
  if (name->topic != bridge::Topic::kStatus) return;
  const Result<Json> status = schema_.Decode(data, size);
  if (status) roles_[std::string(name->process)] = status->value("role_name", "");
}

void SpyTable::Roll(double now_s) {
  now_s_ = now_s;
  const double seconds = now_s - interval_begin_s_;
  for (auto& [channel, row] : rows_) {
    row.hz = seconds > 0 ? static_cast<double>(row.interval_messages) / seconds : 0.0;
    row.bytes_per_s = seconds > 0 ? static_cast<double>(row.interval_bytes) / seconds : 0.0;
    row.interval_messages = row.interval_bytes = 0;
  }
  interval_begin_s_ = now_s;
}

Json SpyTable::ToJson(const std::string& selected) const {
  Json channels = Json::array();
  for (const auto& [channel, row] : rows_) {
    Json entry = {{"channel", channel},
                  {"type", row.type.empty() ? Json(nullptr) : Json(row.type)},
                  {"messages", row.messages},
                  {"hz", row.hz},
                  {"bytes_per_s", row.bytes_per_s},
                  {"lost", std::max<int64_t>(0, row.ledger.lost - row.late)},
                  {"bad", row.bad}};
    if (channel == selected) {
      Result<Json> decoded = schema_.Decode(row.last.data(), row.last.size());
      entry["last"] = decoded ? std::move(*decoded) : Json(decoded.error().message);
    }
    channels.push_back(std::move(entry));
  }
  Json modules = Json::object();
  for (const auto& [module, role] : roles_) {
    modules[module] = {{"role", role.empty() ? Json(nullptr) : Json(role)}};
  }
  return {{"seconds", begin_s_ < 0 ? 0.0 : now_s_ - begin_s_},
          {"channels", channels},
          {"modules", modules}};
}

std::string SpyText(const Json& spy, const std::string& selected, int width, int height) {
  std::vector<std::string> lines;
  lines.push_back(fmt::format("{:<40} {:<18} {:>9} {:>9} {:>9} {:>7} {:>6}", "channel", "type",
                              "messages", "Hz", "kB/s", "lost", "bad"));
  const Json* chosen = nullptr;
  for (const Json& c : spy["channels"]) {
    std::string type = c["type"].is_null() ? "?" : c["type"].get<std::string>();
    if (type.rfind(kPackage, 0) == 0) type = type.substr(std::string(kPackage).size());
    lines.push_back(fmt::format("{:<40} {:<18} {:>9} {:>9.1f} {:>9.2f} {:>7} {:>6}",
                                c["channel"].get<std::string>(), type, c["messages"].get<int64_t>(),
                                c["hz"].get<double>(), c["bytes_per_s"].get<double>() / 1000.0,
                                c["lost"].get<int64_t>(), c["bad"].get<int64_t>()));
    if (c.contains("last")) chosen = &c["last"];
  }
  if (spy["channels"].empty()) lines.emplace_back("(nothing heard yet)");
  if (!spy["modules"].empty()) lines.emplace_back("");
  for (const auto& [module, entry] : spy["modules"].items()) {
    lines.push_back(
        fmt::format("{:<8} {}", module,
                    entry["role"].is_null() ? "(no role)" : entry["role"].get<std::string>()));
  }
  if (!selected.empty()) {
    lines.emplace_back("");
    lines.push_back(selected + (chosen == nullptr ? ": nothing heard" : ":"));
    std::string text = chosen == nullptr ? "" : JsonText(*chosen, 1);
    for (size_t begin = 0, end = 0; begin < text.size(); begin = end + 1) {
      end = std::min(text.find('\n', begin), text.size());
      lines.push_back(text.substr(begin, end - begin));
    }
  }
  std::string out;
  const size_t shown =
      height > 0 ? std::min(lines.size(), static_cast<size_t>(height)) : lines.size();
  for (size_t i = 0; i < shown; ++i) {
    out += width > 0 ? lines[i].substr(0, static_cast<size_t>(width)) : lines[i];
    out += '\n';
  }
  return out;
}

}  // namespace morphbus::tools
