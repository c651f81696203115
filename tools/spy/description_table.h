#pragma once
// The descriptions of runs that were heard (INFO) or are at hand, and the names in them.

#include <string>
#include <string_view>

#include "bridge/observe/run_message.h"
#include "bridge/wire/info_parts.h"
#include "tools/spy/heard_names.h"
#include "tools/spy/run_names.h"

namespace morphbus::tools {

/// Of 4 runs at most, so that memory is bounded: a description has up to 16 MiB.
class DescriptionTable : private bridge::RunMessageHandler {
 public:
  static constexpr size_t kMostDescriptions = 4;

  /// Takes the serialized description (morphbus.proto.RunDescription) of a run, in place of an
  /// earlier one. What is none is passed over.
  void Know(const std::string& description, int64_t now_ns);
  /// A message that was not heard before; of other topics than INFO it takes nothing.
  void Take(const bridge::RunMessage& message, int64_t arrival_ns);
  /// The names of a run; none without its description.
  [[nodiscard]] RunNames NamesOf(std::string_view run) const;

 private:
  /// What has come of a run's description, and the names of the last one that was whole.
  struct Described {
    bridge::InfoAssembler parts;
    RunNames names;
  };

  void OnInfo(const bridge::RunMessage& message, morphbus::info_part_t&& part) override;

  int64_t now_ns_ = 0;  ///< When the message came that is being read.
  HeardNames<Described> runs_{kMostDescriptions};
};

}  // namespace morphbus::tools
