#pragma once
// Counts the ways to match two assemblies piece by piece, or makes one of them. Internal to
// compiler/congruence.

#include <unordered_map>
#include <vector>

#include "compiler/congruence/count.h"
#include "compiler/congruence/piece_search.h"

namespace morphbus::congruence {

/// Goes from one body over the tree of pieces. Pieces at a body are matched each for itself, so
/// numbers of ways multiply; of pieces that can stand for each other (that is an equivalence: if X
/// goes to Z and Y goes to Z, X is like Y), k can be exchanged in k! ways.
class Counter {
 public:
  /// `matched` is empty and is so again after each call.
  Counter(Correspondence& matched, const Cut& cut, Steps& steps)
      : matched_(matched), cut_(cut), steps_(steps) {}

  /// The number of ways (at most kMostCounted) with `body` at `place`.
  int64_t Ways(int body, const Place& place);

  /// One of those ways stays in the correspondence until Clear. False if there is none.
  bool Make(int body, const Place& place);
  void Clear() { matched_.Undo({}); }

 private:
  enum class Goal { kCount, kMake };
  /// What was found out about an entry: the ways, with the rotation of the body it is entered at.
  struct Known {
    int body;
    int image;
    Eigen::Matrix3d R;
    int64_t ways;
  };
  /// Pieces at one body that can stand for each other, and those they can go to.
  struct Kind {
    std::vector<int> pieces;
    std::vector<int> images;
    int64_t ways;  ///< For each pair of them.
  };

  int64_t Begin(int body, const Place& place, Goal goal);
  int64_t Fulfil(std::vector<Entry> todo, Goal goal);
  int64_t FulfilEach(PieceSearch& search, Goal goal);
  int64_t Hang(int body, int but_piece, int but_image, Goal goal, std::vector<Entry>& todo);
  int64_t HangAll(const std::vector<int>& bodies, const Entry& entry, Goal goal,
                  std::vector<Entry>& todo);
  int64_t MatchAlike(int body, const std::vector<int>& pieces, std::vector<int> images, Goal goal,
                     std::vector<Entry>& todo);
  void SortByModules(Kind& kind) const;
  int64_t MatchStill(int body, Goal goal);
  int64_t WaysOf(const Entry& entry);
  [[nodiscard]] bool FirstJointFits(const Entry& entry) const;
  [[nodiscard]] const Known* Recall(const Entry& entry) const;
  void Remember(const Entry& entry, const Eigen::Matrix3d& R, int64_t ways);
  [[nodiscard]] uint64_t KeyOf(const Entry& entry) const;
  const std::vector<uint64_t>& Signatures(int side);

  Correspondence& matched_;
  const Cut& cut_;
  Steps& steps_;
  int depth_ = 0;
  std::unordered_map<uint64_t, std::vector<Known>> known_;
  std::vector<uint64_t> signatures_[2];
};

}  // namespace morphbus::congruence
