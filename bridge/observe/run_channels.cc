#include "bridge/observe/run_channels.h"

#include <utility>

namespace morphbus::bridge {

RunChannels::RunChannels(std::string run, const std::vector<std::string>& modules)
    : run_(std::move(run)) {
  for (const std::string& module : modules) {
    const int index = static_cast<int>(module_index_.size());
    module_index_.emplace(module, index);
  }
}

RunChannels::Channel* RunChannels::Find(std::string_view channel) {
  const auto found = channels_.find(channel);
  if (found != channels_.end()) return &found->second;
  const std::optional<ChannelName> name = ParseChannel(channel);
  if (!name || name->run != run_) return nullptr;
  Channel made{name->topic, std::string(name->process)};
  const auto module = module_index_.find(name->process);
  if (module != module_index_.end()) made.module = module->second;
  // Other processes than these a run does not have.
  const bool known = made.process.empty() || made.module >= 0 || made.process == kSimProcess ||
                     made.process == kLogProcess;
  return known ? &channels_.emplace(channel, std::move(made)).first->second : nullptr;
}

}  // namespace morphbus::bridge
