#pragma once
// What a module took of SENSORS and of its neighbours' TRANSFORM, and what they must have taken of
// its own: its side of the comparison at the end of a run (bridge/lockstep/run_totals.h). Part of
// what a resumed process goes on with.

#include <cstdint>
#include <map>
#include <morphbus/taken_total_t.hpp>
#include <string>
#include <vector>

#include "bridge/lockstep/run_totals.h"
#include "bridge/lockstep/taken_blocks.h"
#include "compiler/base/result.h"

namespace morphbus::bridge {

/// Counts for one module. Its memory grows with the number of modules that it was ever mated to, of
/// which kMostMates are told apart at most; more only a made-up SENSORS can name.
class TakenLedger {
 public:
  static constexpr size_t kMostMates = 1024;

  /// The tick that is computed rests on this part of SENSORS.
  void TakeSensors(int64_t tick, int part, uint64_t digest);
  /// It rests on what a neighbour, by its name, said in the tick before; `digest` is of that
  /// message.
  void TakeTransform(int64_t tick, const std::string& mate, uint64_t digest);
  /// The neighbour takes in this tick what we said in the tick before.
  void GiveTransform(const std::string& mate) { Of(mate)->given.Add(own_transform_); }
  /// Our TRANSFORM of the present tick went out.
  void Published(uint64_t digest) { own_transform_ = digest; }

  /// All of it as KIND_END_ACK carries it.
  [[nodiscard]] std::vector<morphbus::taken_total_t> Report(const std::string& run,
                                                            const std::string& module) const;

  /// What was taken in the block of ticks that begins at `first` (taken_blocks.h).
  [[nodiscard]] std::vector<morphbus::taken_total_t> Recent(const std::string& run,
                                                            const std::string& module,
                                                            int64_t first) const;

  /// All of it as bytes, and back. Load returns the number of bytes used, and fails if they are cut
  /// short or damaged; then the ledger must not be used any more.
  void Save(std::vector<uint8_t>* out) const;
  Result<size_t> Load(const uint8_t* data, size_t size);

 private:
  /// What went to and fro between us and a neighbour.
  struct Mate {
    TakenSum taken, given;
    TakenBlocks recent;  ///< Of `taken`.
  };
  /// The neighbour's entry, begun if need be; beyond kMostMates one that all others share.
  Mate* Of(const std::string& mate);

  int64_t part_ = 0;  ///< Of SENSORS: where our own reading is.
  TakenSum sensors_;
  TakenBlocks recent_sensors_;
  uint64_t own_transform_ = 0;  ///< XXH3 of our last TRANSFORM.
  std::map<std::string, Mate> mates_;
};

}  // namespace morphbus::bridge
