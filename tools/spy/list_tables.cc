#include "tools/spy/list_tables.h"

#include <fmt/format.h>

#include <array>
#include <utility>

#include "compiler/base/text.h"

namespace morphbus::tools {
namespace {

// Which column of the channels each SortBy means: what is drawn has none.
constexpr std::array<size_t, kSortColumns> kColumnOf = {0, 1, 2, 4, 5, 6, 8, 9, 10};

/// LCM's name for the package of our types.
constexpr std::string_view kOurPackage = "morphbus.";

/// A count, shown as something wrong if there is any.
TableCell Trouble(int64_t count) {
  return {ShortCount(count), count > 0 ? Style::kBad : Style::kPlain};
}

/// The type of a channel: our own package goes without saying, an unknown type is its fingerprint.
TableCell TypeCell(const ChannelRow& row) {
  if (!row.type.empty()) {
    const bool ours = row.type.starts_with(kOurPackage);
    return {Visible(ours ? row.type.substr(kOurPackage.size()) : row.type)};
  }
  return {row.fingerprint == 0 ? "?" : "?" + Hex(row.fingerprint), Style::kDim};
}

/// A cell that is drawn as wide as its column is.
TableCell Drawn(std::function<std::string(int)> draw) {
  return {"", Style::kGood, std::move(draw)};
}

/// A sparkline of values that are not negative.
TableCell Trend(const std::vector<double>& values) {
  return Drawn([values](int width) { return SparklineFromZero(values, width); });
}

}  // namespace

void SpyTableText::DropDrawn() {
  for (size_t i = columns.size(); i-- > 0;) {
    if (columns[i].roomy == 0) continue;
    columns.erase(columns.begin() + static_cast<ptrdiff_t>(i));
    for (TableRow& row : rows) row.erase(row.begin() + static_cast<ptrdiff_t>(i));
  }
}

SpyTableText ChannelTableText(const std::vector<const ChannelRow*>& rows, const std::string& prefix,
                              const SpyUi* ui) {
  SpyTableText table;
  table.columns = {{"CHANNEL", 12, false, 0}, {"TYPE", 8, false, 7},      {"HZ", 6, true, 0},
                   {"TREND", 6, true, 4, 20}, {"P50", 6, true, 5},        {"P99", 6, true, 8},
                   {"B/S", 6, true, 3},       {"SHARE", 5, false, 9, 10}, {"COUNT", 6, true, 6},
                   {"LOST", 5, true, 2},      {"UNDEC", 5, true, 1}};
  // An arrow shows the column by which they are sorted; in the order of names there is none.
  if (ui != nullptr && (ui->sort != SortBy::kName || ui->reverse)) {
    const bool text = ui->sort == SortBy::kName || ui->sort == SortBy::kType;
    table.columns[kColumnOf[static_cast<size_t>(ui->sort)]].title +=
        text != ui->reverse ? "↑" : "↓";
  }
  double bytes_per_s = 0.0;
  for (const ChannelRow* row : rows) bytes_per_s += row->arrivals.bytes_per_s;
  for (const ChannelRow* row : rows) {
    // A channel that has fallen silent is dim, and one without intervals has no jitter.
    const ArrivalFigures& a = row->arrivals;
    const bool known = a.intervals > 0;
    const Style style = a.hz > 0 ? Style::kPlain : Style::kDim;
    const size_t hidden = row->channel.starts_with(prefix) ? prefix.size() : 0;
    const double share = bytes_per_s > 0 ? a.bytes_per_s / bytes_per_s : 0.0;
    table.rows.push_back({{Visible(std::string_view(row->channel).substr(hidden)), style},
                          TypeCell(*row),
                          {ShortRate(a.hz), style},
                          Trend(a.hz_history),
                          {known ? ShortTime(a.jitter_p50_s) : "-", style},
                          {known ? ShortTime(a.jitter_p99_s) : "-", style},
                          {ShortBytes(a.bytes_per_s), style},
                          Drawn([share](int width) { return Meter(share, width); }),
                          {ShortCount(row->messages), style},
                          row->ours ? Trouble(row->lost) : TableCell{"-", Style::kDim},
                          Trouble(row->undecodable)});
  }
  return table;
}

SpyTableText ProcessTableText(const std::vector<const ProcessRow*>& rows, bool several_runs) {
  SpyTableText table;
  table.columns = {{"MODULE", 6, false, 0},   {"ROLE", 10, false, 6}, {"POSE", 6, true, 1},
                   {"FAULTS", 6, true, 2},    {"CPU", 6, true, 3},    {"LOAD", 5, false, 9, 10},
                   {"TREND", 6, true, 8, 20}, {"MEM", 6, true, 4},    {"LATE", 4, true, 7}};
  for (const ProcessRow* row : rows) {
    // The later lines know better: a process that is no module has no role to lack.
    TableCell role = {"(no role)", Style::kBad};
    if (!row->role().empty()) role = {Visible(row->role()), Style::kGood};
    if (!row->status) role = {"?", Style::kDim};
    if (!row->is_module) role = {row->process == "SIM" ? "simulator" : "logger", Style::kDim};
    TableCell pose = {"-", Style::kDim};
    if (row->pose_age_s) pose = {ShortTime(*row->pose_age_s), Style::kPlain};
    if (row->pose_age_s && row->pose_stale) pose = {"stale", Style::kBad};
    const int64_t missed = row->lateness ? row->lateness->missed : 0;
    table.rows.push_back(
        {{Visible(several_runs ? ProcessKey(*row) : row->process)},
         role,
         pose,
         row->is_module ? Trouble(row->faults) : TableCell{"-", Style::kDim},
         {row->cpu ? fmt::format("{:.1f}%", *row->cpu * 100) : "-"},
         Drawn([cpu = row->cpu.value_or(0.0)](int width) { return Meter(cpu, width); }),
         Trend(row->cpu_history),
         {row->health ? ShortBytes(static_cast<double>(row->health->max_rss_kb) * 1024) : "-"},
         row->is_module ? Trouble(missed) : TableCell{"-", Style::kDim}});
  }
  return table;
}

}  // namespace morphbus::tools
