#include "bridge/lockstep/module/neighbour_mail.h"

#include <algorithm>
#include <iterator>
#include <morphbus/transform_t.hpp>
#include <utility>

#include "bridge/wire/channels.h"
#include "bridge/wire/codec.h"

namespace morphbus::bridge {
namespace {

/// A neighbour sends TRANSFORM before the sim can go on, so it is there when SENSORS comes.
constexpr Interest kTransformInterest{false, 0, 0, 0, false};

/// Modules that are listened to: far more than a robot has, as with names.
constexpr size_t kMostBoxes = 4 * vm::kMaxNeighbours;

/// Messages that are kept until it is known who the neighbours are; what else comes is asked for.
constexpr size_t kMostEarlyTransforms = 4096;

}  // namespace

NeighbourMail::NeighbourMail(Bus* bus, std::string run, uint64_t model_hash, Ledger* ledger,
                             Handler handler)
    : bus_(bus),
      run_(std::move(run)),
      model_hash_(model_hash),
      ledger_(ledger),
      handler_(std::move(handler)) {}

std::string NeighbourMail::ChannelOf(const std::string& name) const {
  return Channel(run_, name, Topic::kTransform);
}

void NeighbourMail::ListenToAll() {
  // These messages do not wake the process: until SENSORS names the neighbours nothing can be done
  // with them.
  listens_to_all_ = true;
  bus_->SubscribeQuietly(run_ + "/", "/" + std::string(TopicName(Topic::kTransform)),
                         [this](std::string_view channel, const uint8_t* data, size_t size) {
                           // Counted as received when it is taken, if it ever is.
                           if (!Check<morphbus::transform_t>(data, size, {model_hash_, 0})) {
                             ++ledger_->bad;
                             return;
                           }
                           if (early_.size() >= kMostEarlyTransforms || size > kMaxPayloadBytes)
                             return;
                           early_.try_emplace(std::string(channel), data, data + size);
                         });
}

void NeighbourMail::ListenToKnown() {
  if (!std::exchange(listens_to_all_, false)) return;
  // What was kept of modules that are no neighbours is of no use any more.
  early_.clear();
  bus_->Unsubscribe(run_ + "/");
}

void NeighbourMail::Listen(uint16_t mate, const std::string& name) {
  const auto [box, added] = boxes_.try_emplace(mate);
  if (!added) return;
  box->second.name = name;
  bus_->Subscribe(
      ChannelOf(name),
      [this, mate](std::string_view, const uint8_t* data, size_t size) {
        handler_(mate, data, size);
      },
      kTransformInterest);
  // The neighbour may have spoken before it was known to be one, and does not say it again unasked.
  const auto early = early_.extract(ChannelOf(name));
  if (!early.empty()) handler_(mate, early.mapped().data(), early.mapped().size());
}

bool NeighbourMail::full() const { return boxes_.size() >= kMostBoxes; }

std::vector<uint16_t> NeighbourMail::ForgetAllBut(const std::vector<uint16_t>& mates) {
  std::vector<uint16_t> forgotten;
  for (auto it = boxes_.begin(); it != boxes_.end();) {
    const bool mated = std::ranges::count(mates, it->first) > 0;
    if (!mated) {
      // The caller must forget the module, too: should it dock again it is a new neighbour.
      bus_->Unsubscribe(ChannelOf(it->second.name));
      forgotten.push_back(it->first);
    }
    it = mated ? std::next(it) : boxes_.erase(it);
  }
  return forgotten;
}

NeighbourMail::Box* NeighbourMail::BoxOf(uint16_t mate) {
  const auto found = boxes_.find(mate);
  return found == boxes_.end() ? nullptr : &found->second;
}

}  // namespace morphbus::bridge
