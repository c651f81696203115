#pragma once
// What one process publishes: numbering, hashing at first sending, keeping, sending again. Every
// message of a process goes through its one outbox, so the numbers on a channel have no gaps at the
// sender.

#include <cstdint>
#include <deque>
#include <map>
#include <morphbus/channel_total_t.hpp>
#include <string>
#include <utility>
#include <vector>

#include "bridge/bus/bus.h"
#include "bridge/wire/channels.h"
#include "bridge/wire/codec.h"
#include "bridge/wire/stream_hash.h"

namespace morphbus::bridge {

/// Ticks whose messages are kept for sending again, and by which the sim may be ahead of the
/// logger.
inline constexpr int64_t kKeptTicks = 16;

/// Who sends: what the header of every message says.
struct Sender {
  /// Name of the run, the first part of every channel.
  std::string run;
  std::string process;  ///< "SIM", "LOG" or a module's name.
  /// Hashes of the model and of the program that the messages speak of.
  uint64_t model_hash = 0;
  uint64_t program_hash = 0;  ///< 0 for processes that run none.
};

/// The sending side of a process: what is on a hashed channel is numbered, hashed once, kept for
/// the window, and sent again byte for byte when asked for.
class Outbox {
 public:
  /// @param bus, ledger  outlive the outbox; the ledger's `sent` and `resent` are counted here.
  Outbox(Bus* bus, Sender sender, Ledger* ledger);

  /// Fills the header (number on the channel, tick, time, hashes), encodes, hashes, keeps,
  /// publishes. A message over kMaxPayloadBytes is our bug: senders split before.
  /// @param channel      full name of one of the run's channels.
  /// @param tick         tick that the message speaks of; on hashed channels it never falls.
  /// @param sim_time_us  sim time at which that tick begins.
  /// @param message      of type M; its `header` is overwritten.
  template <class M>
  void Send(const std::string& channel, int64_t tick, int64_t sim_time_us, M* message);

  /// A module's program was replaced: from now on headers speak of this one.
  void SetProgramHash(uint64_t hash) { sender_.program_hash = hash; }

  /// Publishes kept messages first..last of `channel` again, byte for byte. Returns how many of
  /// them were still kept; 0 for a channel on which nothing was sent.
  int Resend(const std::string& channel, int64_t first, int64_t last);

  /// From now on messages on hashed channels are numbered, hashed and kept but not published, until
  /// Release() publishes them in order: so that they can be saved first (see Save).
  void Hold();
  /// Publishes what was held back, and holds nothing back any more.
  void Release();

  /// Number the next message on `channel` will get: how many there were.
  [[nodiscard]] int64_t count(const std::string& channel) const;

  /// Count and hash of the hashed channels, in order of name.
  [[nodiscard]] std::vector<ChannelTotal> totals() const;

  /// All channels (numbers, hashes, kept messages) as bytes, and back: a resumed process goes on
  /// with them.
  void Save(std::vector<uint8_t>* out) const;
  /// Replaces everything by what Save wrote, and returns the number of bytes used. Fails if the
  /// bytes are cut short or name what no outbox has; then the outbox must not be used any more.
  Result<size_t> Load(const uint8_t* data, size_t size);

  /// Who sends.
  [[nodiscard]] const Sender& sender() const { return sender_; }

 private:
  /// A message that may be asked for again.
  struct Kept {
    /// Its number on the channel, and the tick by which it is thrown away.
    int64_t sequence = 0;
    int64_t tick = 0;
    /// The whole message as it was published.
    std::vector<uint8_t> bytes;
  };
  /// What was sent on one channel.
  struct Stream {
    /// How many messages there were, kept or not.
    int64_t next_sequence = 0;
    /// Whether the channel counts for the run's hash, and the hash of what was sent on it.
    bool hashed = false;
    StreamHash hash;
    std::deque<Kept> kept;  ///< Hashed channels only, oldest first.
  };

  /// The channel's stream, begun if need be. The channel must be one of the run's.
  Stream& StreamOf(const std::string& channel);
  /// Fills in all of the header but the CRC.
  void FillHeader(const Stream& stream, int64_t tick, int64_t sim_time_us,
                  morphbus::header_t* header);
  /// Numbers, hashes, keeps and publishes what stands in scratch_.
  void Commit(const std::string& channel, Stream* stream, int64_t tick);

  Bus* bus_;
  Sender sender_;
  Ledger* ledger_;
  // By full name of the channel.
  std::map<std::string, Stream> streams_;
  // The message that is being sent, encoded; used again and again.
  std::vector<uint8_t> scratch_;
  /// Between Hold and Release.
  bool held_ = false;
  std::vector<std::pair<std::string, int64_t>> outgoing_;  ///< Channel, number: held back.
  std::vector<std::vector<uint8_t>> spare_;                ///< Buffers of messages no longer kept.
};

template <class M>
void Outbox::Send(const std::string& channel, int64_t tick, int64_t sim_time_us, M* message) {
  Stream& stream = StreamOf(channel);
  FillHeader(stream, tick, sim_time_us, &message->header);
  Encode(*message, &scratch_);
  Commit(channel, &stream, tick);
}

}  // namespace morphbus::bridge
