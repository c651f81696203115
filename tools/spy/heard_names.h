#pragma once
// What is kept under names that come from the bus: never more than so many of them.

#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <string_view>

namespace morphbus::tools {

/// Entries by name. Anybody can invent names: beyond the limit a new one gets a place only where a
/// name was heard once or twice and then not for ten seconds, or not for a minute at all. So a
/// flood of invented names neither grows nor keeps out what really is on the bus.
template <class Value>
class HeardNames {
 public:
  /// `most`: how many names find a place.
  explicit HeardNames(size_t most) : most_(most) {}

  /// The entry of `name`, which was heard at `now_ns` (nanoseconds on any clock); null if there is
  /// no place for it. It is valid until the next call.
  Value* Take(std::string_view name, int64_t now_ns) {
    auto found = entries_.find(name);
    if (found == entries_.end()) {
      if (entries_.size() >= most_ && !MakeRoom(now_ns) && !Sweep(now_ns)) {
        ++refused_;
        return nullptr;
      }
      found = entries_.try_emplace(std::string(name)).first;
      rare_.push_back(found->first);
    }
    ++found->second.heard;
    found->second.last_ns = now_ns;
    return &found->second.value;
  }
  /// The entry of `name`; null if there is none.
  [[nodiscard]] const Value* Find(std::string_view name) const {
    const auto found = entries_.find(name);
    return found == entries_.end() ? nullptr : &found->second.value;
  }
  /// Calls `visit(name, value)` for each in order of name.
  template <class Visit>
  void ForEach(const Visit& visit) const {
    for (const auto& [name, entry] : entries_) visit(name, entry.value);
  }
  /// Names that have a place now.
  [[nodiscard]] size_t size() const { return entries_.size(); }
  /// How often a name found no place.
  [[nodiscard]] int64_t refused() const { return refused_; }
  /// Names that had to make room.
  [[nodiscard]] int64_t dropped() const { return dropped_; }

 private:
  // A name heard so often is there to stay; another one has to be silent for so long.
  static constexpr int64_t kOften = 3;
  static constexpr int64_t kSilentNs = 10'000'000'000;
  static constexpr int64_t kGoneNs = 60'000'000'000;

  /// A value, how often its name was heard, and when last.
  struct Entry {
    Value value = {};
    int64_t heard = 0;
    int64_t last_ns = 0;
  };

  /// Drops the oldest of the rare names if it has been silent for long. Each name stands in the row
  /// once, so that this costs little however many come.
  bool MakeRoom(int64_t now_ns) {
    while (!rare_.empty()) {
      const auto oldest = entries_.find(rare_.front());
      if (oldest != entries_.end() && oldest->second.heard < kOften) {
        if (now_ns - oldest->second.last_ns < kSilentNs) return false;
        entries_.erase(oldest);
        rare_.pop_front();
        ++dropped_;
        return true;
      }
      rare_.pop_front();
    }
    return false;
  }

  /// Drops all that have been silent for a minute; looks for them every ten seconds at most.
  bool Sweep(int64_t now_ns) {
    if (swept_ns_ != 0 && now_ns - swept_ns_ < kSilentNs) return false;
    swept_ns_ = now_ns;
    const size_t gone = std::erase_if(
        entries_, [&](const auto& named) { return now_ns - named.second.last_ns > kGoneNs; });
    dropped_ += static_cast<int64_t>(gone);
    return gone > 0;
  }

  size_t most_;
  /// By name; std::less<> lets it be searched without making a string of each name.
  std::map<std::string, Entry, std::less<>> entries_;
  std::deque<std::string> rare_;  ///< Names in order of their first message.
  int64_t refused_ = 0;
  int64_t dropped_ = 0;
  int64_t swept_ns_ = 0;  ///< When Sweep looked last; 0: never.
};

}  // namespace morphbus::tools
