#pragma once
// Builds one mapping of an assembly to another, piece by piece. Internal to compiler/congruence.

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "compiler/congruence/backtracker.h"
#include "compiler/congruence/places.h"

namespace morphbus::congruence {

/// Pieces at one body that nothing tells apart at first sight, so that each of `pieces` of a may go
/// to each of `images` of b. As many of one as of the other.
struct InterchangeableSet {
  std::vector<int> pieces;
  std::vector<int> images;
};

/// Builds mappings from the place of one body outwards over the tree of pieces.
///
/// Pieces at a body whose place is known are matched each for itself (see Decomposition), so a
/// piece that fails fails the whole, and one that fits is never looked at again. Where several
/// pieces are interchangeable, each takes the first image that it can be matched with. That needs
/// no going back: "can be matched with" parts pieces and images into classes (if X fits Z and Y
/// fits Z, then X fits whatever Y fits), so no choice within a class can spoil another.
class MappingBuilder {
 public:
  /// `a`, `b` and `steps` must outlive it.
  MappingBuilder(const ScrewGraph& a, const ScrewGraph& b, const Classes& classes, Steps& steps);

  /// What has been matched so far; empty at first and after Clear.
  [[nodiscard]] Correspondence& matched() { return matched_; }
  [[nodiscard]] const Decompositions& pieces() const { return pieces_; }
  void Clear() { matched_.Undo({}); }

  /// Builds a mapping that takes `body` to `place`; it stays in matched() until Clear. False if
  /// there is none, or the steps ran out. matched() must be empty.
  bool Build(int body, const Place& place);

  /// The steps of which Build consists, for who counts the ways of each. All of them may leave
  /// something in matched(), also where they fail.
  ///
  /// Matches `body` with `place.image`. False if they are in different classes.
  bool PutAt(int body, const Place& place);
  /// Matches the joints with both ends in the matched `body`: any whose axis lies in place will do.
  /// Returns in how many ways that can be done, or kMaxCounted + 1 if they are more than that.
  int64_t MatchJointsWithin(int body);
  /// The pieces at the matched `body` but for that through which it was reached (none if -1), in
  /// sets. Nothing if the image has others.
  std::optional<std::vector<InterchangeableSet>> PiecesAt(int body, int but_piece, int but_image);
  /// Matches all that hangs on the bodies which the present way of `search` brought in.
  bool MatchBeyond(const Backtracker& search);
  /// Matches a piece and all that hangs on it; if that fails, nothing has changed.
  bool MatchPiece(const Entry& entry);

 private:
  /// What can be remembered of an entry: the entry, and the image of its body.
  using MemoEntry = std::array<int, 4>;

  bool MatchAll(std::vector<Entry> todo);
  bool MatchAtBody(int body, int but_piece, int but_image, std::vector<Entry>& todo);
  bool AddBeyond(const Backtracker& search, std::vector<Entry>& todo);
  void SortByModules(InterchangeableSet& set) const;
  [[nodiscard]] MemoEntry MemoOf(const Entry& entry) const;
  [[nodiscard]] bool KnownToFail(const Entry& entry) const;
  void RememberFailure(const Entry& entry);
  [[nodiscard]] static std::vector<uint64_t> SignaturesOf(const Decomposition& pieces,
                                                          const std::vector<uint64_t>& joints);

  Correspondence matched_;
  Decompositions pieces_;
  Steps& steps_;
  /// By piece of either assembly: a hash that it shares with all pieces that it can be matched
  /// with.
  std::vector<uint64_t> signatures_a_;
  std::vector<uint64_t> signatures_b_;
  /// How deep choices are nested in each other just now.
  int depth_ = 0;
  /// The rotations of the body with which an entry was found to have no match.
  std::map<MemoEntry, std::vector<Eigen::Matrix3d>> failed_;
};

}  // namespace morphbus::congruence
