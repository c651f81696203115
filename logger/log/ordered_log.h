#pragma once
// The events of a log in the order of a run's ticks, for readers that follow the run through them.

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "logger/log/event_log.h"

namespace morphbus::logger {

/// Reads a log as EventLogReader does, but with its messages in the order in which our logger
/// writes them: tick by tick, and in a tick by topic and channel. A recording of another program
/// has them as they came; what was lost on the way to somebody and sent again stands later, and so
/// does what was late in real time. Other events stay beside what they stood beside. Memory holds
/// as many ticks as the file is disordered by, kMostTicks at most; of a file in order nothing is
/// held.
class OrderedLogReader {
 public:
  /// What stands farther behind than this is no late message, but another beginning.
  static constexpr int64_t kMostTicks = 256;

  /// Opens a log, and reads it once to know by how much it is disordered. `run` is the run whose
  /// ticks count; empty: the file's order stays. Fails if the file cannot be read.
  static Result<std::unique_ptr<OrderedLogReader>> Open(const std::string& path,
                                                        const std::string& run);
  /// The same for who knows from another reader by how many ticks the log is disordered.
  static Result<std::unique_ptr<OrderedLogReader>> Open(const std::string& path,
                                                        const std::string& run, int64_t disorder);
  [[nodiscard]] int64_t disorder() const { return disorder_; }

  /// The next event, valid until the next call; false at the end.
  bool Next(LogEvent* event);
  /// Reads on at a byte that position() has told.
  void Seek(uint64_t offset);
  /// The byte of the file from which on nothing has been handed out yet.
  [[nodiscard]] uint64_t position() const;
  /// The reader beneath, for what it found.
  [[nodiscard]] const EventLogReader& file() const { return *file_; }

 private:
  /// Where an event stands: tick, topic, channel, number of the message; last its byte in the file.
  using Place = std::tuple<int64_t, int, std::string, int64_t, uint64_t>;
  /// An event with its bytes.
  struct Held {
    LogEvent event;
    std::string channel;
    std::vector<uint8_t> data;
  };

  OrderedLogReader(std::unique_ptr<EventLogReader> file, std::string run, int64_t disorder)
      : file_(std::move(file)), run_(std::move(run)), disorder_(disorder) {}
  /// Of what is no message of a tick, that is the end of the newest tick.
  Place PlaceOf(const LogEvent& event);

  std::unique_ptr<EventLogReader> file_;
  std::string run_;
  int64_t disorder_;    ///< By so many ticks a message stands too late at most.
  int64_t newest_ = 0;  ///< The newest tick that was read.
  bool ended_ = false;
  std::map<Place, Held> held_;
  Held given_;  ///< The event that Next returned, if it was held.
};

}  // namespace morphbus::logger
