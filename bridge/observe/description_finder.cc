#include "bridge/observe/description_finder.h"

namespace morphbus::bridge {

std::optional<std::string> DescriptionFinder::Take(std::string_view channel, const uint8_t* data,
                                                   size_t size) {
  // A log has millions of other messages, of which not even the header is read.
  const std::optional<ChannelName> name = ParseChannel(channel);
  if (!name || name->topic != Topic::kInfo || (!run_.empty() && name->run != run_)) {
    return std::nullopt;
  }
  if (const auto message = OpenMessage(channel, data, size)) ReadMessage(*message, this);
  return whole_;
}

void DescriptionFinder::OnInfo(const RunMessage& message, morphbus::info_part_t&& part) {
  whole_ = parts_[std::string(message.name.run)].Take(part);
}

}  // namespace morphbus::bridge
