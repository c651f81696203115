#pragma once
// What one process publishes: numbering, hashing at first sending, keeping, sending again. Every
// message of a process goes through its one outbox, so the numbers on a channel have no gaps at the
// sender.

#include <cstdint>
#include <deque>
#include <morphbus/channel_total_t.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bridge/wire/channels.h"
#include "bridge/wire/codec.h"
#include "bridge/wire/health.h"
#include "bridge/wire/stream_hash.h"
#include "compiler/base/text_hash.h"

namespace morphbus::bridge {

/// Ticks whose messages are kept for sending again, and by which the sim may be ahead of the
/// logger.
inline constexpr int64_t kKeptTicks = 16;

/// A message is sent again at requests at most once in the shorter of these times, microseconds, so
/// that those who ask at once share an answer; and from the seventeenth time on in the longer one,
/// since a request that the bus repeats must not multiply.
inline constexpr int64_t kSoonAgainUs = 100;
inline constexpr int64_t kResendPauseUs = 2000;

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
  void Send(const std::string& channel, int64_t tick, int64_t sim_time_us, M* message) {
    Streams::value_type& to = StreamOf(channel);
    FillHeader(to.second, tick, sim_time_us, &message->header);
    Encode(*message, &scratch_);
    Commit(&to, tick);
  }

  /// Numbers on channels outside the hash begin with this process' share of them, since those that
  /// an earlier process of this name used up count as had. Call before the first Send.
  /// @param incarnation, restarts  of the process: the later, the higher its share; from 1 and 0.
  void BeginAt(uint32_t incarnation, int64_t restarts);

  /// A module's program was replaced: from now on headers speak of this one.
  void SetProgramHash(uint64_t hash) { sender_.program_hash = hash; }

  /// Publishes kept messages first..last of `channel` again, byte for byte. Returns how many of
  /// them were sent; 0 for a channel on which nothing was sent.
  /// @param asked_us  wall time of the request that this answers, if it is one: what was sent again
  ///                  at another a moment ago (kSoonAgainUs) is left out.
  int Resend(const std::string& channel, int64_t first, int64_t last,
             std::optional<int64_t> asked_us = std::nullopt);

  /// From now on messages on hashed channels are numbered, hashed and kept but not published, until
  /// Release() publishes them in order: so that they can be saved first (see Save).
  void Hold();
  /// Publishes what was held back, and holds nothing back any more.
  void Release();

  /// Somebody else has published `count` messages on this channel, of which nothing is known but
  /// their number: ours follow on. There is no hash of the whole channel here, so totals() leaves
  /// it out. Call before the first Send on it.
  void ContinueAfter(const std::string& channel, int64_t count);

  /// Number the next message on `channel` will get: how many there were.
  [[nodiscard]] int64_t count(const std::string& channel) const;

  /// Count and hash of the hashed channels, in order of name.
  [[nodiscard]] std::vector<ChannelTotal> totals() const;

  /// The hashed channels (numbers, hashes, kept messages) as bytes, and back: a resumed process
  /// goes on with them.
  void Save(std::vector<uint8_t>* out) const;
  /// Replaces everything by what Save wrote, and returns the number of bytes used; on other
  /// channels this process' share of numbers is behind that of the one that saved. Fails if the
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
    /// Wall time before which no request has it sent again, and how many requests had.
    int64_t answered_until_us = 0;
    int times_answered = 0;
  };
  /// What was sent on one channel.
  struct Stream {
    /// How many messages there were, kept or not.
    int64_t next_sequence = 0;
    /// Whether the channel counts for the run's hash, and the hash of what was sent on it.
    bool hashed = false;
    StreamHash hash;
    /// The hash is not that of the whole channel, since somebody else published its beginning.
    bool partial = false;
    std::deque<Kept> kept;  ///< Hashed channels only, oldest first.
  };

  using Streams = TextTable<Stream>;

  /// The channel and its stream, begun if need be. The channel must be one of the run's.
  Streams::value_type& StreamOf(const std::string& channel);
  /// Fills in all of the header but the CRC.
  void FillHeader(const Stream& stream, int64_t tick, int64_t sim_time_us,
                  morphbus::header_t* header);
  /// Numbers, hashes, keeps and publishes what stands in scratch_.
  void Commit(Streams::value_type* to, int64_t tick);

  Bus* bus_;
  Sender sender_;
  Ledger* ledger_;
  // By full name of the channel.
  Streams streams_;
  int64_t first_unhashed_ = 0;  ///< Where the numbers of channels outside the hash begin.
  // The message that is being sent, encoded; used again and again.
  std::vector<uint8_t> scratch_;
  /// Between Hold and Release.
  bool holding_back_ = false;
  /// The channels of messages that are held back, and their places among the kept ones.
  std::vector<std::pair<const Streams::value_type*, const Kept*>> outgoing_;
  std::vector<std::vector<uint8_t>> spare_;  ///< Buffers of messages no longer kept.
};

}  // namespace morphbus::bridge
