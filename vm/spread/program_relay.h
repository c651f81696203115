#pragma once
// Spreads a new program from module to module while the robot runs. The newest replaces the old on
// every module it can reach; each module asks its neighbours for what it lacks, so that losses,
// repeats and late joiners need no special case. A module runs the old program until it holds every
// byte of the new one, its verifier has accepted it, and the tick has come that the package names.
// It hands a program on as soon as it is accepted, before it runs it.
//
// Which of two is newer: the higher version, and so the one that was deployed later; of equal
// versions, which two deployers give that know nothing of each other, the higher id. So one wins
// everywhere, whatever arrives first.
//
// A package is collected from its first byte on. A piece is any run of its bytes: a sender cuts as
// its neighbours say that they can take, and a receiver takes what goes on from where it is. So
// modules of both profiles (vm/limits.h) collect from each other, and a store is only ever appended
// to, as flash wants it.
//
// Use, each tick: Receive(input); if ready(), verify the package, then Keep() or Refuse(); if
// verified() and its tick has come, Vm::ReplaceProgram and Accept(); after Vm::Tick,
// Fill(&output.message). ProgramChanger (vm/programs/program_changer.h) does all that.

#include <cstdint>
#include <type_traits>

#include "vm/module_api.h"
#include "vm/spread/package.h"
#include "vm/spread/package_store.h"

namespace morphbus::vm {

/// Ticks after which a module `hops` dockings away holds a package of this size that another one
/// holds now, if no message is lost and none is full, and all can take pieces of kFragmentBytes:
/// each hands it on once it has the whole.
int64_t SpreadTicks(uint32_t package_size, int hops);

/// A package, by what it is called and how many bytes it has.
struct PackageName {
  uint32_t version = 0;  ///< 0: there is none.
  uint32_t size = 0;     ///< 0 while no piece has told it.
  uint64_t id = 0;
};

/// The relay's whole state but for the packages, which are in the store: flat.
struct RelayState {
  PackageName running;            ///< What this module runs.
  PackageName incoming;           ///< What comes next.
  PackageName refused;            ///< The newest that was refused.
  uint32_t have = 0;              ///< Bytes of `incoming` that have come, from its first one on.
  uint32_t newest_heard = 0;      ///< The highest version that this module knows of.
  int64_t offered_tick = 0;       ///< When a neighbour offered `incoming` last.
  uint32_t want_offset = 0;       ///< First byte that the neighbour which is furthest behind lacks,
  uint32_t serve_offset = 0;      ///< and the next one to hand out.
  int64_t small_tick = 0;         ///< When a neighbour said last that it takes no more than `cut`.
  uint32_t cut = kFragmentBytes;  ///< Bytes of the pieces that are handed out.
  uint8_t wanted = 0;             ///< 1: a neighbour asked for a piece in this tick.
  uint8_t whole = 0;              ///< 1: all of `incoming` is in its place.
  uint8_t verified = 0;           ///< 1: it is verified, too, and waits for its tick.
  /// Where the program that runs lies: in place 0 or 1, or 2, where the module was started with it.
  uint8_t place = 2;
};
static_assert(std::has_unique_object_representations_v<RelayState>, "snapshots have no padding");

class ProgramRelay {
 public:
  /// `state` is either as made, before Start, or saved from an earlier relay, whose store had the
  /// same in it. Both outlive the relay, and so does the image.
  ProgramRelay(const uint8_t* first_image, uint32_t first_size, RelayState* state,
               PackageStore* store)
      : first_image_(first_image), first_size_(first_size), state_(*state), store_(*store) {}

  /// Begins with the first image as the program that runs. It is read where it lies.
  void Start(uint64_t hash, uint32_t version = 1);

  /// Hands a new package (verified by the caller, and no larger than the store's places) to this
  /// module, from where it spreads. Its version is its number, or one above the newest heard of if
  /// that is more. It is ready() at once.
  void Deploy(const uint8_t* package, uint32_t size, uint64_t id, uint32_t number = 0);

  /// Takes the neighbours' news and pieces. What no neighbour has offered for kSilentTicks and is
  /// not whole is given up: the neighbour that had it is gone. What the store has no room for, or
  /// fails to keep, is refused.
  void Receive(const TickInput& input);

  /// True when a newer package is complete and waits for Keep or Refuse.
  [[nodiscard]] bool ready() const { return state_.whole != 0 && state_.verified == 0; }
  /// The place that what comes next is written to, and its bytes once they are whole.
  [[nodiscard]] int incoming_place() const { return state_.place == 0 ? 1 : 0; }
  [[nodiscard]] const uint8_t* incoming_package() const { return store_.Read(incoming_place()); }
  [[nodiscard]] uint32_t incoming_size() const { return state_.incoming.size; }
  [[nodiscard]] uint64_t incoming_id() const { return state_.incoming.id; }

  /// The verifier accepted the package: neighbours get it from now on, though it does not run yet.
  void Keep() { state_.verified = 1; }
  /// True from Keep() on, until the package runs or a newer one takes its place.
  [[nodiscard]] bool verified() const { return state_.verified != 0; }
  /// What was verified runs from now on; its bytes stay where incoming_package() pointed.
  void Accept();
  /// The verifier refused it; the old goes on, and this one is never asked for again.
  void Refuse();

  /// Nothing has come, was asked for or was deployed since Start: a relay that is started with the
  /// same program is in the same state.
  [[nodiscard]] bool AsStarted() const;
  /// The image of the program that runs.
  [[nodiscard]] const uint8_t* running_image() const;
  [[nodiscard]] uint32_t running_size() const { return state_.running.size - kPackageHeadBytes; }
  /// Of each place of the store.
  [[nodiscard]] uint32_t capacity() const { return store_.capacity(); }
  /// Bytes that are in use in a place of the store.
  [[nodiscard]] uint32_t BytesIn(int place) const;
  /// False for a state that no relay can have left, which would point out of the store: for states
  /// from files.
  [[nodiscard]] bool Sound() const;

  /// Adds news and, where a neighbour wants one and the message has room, a piece. Call after
  /// Vm::Tick.
  void Fill(NeighbourMessage* message);

 private:
  void Begin(const PackageName& name);
  void OnNews(const ProgramNews& news, int64_t tick);
  void TakePiece(const ProgramFragment& piece);
  /// Takes note of what a neighbour wants of the newest package.
  void OnWish(const ProgramNews& news);
  /// The newest package that this module can hand on.
  [[nodiscard]] const PackageName& Newest() const {
    return verified() ? state_.incoming : state_.running;
  }
  /// Copies bytes of it.
  void CopyNewest(uint32_t offset, uint32_t size, uint8_t* out) const;

  const uint8_t* const first_image_;
  const uint32_t first_size_;
  RelayState& state_;
  PackageStore& store_;
};

}  // namespace morphbus::vm
