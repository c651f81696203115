#include "bridge/lockstep/module/name_directory.h"

#include "bridge/wire/channels.h"
#include "bridge/wire/stream_hash.h"
#include "bridge/wire/wire_peek.h"

namespace morphbus::bridge {

void NameDirectory::Learn(const morphbus::sensors_t& sensors, const uint8_t* data, size_t size) {
  Part part{sensors.header.tick, sensors.part, sensors.num_parts, {}};
  PeekReadings(data, [&](const PeekedReading& reading) {
    Add(reading.module_id, reading.name);
    part.modules.push_back(reading.module_id);
  });
  std::ranges::sort(part.modules);
  // Only the first tick is of interest.
  if (parts_.size() >= kMostNames) parts_.clear();
  parts_.insert_or_assign(MessageDigest(data, size), std::move(part));
}

void NameDirectory::Add(uint16_t module, std::string_view name) {
  const auto at = Find(module);
  const bool known = at != names_.end() && at->first == module;
  if (known || names_.size() >= kMostNames || !CheckModuleName(name)) return;
  names_.emplace(at, module, name);
}

}  // namespace morphbus::bridge
