#pragma once
// Spreads a new program from module to module while the robot runs. The newest replaces the old on
// every module it can reach; each module asks its neighbours for the pieces it lacks, so that
// losses, repeats and late joiners need no special case. A module runs the old program until it
// holds every byte of the new one, its verifier has accepted it, and the tick has come that the
// package names. It hands a program on as soon as it is accepted, before it runs it.
//
// Which of two is newer: the higher version, and so the one that was deployed later; of equal
// versions, which two deployers give that know nothing of each other, the higher id. So one wins
// everywhere, whatever arrives first.
//
// Use, each tick: Receive(input); if ready(), verify the package, then Hold() or Refuse(); if
// held() and its tick has come, Vm::ReplaceProgram and Accept(); after Vm::Tick,
// Fill(&output.message).

#include <cstdint>

#include "vm/module_api.h"
#include "vm/spread/package.h"

namespace morphbus::vm {

/// Ticks after which a module `hops` dockings away holds a package of this size that another one
/// holds now, if no message is lost and none is full: each hands it on once it has the whole.
int64_t SpreadTicks(uint32_t package_size, int hops);

/// The relay's whole state: flat, as large as two packages.
struct RelayState {
  ProgramNews running;  ///< What this module runs (version and id).
  uint32_t running_size = 0;
  ProgramFragment incoming;   ///< Header of what comes next; its bytes are unused.
  uint8_t held = 0;           ///< 1: that is whole and verified, and waits for its tick.
  int64_t offered_tick = 0;   ///< When a neighbour offered it last.
  ProgramNews refused;        ///< The newest that the verifier refused.
  uint32_t newest_heard = 0;  ///< The highest version that this module knows of.
  uint32_t want_offset = 0;   ///< Lowest piece that a neighbour asked for in this tick,
  uint8_t wanted = 0;         ///< if any did.
  uint32_t serve_offset = 0;  ///< Next piece to hand out.
  uint32_t pieces_missing = 0;
  uint8_t active = 0;  ///< Which of `packages` runs; the other one is what comes next.
  uint8_t have_piece[kMaxPackageBytes / kFragmentBytes + 1] = {};
  uint8_t packages[2][kMaxPackageBytes] = {};
};

class ProgramRelay {
 public:
  /// `state` is either all zero, before Start, or saved from an earlier relay.
  explicit ProgramRelay(RelayState* state) : state_(*state) {}

  /// The program this module was started with; copied. `size` at most kMaxImageBytes.
  void Start(const uint8_t* image, uint32_t size, uint64_t hash, uint32_t version = 1);

  /// Hands a new package (verified by the caller, of at most kMaxPackageBytes) to this module, from
  /// where it spreads. Its version is its number, or one above the newest heard of if that is more.
  /// It is ready() at once.
  void Deploy(const uint8_t* package, uint32_t size, uint64_t id, uint32_t number = 0);

  /// Takes the neighbours' news and pieces. What nobody has offered for kSilentTicks and is not
  /// whole is given up: whoever had it is gone.
  void Receive(const TickInput& input);

  /// True when a newer package is complete and waits for Hold or Refuse.
  [[nodiscard]] bool ready() const;
  [[nodiscard]] const uint8_t* incoming_package() const {
    return state_.packages[1 - state_.active];
  }
  [[nodiscard]] uint32_t incoming_size() const { return state_.incoming.image_size; }
  [[nodiscard]] uint64_t incoming_id() const { return state_.incoming.hash; }

  /// The verifier accepted the package: neighbours get it from now on, though it does not run yet.
  void Hold() { state_.held = 1; }
  /// True from Hold() on, until the package runs or a newer one takes its place.
  [[nodiscard]] bool held() const { return state_.held != 0; }
  /// What is held runs from now on; its bytes stay where incoming_package() pointed.
  void Accept();
  /// The verifier refused it; the old goes on, and this one is never asked for again.
  void Refuse();

  /// Nothing has come, was asked for or was deployed since Start: a relay that is started with the
  /// same program is in the same state.
  [[nodiscard]] bool AsStarted() const;
  /// The image of the program that runs.
  [[nodiscard]] const uint8_t* running_image() const {
    return state_.packages[state_.active] + kPackageHeadBytes;
  }
  [[nodiscard]] uint32_t running_size() const { return state_.running_size - kPackageHeadBytes; }

  /// Adds news and, where a neighbour wants one and the message has room, a piece. Call after
  /// Vm::Tick.
  void Fill(NeighbourMessage* message);

 private:
  void Begin(uint32_t version, uint64_t id, uint32_t size);
  void OnNews(const ProgramNews& news, int64_t tick);
  void TakePiece(const ProgramFragment& piece);
  /// The newest package that this module can hand on, and its bytes and size.
  [[nodiscard]] ProgramNews Newest() const;
  [[nodiscard]] const uint8_t* newest_package() const;
  [[nodiscard]] uint32_t newest_size() const;

  RelayState& state_;
};

}  // namespace morphbus::vm
