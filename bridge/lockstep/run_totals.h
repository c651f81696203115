#pragma once
// Whether everybody in a run speaks of the same messages. At the end every process tells what it
// published and what it took, channel by channel; both sides count the same messages on their own,
// and a message that somebody else put on the bus in a publisher's name shows as a difference.
//
// A publisher knows who must have taken what, without being told: the sim every part of SENSORS by
// the modules in it, and a module its TRANSFORM of a tick by those that it is mated to in the next
// one, since connections are mutual. So a pair can be compared though one side took only a part of
// what the other published.

#include <cstdint>
#include <map>
#include <morphbus/ask_t.hpp>
#include <morphbus/taken_total_t.hpp>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "bridge/wire/stream_hash.h"

namespace morphbus::bridge {

/// Messages that one process took from one channel, in any order: how many, and the sum (modulo
/// 2^64) of the hashes of their bytes. Every payload names its tick, so order needs no place in it.
struct TakenSum {
  int64_t count = 0;
  uint64_t sum = 0;
  /// Adds a message by the XXH3 of its bytes (MessageDigest).
  void Add(uint64_t digest) {
    ++count;
    sum += digest;
  }
  bool operator==(const TakenSum&) const = default;
};

/// What a process says of a run at its end.
struct TotalsReport {
  /// What it published; the logger: what it recorded.
  std::vector<morphbus::channel_total_t> totals;
  /// What it took, and what others must have taken of what it published.
  std::vector<morphbus::taken_total_t> taken;
};

/// The report as the messages that carry it, each small enough for a datagram; at least one.
/// @param pattern  what all of them have in common.
std::vector<morphbus::ask_t> SplitReport(const morphbus::ask_t& pattern,
                                         const TotalsReport& report);

/// Puts the parts of one process's report together. A process that acknowledges a later tick than
/// before reports anew.
class ReportParts {
 public:
  /// What a part was: one that is needed still, one that is not needed (any more), one that says
  /// something else than the same part did before or has another number of parts, or the last one
  /// needed.
  enum class Kind : uint8_t { kPart, kRepeated, kContradicts, kComplete };
  /// Takes a part (KIND_END_ACK).
  Kind Take(const morphbus::ask_t& part);
  /// The whole report; complete once Take said so.
  [[nodiscard]] const TotalsReport& report() const { return report_; }
  [[nodiscard]] bool complete() const { return missing_ == 0; }
  /// What all parts say besides, of conflicts in real time.
  [[nodiscard]] const std::string& verdict() const { return verdict_; }

 private:
  /// Hashes of the parts' content; none for a part that has not come.
  std::vector<std::optional<uint64_t>> parts_;
  int missing_ = -1;                ///< Parts that have not come; -1 before the first one.
  int64_t acknowledged_tick_ = -1;  ///< What the report speaks of.
  TotalsReport report_;
  std::string verdict_;
};

/// Collects both sides of every channel, and finds where they differ.
class RunTotals {
 public:
  /// `publisher` says that `taker` must have taken this of one of its channels.
  /// @param part  of a tick's messages on SENSORS; -1 on other channels.
  void Given(const std::string& channel, int part, const std::string& taker, const TakenSum& what);
  /// `taker` says what it took. `hash` is a sum or, where all messages of the channel are meant,
  /// the channel's hash: both sides must use the same.
  void Taken(const std::string& channel, int part, const std::string& taker, const TakenSum& what);
  /// The process has told all that it has to tell. Nothing is compared of processes that did not.
  void Reported(const std::string& process) { reported_.insert(process); }

  /// Names the process and the channel, of the first difference in order of channels, and says how
  /// many more there are; empty if all agree.
  /// @param lossy  messages may have been lost for good: whoever took fewer than there were took
  ///               some of them, as far as anybody can tell.
  [[nodiscard]] std::string Disagreement(bool lossy = false) const;

 private:
  struct Sides {
    std::optional<TakenSum> given, taken;
  };
  /// By channel, part and taker.
  std::map<std::tuple<std::string, int, std::string>, Sides> pairs_;
  std::set<std::string> reported_;
};

}  // namespace morphbus::bridge
