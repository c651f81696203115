#include "bridge/observe/run_listener.h"

#include <utility>

namespace morphbus::bridge {
namespace {

/// No run takes longer, microseconds (a hundred years); a thousand times this still fits.
constexpr int64_t kLatestUs = int64_t{3'155'760'000} * 1'000'000;
/// A message may be of so many ticks after the last CLOCK, which may have been lost.
constexpr int64_t kMostAhead = 64;

}  // namespace

RunListener::RunListener(std::string run, uint64_t model_hash,
                         const std::vector<std::string>& modules)
    : channels_(std::move(run), modules), model_hash_(model_hash) {}

RunListener::Kind RunListener::Take(std::string_view channel, const uint8_t* data, size_t size,
                                    RunMessageHandler* handler) {
  RunChannels::Channel* known = channels_.Find(channel);
  if (known == nullptr) return Kind::kOther;
  RunMessage message{
      {channels_.run(), known->process, known->topic}, {}, data, size, known->module};
  const morphbus::header_t& header = message.header;
  if (!ReadHeader(&message)) return Kind::kBad;
  const auto model_hash = static_cast<uint64_t>(header.model_hash);
  if (model_hash_ != 0 && model_hash != model_hash_) return Kind::kBad;
  // A time that no run reaches would not fit the nanoseconds of viewers, and a tick that cannot
  // have begun would make all that follow look late.
  const bool is_clock = known->topic == Topic::kClock;
  if (header.sim_time_us > kLatestUs) return Kind::kBad;
  if (tick_ >= 0 && !is_clock && header.tick > tick_ + kMostAhead) return Kind::kBad;
  // Where several speak, each has numbers of its own.
  if (!HasManyPublishers(known->topic) && header.sequence <= known->newest) {
    handler->OnRepeat(message);
    return Kind::kRepeat;
  }
  // A message that is not sound has no number that would count.
  if (!ReadMessage(message, handler)) return Kind::kBad;
  known->newest = header.sequence;
  if (is_clock) tick_ = header.tick;
  return Kind::kNew;
}

}  // namespace morphbus::bridge
