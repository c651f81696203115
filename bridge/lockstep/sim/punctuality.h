#pragma once
// Real time: which modules answer late, and how late. The lockstep's machine counts deadlines; who
// missed them is told here, for HEALTH.

#include <cstdint>
#include <vector>

namespace morphbus::bridge {

/// Keeps, module by module, how many ticks were over before their answer had come.
class Punctuality {
 public:
  /// Of one module since the run began.
  struct Record {
    int64_t missed = 0;    ///< Ticks that were over before their answer had come.
    int64_t late = 0;      ///< Of these, those whose answer came later.
    int64_t worst_us = 0;  ///< The longest time from a tick's end to its answer, microseconds.
  };

  explicit Punctuality(int num_modules) : records_(static_cast<size_t>(num_modules)) {}

  /// A tick is over at `now_us` of wall time; call Missed for those that had not answered it.
  void TickOver(int64_t tick, int64_t now_us) { over_us_[Slot(tick)] = {tick, now_us}; }
  void Missed(int module) { ++records_[module].missed; }
  /// An answer to a tick that is over has come, for the first time. Of ticks that were over more
  /// than kRemembered ticks ago it is not known how late it is; it counts all the same.
  void CameLate(int module, int64_t tick, int64_t now_us) {
    Record& record = records_[module];
    // An answer that comes twice is late once.
    if (record.late == record.missed) return;
    ++record.late;
    const TickEnd& end = over_us_[Slot(tick)];
    if (end.tick == tick && now_us - end.us > record.worst_us) record.worst_us = now_us - end.us;
  }

  /// By module, in the order of the run.
  [[nodiscard]] const std::vector<Record>& records() const { return records_; }

 private:
  /// Ticks whose ends are remembered: 20 s of the default ones.
  static constexpr int64_t kRemembered = 1000;
  /// When a tick was over, microseconds of wall time.
  struct TickEnd {
    int64_t tick = -1;
    int64_t us = 0;
  };
  static size_t Slot(int64_t tick) { return static_cast<size_t>(tick % kRemembered); }

  std::vector<Record> records_;
  std::vector<TickEnd> over_us_ = std::vector<TickEnd>(kRemembered);
};

}  // namespace morphbus::bridge
