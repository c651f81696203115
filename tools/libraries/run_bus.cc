#include "tools/libraries/run_bus.h"

#include "bridge/bus/lcm_bus.h"
#include "bridge/wire/channels.h"
#include "bridge/wire/run_key.h"
#include "bridge/wire/sealed_bus.h"

namespace morphbus {
namespace {

/// Microseconds between two calls of a watch.
constexpr int64_t kWatchUs = 50000;

}  // namespace

RunBus::RunBus(const RunAddress& address) {
  if (Result<void> named = bridge::CheckRunName(address.run); !named) {
    throw Failure(named.error().message);
  }
  bridge::RunKey key;
  if (!address.key_file.empty()) {
    const Result<bridge::RunKey> read = bridge::RunKey::Read(address.key_file);
    if (!read) throw Failure(read.error().message);
    key = *read;
  }
  Result<std::unique_ptr<bridge::Bus>> lcm = bridge::OpenRunBus(address.lcm_url);
  if (!lcm) throw Failure(lcm.error().message);
  lcm_ = std::move(*lcm);
  sealed_ = std::make_unique<bridge::SealedBus>(lcm_.get(), key);
}

void Watch::OnTime() {
  if (time_->NowUs() < next_us_) return;
  call_();
  next_us_ = time_->NowUs() + kWatchUs;
}

}  // namespace morphbus
