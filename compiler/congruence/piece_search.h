#pragma once
// The ways to match one piece with another. Internal to compiler/congruence.

#include <vector>

#include "compiler/congruence/correspondence.h"
#include "compiler/congruence/pieces.h"

namespace morphbus::congruence {

/// Two assemblies that are compared, in pieces.
struct Cut {
  Pieces a;
  Pieces b;
};

/// A bound on the joints tried, shared by all that search.
struct Steps {
  int64_t left = 0;
  [[nodiscard]] bool gave_up() const { return left <= 0; }
};

/// Where a body of a may go, and how it is turned.
struct Place {
  int image = 0;
  Eigen::Matrix3d R;
  /// For a loose body: R may be followed by any turn about this axis in the image. Else zero.
  Eigen::Vector3d free_axis = Eigen::Vector3d::Zero();
};

/// The places on body `image` of b that bring the joints of `body` that fix its rotation onto
/// joints of the image. None counts twice.
std::vector<Place> PlacesOn(const Correspondence& matched, const Pieces& pieces, int body,
                            int image);

/// Piece `piece` of a is to go to `image` of b, entered at a body that is placed already.
struct Entry {
  int piece;
  int image;
  int body;
};

/// Brings a correspondence to each way of matching a piece in turn: all its joints are matched, its
/// bodies placed, and those that are not loose are turned for good.
class PieceSearch {
 public:
  PieceSearch(Correspondence& matched, const Cut& cut, Steps& steps, const Entry& entry);

  /// To the next way; false, and all is as at the start, if there is none.
  bool Next();
  /// Is the present way the last one?
  [[nodiscard]] bool last() const { return choices_.empty(); }
  [[nodiscard]] const Entry& entry() const { return entry_; }
  /// Bodies that the piece brought in, in the order of matching.
  [[nodiscard]] std::vector<int> NewBodies() const;

 private:
  struct Mark {
    Correspondence::Mark matched;
    size_t head;
  };
  /// A joint with several possible counterparts or, if `joint` is -1, a body with several places.
  struct Choice {
    Mark mark;
    int body;
    int joint;
    std::vector<Option> options;
    std::vector<Eigen::Matrix3d> rotations;
    size_t next = 0;
    [[nodiscard]] bool empty() const { return next == options.size() + rotations.size(); }
  };

  [[nodiscard]] int BodyAt(size_t index) const;
  [[nodiscard]] size_t num_bodies() const { return matched_.order().size() - first_ + 1; }
  bool TakeNext();
  int NextJoint(int* body);
  [[nodiscard]] int NextOpenBody() const;
  [[nodiscard]] std::vector<Option> OptionsFor(int body, int joint) const;
  void Undo(const Mark& mark);

  Correspondence& matched_;
  const Cut& cut_;
  Steps& steps_;
  Entry entry_;
  Correspondence::Mark start_;
  size_t first_;     ///< In the order of matching, where this piece's bodies begin.
  size_t head_ = 0;  ///< Body whose joints are looked at: 0 the entry, then the new ones.
  bool begun_ = false;
  std::vector<Choice> choices_;
};

}  // namespace morphbus::congruence
