#pragma once
// What one process publishes: numbering, hashing at first sending, keeping, sending again.

#include <cstdint>
#include <deque>
#include <map>
#include <morphbus/channel_total_t.hpp>
#include <string>
#include <utility>
#include <vector>

#include "bridge/bus.h"
#include "bridge/channels.h"
#include "bridge/codec.h"
#include "bridge/stream_hash.h"

namespace morphbus::bridge {

/// Ticks whose messages are kept for sending again, and by which the sim may be ahead of the
/// logger.
inline constexpr int64_t kKeptTicks = 16;

/// Who speaks: fills every header.
struct Speaker {
  std::string run;
  std::string process;  ///< "SIM", "LOG" or a module's name.
  uint64_t model_hash = 0;
  uint64_t program_hash = 0;  ///< 0 for processes that run none.
};

class Outbox {
 public:
  /// @param bus, ledger  outlive the outbox; the ledger's `sent` and `resent` are counted here.
  Outbox(Bus* bus, Speaker speaker, Ledger* ledger);

  /// Fills the header (number on the channel, tick, time, hashes), encodes, hashes, keeps,
  /// publishes. A message over kMaxPayloadBytes is our bug: senders split before.
  template <class M>
  void Send(const std::string& channel, int64_t tick, int64_t sim_time_us, M* message);

  /// A module's program was replaced: from now on headers speak of this one.
  void SetProgramHash(uint64_t hash) { speaker_.program_hash = hash; }

  /// Publishes kept messages first..last of `channel` again, byte for byte. Returns how many there
  /// were.
  int Resend(const std::string& channel, int64_t first, int64_t last);

  /// From now on messages on hashed channels are numbered, hashed and kept but not published, until
  /// Release() publishes them in order: so that they can be saved first (see Save).
  void Hold();
  void Release();

  /// Number the next message on `channel` will get: how many there were.
  [[nodiscard]] int64_t count(const std::string& channel) const;

  /// Count and hash of the hashed channels, in order of name.
  [[nodiscard]] std::vector<ChannelTotal> totals() const;

  /// All lines (numbers, hashes, kept messages) as bytes, and back: a resumed process goes on with
  /// them.
  void Save(std::vector<uint8_t>* out) const;
  /// Returns the number of bytes used.
  Result<size_t> Load(const uint8_t* data, size_t size);

  [[nodiscard]] const Speaker& speaker() const { return speaker_; }

 private:
  struct Kept {
    int64_t sequence = 0;
    int64_t tick = 0;
    std::vector<uint8_t> bytes;
  };
  /// One channel.
  struct Line {
    int64_t next_sequence = 0;
    bool hashed = false;
    StreamHash hash;
    std::deque<Kept> kept;  ///< Hashed channels only, oldest first.
  };

  Line& LineOf(const std::string& channel);
  void FillHeader(const Line& line, int64_t tick, int64_t sim_time_us, morphbus::header_t* header);
  void Commit(const std::string& channel, Line* line, int64_t tick);

  Bus* bus_;
  Speaker speaker_;
  Ledger* ledger_;
  std::map<std::string, Line> lines_;
  std::vector<uint8_t> scratch_;
  bool held_ = false;
  std::vector<std::pair<std::string, int64_t>> outgoing_;  ///< Channel, number: held back.
  std::vector<std::vector<uint8_t>> spare_;                ///< Buffers of messages no longer kept.
};

template <class M>
void Outbox::Send(const std::string& channel, int64_t tick, int64_t sim_time_us, M* message) {
  Line& line = LineOf(channel);
  FillHeader(line, tick, sim_time_us, &message->header);
  Encode(*message, &scratch_);
  Commit(channel, &line, tick);
}

}  // namespace morphbus::bridge
