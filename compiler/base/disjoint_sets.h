#pragma once
// Disjoint sets (union-find) over the numbers 0 to count - 1.
// They are used where things are found to hang together step by step: links in bodies, triangles in
// planes.

#include <numeric>
#include <vector>

namespace morphbus {

/// Every number starts in a set of its own; sets can be united, never split. Each operation takes
/// next to constant time (path halving, after van Leeuwen and van der Weide).
class DisjointSets {
 public:
  /// `count` sets of one number each.
  explicit DisjointSets(int count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }

  /// The number that stands for the set of `i`; it is the same for all numbers of one set.
  [[nodiscard]] int Find(int i) {
    // Path halving: every number on the way is hung onto its parent's parent.
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }

  /// Unites the sets of `i` and `j`. From now on both are stood for by the number that stood for
  /// the set of `j`. Returns false if they were one set already.
  bool Unite(int i, int j) {
    const int root_i = Find(i);
    const int root_j = Find(j);
    parent_[root_i] = root_j;
    return root_i != root_j;
  }

 private:
  /// parent_[i] is the next number on the way from `i` to the one that stands for its set, which is
  /// its own parent.
  std::vector<int> parent_;
};

}  // namespace morphbus
