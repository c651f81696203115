#pragma once
// A log played for one client: at its own pace, from where it wants, with nothing left out.

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "bridge/outward/converter.h"
#include "logger/log/ordered_log.h"
#include "tools/monitor/log_index.h"

namespace morphbus::tools {

/// Plays one log. Times are sim time; `now_s` is any clock that does not go back.
class LogPlayer {
 public:
  /// Begins at the log's start, playing at speed 1. Fails if the file cannot be read any more.
  static Result<std::unique_ptr<LogPlayer>> Create(std::shared_ptr<const LogIndex> index,
                                                   double now_s);

  /// Sends events that are due, at most `most`; true if there are more that are due.
  bool Advance(double now_s, int most, const bridge::OutwardSink& sink);
  /// Goes to a sim time (µs; the nearest that the log has): sends the state there, and goes on from
  /// it.
  void Seek(int64_t time_us, double now_s, const bridge::OutwardSink& sink);
  /// Goes on from where it is, or pauses there.
  void Play(bool playing, double now_s);
  /// Times real time, 0 or more; 0: as fast as possible. From here on, without a leap.
  void SetSpeed(double speed, double now_s);
  /// At which sim time to pause, µs.
  void PlayUntil(int64_t time_us) { until_us_ = time_us; }
  /// Plays so many ticks (at least one), as fast as can be, and pauses.
  void Step(int64_t ticks, double now_s);

  /// False while it is paused, or at the log's end.
  [[nodiscard]] bool playing() const { return playing_; }
  /// The speed that was set: times real time; 0: as fast as possible.
  [[nodiscard]] double speed() const { return speed_; }
  /// What is known where it has come to.
  [[nodiscard]] const bridge::Converter& converter() const { return converter_; }
  /// The sim time that it has come to, µs.
  [[nodiscard]] int64_t time_us() const { return converter_.time_us(); }

 private:
  LogPlayer(std::shared_ptr<const LogIndex> index, std::unique_ptr<logger::OrderedLogReader> reader,
            double now_s);
  /// Reads the next event into event_, if it is not there already. False at the end.
  bool Peek();
  /// Sends what channels had said by the time that it has come to, if that was not sent yet.
  void SendCounts(const bridge::OutwardSink& sink);
  /// Converts the event that was peeked.
  void TakeEvent(const bridge::OutwardSink& sink);

  std::shared_ptr<const LogIndex> index_;
  std::unique_ptr<logger::OrderedLogReader> reader_;
  std::string clock_channel_;  ///< Where CLOCK is.
  bridge::Converter converter_;
  logger::LogEvent event_;
  bool peeked_ = false;
  int64_t event_time_us_ = 0;  ///< Of the event that was peeked, or of the last that had one.
  int64_t next_count_ = 0;     ///< Index into LogIndex::counts.
  bool begun_ = false;         ///< Whether description and scene were sent.
  bool playing_ = true;
  double speed_ = 1.0;
  bool stepping_ = false;  ///< Until the next pause the speed does not count.
  int64_t until_us_;
  // What was due when: at `anchor_s_`, what is of `anchor_us_`.
  double anchor_s_;
  int64_t anchor_us_ = 0;
};

}  // namespace morphbus::tools
