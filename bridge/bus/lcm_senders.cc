#include "bridge/bus/lcm_senders.h"

#include <algorithm>

namespace morphbus::bridge {
namespace {

// A jump further than this, either way, is no loss but another sender behind the same address.
constexpr int32_t kFurthest = 100'000;

}  // namespace

void LcmSenders::Take(uint64_t sender, uint32_t sequence) {
  ++datagrams_;
  auto found = senders_.find(sender);
  if (found == senders_.end()) {
    // The first number opens the row, whatever it is.
    if (senders_.size() >= kMost) {
      senders_.erase(std::min_element(
          senders_.begin(), senders_.end(),
          [](const auto& a, const auto& b) { return a.second.heard < b.second.heard; }));
    }
    senders_.emplace(sender, Sender{sequence, 0, datagrams_});
    return;
  }
  Sender& known = found->second;
  known.heard = datagrams_;
  // Numbers begin anew after 2^32, so that the difference counts and not the size.
  const auto ahead = static_cast<int32_t>(sequence - known.highest);
  if (ahead > kFurthest || ahead < -kFurthest) {
    known.highest = sequence;
  } else if (ahead > 0) {
    known.lost += ahead - 1;
    lost_ += ahead - 1;
    known.highest = sequence;
  } else if (ahead < 0 && known.lost > 0) {
    // It was counted as lost when a later one came.
    --known.lost;
    --lost_;
  }
}

}  // namespace morphbus::bridge
