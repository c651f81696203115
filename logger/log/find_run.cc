#include "logger/log/find_run.h"

#include <fmt/format.h>

#include "bridge/wire/channels.h"
#include "compiler/base/text.h"

namespace morphbus::logger {

std::string NoSuchRun(const std::string& path, const std::string& run,
                      const std::vector<std::string>& others) {
  constexpr size_t kMaxNamed = 8;  // a damaged log can name any number of runs
  if (others.empty()) return fmt::format("{} holds no run of modules", path);
  return fmt::format("no run '{}' in {}; it holds {}", run, path,
                     EscapeControl(NameFirst(others, kMaxNamed)));
}

std::string WhyNoRun(const std::string& path, const EventLogReader& reader) {
  // An empty file is the commonest mistake, and has no finding.
  if (reader.file_size() == 0) return path + " is empty";
  // Of a compressed file that cannot be decompressed, the reason is in its first finding.
  const bool told = reader.compressed() && !reader.findings().empty();
  const std::string no_run = path + " holds no run of modules";
  if (told) return no_run + ": " + reader.findings().front().what;
  const std::string no_log = reader.WhyNoLog();
  return no_log.empty() ? no_run : no_log;
}

std::optional<std::string> FindRun(EventLogReader* reader) {
  LogEvent event;
  while (reader->Next(&event)) {
    const std::optional<bridge::ChannelName> name = bridge::ParseChannel(event.channel);
    // Only the description and CLOCK are certain to be of a run: other channels may be called so by
    // chance.
    if (name && (name->topic == bridge::Topic::kInfo || name->topic == bridge::Topic::kClock)) {
      return std::string(name->run);
    }
  }
  return std::nullopt;
}

}  // namespace morphbus::logger
