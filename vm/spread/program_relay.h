#pragma once
// Spreads a new program from module to module while the robot runs. The newest (version, then hash)
// replaces the old on every module it can reach; each module asks its neighbours for the pieces it
// lacks, so that losses, repeats and late joiners need no special case. A module runs the old
// program until it holds every byte of the new one and its verifier has accepted it.
//
// Use, each tick: Receive(input); if ready(), verify image(), then Vm::ReplaceProgram and Accept(),
// or Refuse(); after Vm::Tick, Fill(&output.message).

#include <cstdint>

#include "vm/module_api.h"

namespace morphbus::vm {

/// The relay's whole state: flat, as large as two images.
struct RelayState {
  ProgramNews running;  ///< What this module runs (version and hash).
  uint32_t running_size = 0;
  ProgramFragment incoming;   ///< Header of what is being collected; its bytes are unused.
  ProgramNews refused;        ///< The newest that the verifier refused.
  uint32_t want_offset = 0;   ///< Lowest piece that a neighbour asked for in this tick,
  uint8_t wanted = 0;         ///< if any did.
  uint32_t serve_offset = 0;  ///< Next piece to hand out.
  uint32_t pieces_missing = 0;
  uint8_t active = 0;  ///< Which of `images` runs; the other one is being filled.
  uint8_t have_piece[kMaxImageBytes / kFragmentBytes] = {};
  uint8_t images[2][kMaxImageBytes] = {};
};

class ProgramRelay {
 public:
  /// `state` is either all zero, before Start, or saved from an earlier relay.
  explicit ProgramRelay(RelayState* state) : state_(*state) {}

  /// The program this module was started with; copied. `size` at most kMaxImageBytes.
  void Start(const uint8_t* image, uint32_t size, uint64_t hash, uint32_t version = 1);

  /// Hands a new program (verified by the caller) to this module, from where it spreads. Its
  /// version is one above the newest heard of. It is ready() at once.
  void Deploy(const uint8_t* image, uint32_t size, uint64_t hash);

  /// Takes the neighbours' news and pieces.
  void Receive(const TickInput& input);

  /// True when a newer program is complete and waits for Accept or Refuse.
  [[nodiscard]] bool ready() const;
  [[nodiscard]] const uint8_t* incoming_image() const { return state_.images[1 - state_.active]; }
  [[nodiscard]] uint32_t incoming_size() const { return state_.incoming.image_size; }
  [[nodiscard]] uint64_t incoming_hash() const { return state_.incoming.hash; }

  /// The incoming program runs from now on; its bytes stay where incoming_image() pointed.
  void Accept();
  /// The verifier refused it; the old goes on, and this one is never asked for again.
  void Refuse();

  [[nodiscard]] const uint8_t* running_image() const { return state_.images[state_.active]; }
  [[nodiscard]] uint32_t running_size() const { return state_.running_size; }

  /// Adds news and, where a neighbour wants one and the message has room, a piece. Call after
  /// Vm::Tick.
  void Fill(NeighbourMessage* message);

 private:
  void Begin(uint32_t version, uint64_t hash, uint32_t size);
  void OnNews(const ProgramNews& news);
  void TakePiece(const ProgramFragment& piece);

  RelayState& state_;
};

}  // namespace morphbus::vm
