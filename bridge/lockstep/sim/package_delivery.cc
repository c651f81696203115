#include "bridge/lockstep/sim/package_delivery.h"

#include <algorithm>

#include "bridge/wire/wire_limits.h"
#include "compiler/base/check.h"
#include "vm/limits.h"

namespace morphbus::bridge {
namespace {

/// Times that a package is given to a module that does not say that it has it.
constexpr int kMostRounds = 100;

}  // namespace

PackageDelivery::PackageDelivery(const std::vector<ExpectedModule>& modules, bool realtime)
    : realtime_(realtime) {
  for (const ExpectedModule& module : modules) ids_.push_back(module.id);
}

void PackageDelivery::Deploy(size_t module, uint64_t id, const std::vector<uint8_t>& package,
                             int64_t from_tick) {
  MORPHBUS_CHECK(module < ids_.size());
  MORPHBUS_CHECK(!package.empty() && package.size() <= vm::kMaxPackageBytes);
  // One delivery at a time: the pieces of an earlier package are not sent to their end.
  delivery_ = {module, id, package, from_tick};
}

void PackageDelivery::AddTo(const std::vector<size_t>& members, int64_t tick,
                            morphbus::sensors_t* part) {
  // The message is used again from tick to tick and from part to part.
  part->pieces.clear();
  part->num_pieces = 0;
  if (!delivery_ || tick < delivery_->from_tick) return;
  Delivery& delivery = *delivery_;
  if (std::ranges::count(members, delivery.module) == 0) return;
  // The next bytes, with all that a receiver needs to place them.
  const size_t size = std::min(kMaxDeployPiece, delivery.package.size() - delivery.sent);
  morphbus::deploy_piece_t& piece = part->pieces.emplace_back();
  part->num_pieces = 1;
  piece.module_id = static_cast<int16_t>(ids_[delivery.module]);
  piece.hash = static_cast<int64_t>(delivery.id);
  piece.image_size = static_cast<int32_t>(delivery.package.size());
  piece.offset = static_cast<int32_t>(delivery.sent);
  piece.size = static_cast<int16_t>(size);
  const uint8_t* from = delivery.package.data() + delivery.sent;
  piece.bytes.assign(from, from + size);
  delivery.sent += size;
  if (delivery.sent == delivery.package.size()) {
    delivery.sent = 0;
    ++delivery.rounds;
  }
  // Over once all have gone out, in real time once it has them; one that never says so has got a
  // newer program, or is dead.
  const bool again = realtime_ && !delivery.arrived && delivery.rounds < kMostRounds;
  if (delivery.rounds > 0 && !again) delivery_.reset();
}

std::optional<size_t> PackageDelivery::awaited() const {
  const bool under_way = delivery_ && (delivery_->sent > 0 || delivery_->rounds > 0);
  return realtime_ && under_way ? std::optional(delivery_->module) : std::nullopt;
}

void PackageDelivery::OnNews(size_t module, uint64_t id) {
  if (delivery_ && delivery_->module == module && delivery_->id == id) delivery_->arrived = true;
}

}  // namespace morphbus::bridge
