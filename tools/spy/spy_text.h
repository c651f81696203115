#pragma once
// What the spy knows, for scripts and pipes: JSON, and one plain table.

#include <functional>
#include <string>

#include "tools/base/json.h"
#include "tools/spy/spy_table.h"

namespace morphbus::tools {

/// Which channels' last messages are to be shown, by their names.
using ChannelFilter = std::function<bool(const std::string&)>;

/// `{"seconds":…,"channels":[{"channel":…,"type":…,"messages":…,"hz":…,"jitter":{"period_s":…,"p50_s":…,
/// "p99_s":…,"intervals":…},"bytes_per_s":…,"lost":…,"bad":…,"undecodable":…,"fingerprint":…}],
/// "modules":{"m1":{"role":…}},"processes":{"SIM":{…}},"runs":{"walk":{…}},"listener":{…}}`
/// (docs/cli.md). Channels that are `selected` have their last message decoded under "last", or the
/// reason why it cannot be decoded. With several runs, modules and processes are called RUN/NAME.
Json SpyJson(const SpyTable& table, const SpySnapshot& spy, const ChannelFilter& selected);

/// The same as text without limit of width and height: channels, modules, then the fields of the
/// selected channels.
std::string SpyText(const SpyTable& table, const SpySnapshot& spy, const ChannelFilter& selected);

}  // namespace morphbus::tools
