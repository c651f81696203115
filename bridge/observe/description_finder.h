#pragma once
// A run's description (INFO), put together from what a bus or a log has of it.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "bridge/observe/run_message.h"
#include "bridge/wire/info_parts.h"

namespace morphbus::bridge {

/// Takes messages until a description is whole, whatever order its parts have.
class DescriptionFinder : private RunMessageHandler {
 public:
  /// Looks for that of the run of this name; empty: for the first that is whole.
  explicit DescriptionFinder(std::string run) : run_(std::move(run)) {}

  /// Takes a message of any channel. The serialized morphbus.proto.RunDescription, if this was the
  /// last part that was missing.
  std::optional<std::string> Take(std::string_view channel, const uint8_t* data, size_t size);

 private:
  void OnInfo(const RunMessage& message, morphbus::info_part_t&& part) override;

  std::string run_;
  /// What has come, by run.
  std::map<std::string, InfoAssembler> parts_;
  std::optional<std::string> whole_;
};

}  // namespace morphbus::bridge
