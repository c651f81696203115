#include "tools/spy/description_table.h"

namespace morphbus::tools {

void DescriptionTable::Know(const std::string& description, int64_t now_ns) {
  const auto run = bridge::ReadRunModel(description);
  if (!run) return;
  Described* described = runs_.Take((*run)->run, now_ns);
  if (described != nullptr) described->names = RunNames(*run);
}

void DescriptionTable::Take(const bridge::RunMessage& message, int64_t arrival_ns) {
  if (message.name.topic != bridge::Topic::kInfo) return;
  now_ns_ = arrival_ns;
  bridge::ReadMessage(message, this);
}

void DescriptionTable::OnInfo(const bridge::RunMessage& message, morphbus::info_part_t&& part) {
  Described* described = runs_.Take(message.name.run, now_ns_);
  if (described == nullptr) return;
  // A description that names another run than its channel is believed by nobody.
  const std::optional<std::string> whole = described->parts.Take(part);
  if (!whole) return;
  const auto run = bridge::ReadRunModel(*whole);
  if (run && (*run)->run == message.name.run) described->names = RunNames(*run);
}

RunNames DescriptionTable::NamesOf(std::string_view run) const {
  const Described* described = runs_.Find(run);
  return described == nullptr ? RunNames() : described->names;
}

}  // namespace morphbus::tools
