#include "bridge/bus/faulty_bus.h"

#include <cmath>
#include <utility>

#include "compiler/base/big_endian.h"

namespace morphbus::bridge {
namespace {

/// Bits that a random number has to spare, as many as a double holds exactly.
constexpr int kRandomBits = 53;

/// Where tick and sim time stand in a payload: behind fingerprint, CRC, auth and protocol
/// (lcmtypes/header_t.lcm).
constexpr size_t kTickOffset = 24, kSimTimeOffset = 32, kSimTimeEnd = 40;

/// FNV-1a: names that differ give the random numbers another beginning.
uint64_t HashOf(std::string_view text) {
  uint64_t hash = 0xcbf29ce484222325ULL;
  for (const char c : text) hash = (hash ^ static_cast<uint8_t>(c)) * 0x100000001b3ULL;
  return hash;
}

/// Whether the rule is for messages of this time.
bool IsTime(const FaultRule& rule, int64_t tick, int64_t us) {
  return tick >= rule.from_tick && tick < rule.until_tick && us >= rule.from_us &&
         us < rule.until_us;
}

}  // namespace

FaultPlan WithLoss(FaultPlan plan, double loss, uint64_t seed) {
  if (!plan.seed) plan.seed = seed;
  if (loss <= 0) return plan;
  FaultRule rule;
  rule.loss = loss;
  plan.rules.push_back(rule);
  return plan;
}

bool MatchesPattern(std::string_view pattern, std::string_view text) {
  constexpr size_t kNone = std::string_view::npos;
  size_t p = 0, t = 0;
  // Where the last * was, and how far the text was when it stood for nothing yet. Only the last one
  // need ever stand for more, so this takes at most pattern times text steps.
  size_t star = kNone, star_text = 0;
  while (t < text.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      star_text = t;
    } else if (p < pattern.size() && (pattern[p] == '?' || pattern[p] == text[t])) {
      ++p;
      ++t;
    } else if (star != kNone) {
      p = star + 1;
      t = ++star_text;
    } else {
      return false;
    }
  }
  return pattern.find_first_not_of('*', p) == kNone;
}

FaultyBus::FaultyBus(Bus* inner, const FaultPlan& plan, std::string_view process,
                     std::function<int64_t()> now_us)
    : ForwardingBus(inner),
      random_(plan.seed.value_or(1) ^ HashOf(process)),
      now_us_(std::move(now_us)) {
  for (const FaultRule& rule : plan.rules) {
    // The receiver never changes, so rules for others are dropped once.
    if (MatchesPattern(rule.process, process)) rules_.push_back(rule);
  }
}

bool FaultyBus::Happens(double probability) {
  // What cannot happen takes no number, so that a rule more leaves the others' draws alone.
  if (!(probability > 0)) return false;
  const auto threshold = static_cast<uint64_t>(std::ldexp(std::fmin(probability, 1), kRandomBits));
  return random_.Next() >> (64 - kRandomBits) < threshold;
}

std::vector<FaultyBus::Fate> FaultyBus::Draw(std::string_view channel, const uint8_t* data,
                                             size_t size) {
  // What has no header of ours counts as of the beginning.
  const bool dated = size >= kSimTimeEnd;
  const auto number = [&](size_t at) {
    return dated ? static_cast<int64_t>(LoadBigEndian<uint64_t>(data + at)) : 0;
  };
  const int64_t tick = number(kTickOffset), us = number(kSimTimeOffset);
  // Patterns are of the channel without the run's name, which is another one in each run.
  const std::string_view local = channel.substr(channel.find('/') + 1);
  std::vector<const FaultRule*> rules;
  for (const FaultRule& rule : rules_) {
    if (IsTime(rule, tick, us) && MatchesPattern(rule.channel, local)) rules.push_back(&rule);
  }
  // Each rule draws for itself: two that lose a half lose three quarters.
  size_t copies = 1;
  for (const FaultRule* rule : rules) {
    if (Happens(rule->loss)) return {};
    if (Happens(rule->duplicate)) copies = 2;
  }
  // Each copy is late or damaged by draws of its own; delays of several rules add up.
  std::vector<Fate> fates(copies);
  for (Fate& fate : fates) {
    for (const FaultRule* rule : rules) {
      if (Happens(rule->reorder)) {
        fate.delay += 1 + static_cast<int>(random_.Next() % static_cast<uint64_t>(rule->delay));
      }
      if (now_us_ && Happens(rule->late)) {
        fate.late_us +=
            1 + static_cast<int64_t>(random_.Next() % static_cast<uint64_t>(rule->by_us));
      }
      fate.damaged = Happens(rule->corrupt) || fate.damaged;
    }
  }
  return fates;
}

void FaultyBus::Damage(std::vector<uint8_t>* bytes) {
  if (bytes->empty()) return;
  // Unlike bits, since two flips of one would undo each other.
  const size_t bits = 8 * bytes->size();
  const size_t first = random_.Next() % bits;
  const size_t flips = 1 + random_.Next() % 3;
  for (size_t i = 0; i < flips; ++i) {
    const size_t bit = (first + i * (1 + first % 3)) % bits;
    (*bytes)[bit / 8] ^= static_cast<uint8_t>(1 << bit % 8);
  }
}

void FaultyBus::Deliver(const Delayed& message) {
  // The subscription may have ended while the message was held.
  const auto found = handlers_.find(message.key);
  if (found == handlers_.end()) return;
  // What has no subscriber any more is not counted, so that a receiver's bad messages can be
  // compared with this.
  injected_.corrupted += message.damaged ? 1 : 0;
  // The handler is kept alive while it runs: it may replace its own subscription.
  const std::shared_ptr<Handler> handler = found->second;
  (*handler)(message.channel, message.bytes.data(), message.bytes.size());
}

void FaultyBus::Overtake(size_t count) {
  std::vector<Delayed> due, waiting;
  for (size_t i = 0; i < delayed_.size(); ++i) {
    // Only those that waited before this message came were overtaken by it.
    const bool over = i < count && --delayed_[i].remaining == 0;
    (over ? due : waiting).push_back(std::move(delayed_[i]));
  }
  delayed_ = std::move(waiting);
  for (const Delayed& message : due) Deliver(message);
}

Bus::Handler FaultyBus::Wrap(const Key& key) {
  return [this, key](std::string_view channel, const uint8_t* data, size_t size) {
    // Copies of this message that are held from now on were not overtaken by it.
    const size_t waiting = delayed_.size();
    const std::vector<Fate> fates = Draw(channel, data, size);
    injected_.discarded += fates.empty() ? 1 : 0;
    injected_.doubled += fates.size() > 1 ? 1 : 0;
    for (const Fate& fate : fates) {
      Delayed copy = {key, std::string(channel), {data, data + size}, fate.damaged, fate.delay};
      if (fate.damaged) Damage(&copy.bytes);
      injected_.delayed += fate.delay > 0 || fate.late_us > 0 ? 1 : 0;
      if (fate.late_us > 0) {
        // Sorted by when they are due; DeliverLate is called from outside, as a bus has no thread.
        late_.emplace(now_us_() + fate.late_us, std::move(copy));
      } else if (fate.delay == 0) {
        Deliver(copy);
      } else {
        delayed_.push_back(std::move(copy));
      }
    }
    // Last, so that those which waited come behind this message, which overtook them.
    Overtake(waiting);
  };
}

BusLosses FaultyBus::losses() const {
  BusLosses losses = inner_->losses();
  losses.discarded += injected_.discarded;
  losses.doubled += injected_.doubled;
  losses.delayed += injected_.delayed;
  losses.corrupted += injected_.corrupted;
  return losses;
}

std::optional<int64_t> FaultyBus::next_late_us() const {
  if (late_.empty()) return std::nullopt;
  return late_.begin()->first;
}

void FaultyBus::DeliverLate() {
  // What a handler does may make further messages late, which are not due yet.
  while (!late_.empty() && late_.begin()->first <= now_us_()) {
    const Delayed message = std::move(late_.begin()->second);
    late_.erase(late_.begin());
    Deliver(message);
  }
}

void FaultyBus::Receive(const Channels& channels, Handler handler) {
  // A receiver that no rule is for needs no copies of its messages.
  if (rules_.empty()) return inner_->Receive(channels, std::move(handler));
  const Key key(channels.name, channels.by);
  handlers_[key] = std::make_shared<Handler>(std::move(handler));
  inner_->Receive(channels, Wrap(key));
}

void FaultyBus::Unsubscribe(const std::string& channel) {
  std::erase_if(handlers_, [&](const auto& entry) { return entry.first.first == channel; });
  inner_->Unsubscribe(channel);
}

}  // namespace morphbus::bridge
