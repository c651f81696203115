#include "tools/spy/spy_text.h"

#include <fmt/format.h>

#include <algorithm>

#include "compiler/base/text.h"
#include "tools/spy/hex_dump.h"
#include "tools/spy/list_tables.h"
#include "tools/spy/spy_pages.h"
#include "tools/spy/spy_view.h"

namespace morphbus::tools {
namespace {

/// A channel's entry.
Json ChannelJson(const ChannelRow& row) {
  const ArrivalFigures& a = row.arrivals;
  // Without two messages there is no interval, and no jitter either.
  Json jitter = nullptr;
  if (a.intervals > 0) {
    jitter = {{"period_s", a.period_s},
              {"p50_s", a.jitter_p50_s},
              {"p99_s", a.jitter_p99_s},
              {"intervals", a.intervals}};
  }
  return {{"channel", row.channel},
          {"type", row.type.empty() ? Json(nullptr) : Json(row.type)},
          {"messages", row.messages},
          {"hz", a.hz},
          {"jitter", jitter},
          {"bytes_per_s", a.bytes_per_s},
          {"lost", row.lost},
          {"bad", row.bad},
          {"unauthentic", row.unauthentic},
          {"undecodable", row.undecodable},
          {"fingerprint", Hex(row.fingerprint)}};
}

/// What HEALTH tells of a process.
void AddHealthJson(const ProcessRow& row, Json* entry) {
  if (!row.health) return;
  (*entry)["cpu"] = row.cpu ? Json(*row.cpu) : Json(nullptr);
  (*entry)["max_rss_kb"] = row.health->max_rss_kb;
}

/// A module's entry.
Json ModuleJson(const ProcessRow& row) {
  // What is not known is null, so that every module has the same keys.
  Json entry = {{"role", row.role().empty() ? Json(nullptr) : Json(row.role())}};
  entry["pose_age_s"] = row.pose_age_s ? Json(*row.pose_age_s) : Json(nullptr);
  entry["pose_stale"] = row.pose_stale;
  entry["faults"] = row.faults;
  entry["ended_behaviors"] = row.status ? row.status->ended_behaviors : 0;
  entry["startup_ended"] = row.status && row.status->startup_ended != 0;
  AddHealthJson(row, &entry);
  // Only in real time anybody is late.
  if (row.lateness) {
    entry["lateness"] = {{"missed", row.lateness->missed},
                         {"late", row.lateness->late},
                         {"worst_us", row.lateness->worst_us}};
  }
  return entry;
}

/// A run's entry.
Json RunJson(const RunRow& run) {
  return {{"tick", run.clock.tick()},
          {"sim_seconds", Seconds(run.clock.time_us())},
          {"speed", run.speed ? Json(*run.speed) : Json(nullptr)},
          {"paused", run.clock.paused()},
          {"ended", run.clock.ended()},
          {"silent_s", run.silent_s}};
}

/// The fields of a channel's last message, or its bytes and why they have none.
Screen MessageLines(const SpyTable& table, const std::string& channel) {
  FieldHistory fields;
  ShownFields shown;
  const std::vector<uint8_t>* bytes = table.BytesOfLast(channel);
  if (Result<MessageFields> last = table.FieldsOfLast(channel)) {
    fields.Take(*std::move(last));
    shown.history = &fields;
    // Text has no width of its own, so that nothing is cut.
    constexpr int kWide = 1 << 16;
    return FieldLines(shown, 0, FieldCount(shown), kWide);
  } else {
    constexpr int kWidth = 80;
    Screen lines = {{{Visible(last.error().message)}}};
    if (bytes == nullptr) return lines;
    const size_t dumped = std::min(bytes->size(), ShownFields::kMostDumped);
    const Screen dump = HexDump({bytes->data(), bytes->data() + dumped}, bytes->size(), kWidth);
    lines.insert(lines.end(), dump.begin(), dump.end());
    return lines;
  }
}

/// The table as text.
std::string TableText(SpyTableText table) {
  table.DropDrawn();
  // Text has no width of its own, so that no column is cut.
  const std::vector<int> widths = TableWidths(table.columns, table.rows, -1);
  Screen lines = {TableHeading(table.columns, widths)};
  for (const TableRow& row : table.rows) {
    lines.push_back(TableLine(table.columns, widths, row, false));
  }
  return PlainText(lines);
}

}  // namespace

Json SpyJson(const SpyTable& table, const SpySnapshot& spy, const ChannelFilter& selected) {
  Json channels = Json::array();
  for (const ChannelRow& row : spy.channels) {
    Json entry = ChannelJson(row);
    // Decoding every message would cost more than the table: only what is shown is decoded.
    if (selected(row.channel)) {
      Result<Json> last = table.LastOf(row.channel);
      // A message that cannot be decoded is told by the reason, in the same place.
      entry["last"] = last ? std::move(*last) : Json(last.error().message);
    }
    channels.push_back(std::move(entry));
  }
  Json modules = Json::object();
  Json processes = Json::object();
  Json runs = Json::object();
  // Processes are named with their run where there are several.
  for (const ProcessRow& row : spy.processes) {
    const std::string name = spy.runs.size() > 1 ? ProcessKey(row) : row.process;
    if (row.is_module) {
      modules[name] = ModuleJson(row);
    } else {
      AddHealthJson(row, &processes[name]);
    }
  }
  for (const RunRow& run : spy.runs) runs[run.run] = RunJson(run);
  return {{"seconds", spy.seconds},
          {"channels", std::move(channels)},
          {"modules", std::move(modules)},
          {"processes", std::move(processes)},
          {"runs", std::move(runs)},
          {"listener",
           {{"missing", spy.missing},
            {"overflowed", spy.overflowed},
            {"incomplete", spy.incomplete},
            {"not_lcm", spy.not_lcm},
            {"messages_beyond_table", spy.untold_messages},
            {"channels_dropped", spy.dropped_channels}}}};
}

std::string SpyText(const SpyTable& table, const SpySnapshot& spy, const ChannelFilter& selected) {
  std::string out;
  // A line for each run comes first.
  for (const RunRow& run : spy.runs) out += PlainText({RunLine(run)});
  if (!spy.runs.empty()) out += '\n';
  // The same tables as on the screen, as wide as they need to be.
  std::vector<const ChannelRow*> channels;
  for (const ChannelRow& row : spy.channels) channels.push_back(&row);
  out += TableText(ChannelTableText(channels, "", nullptr));
  if (channels.empty()) out += "(nothing heard yet)\n";
  std::vector<const ProcessRow*> processes;
  for (const ProcessRow& row : spy.processes) processes.push_back(&row);
  if (!processes.empty()) out += "\n" + TableText(ProcessTableText(processes, spy.runs.size() > 1));
  // The decoded messages, one line a field.
  for (const ChannelRow* row : channels) {
    if (!selected(row->channel)) continue;
    out += "\n" + Visible(row->channel) + ":\n" + PlainText(MessageLines(table, row->channel));
  }
  return out;
}

}  // namespace morphbus::tools
