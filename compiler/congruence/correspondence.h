#pragma once
// A correspondence of bodies and joints of two assemblies while it grows, with undo. Internal to
// compiler/congruence.

#include <optional>
#include <vector>

#include "compiler/congruence/classes.h"
#include "compiler/congruence/congruence.h"
#include "compiler/congruence/partial_rotations.h"
#include "compiler/congruence/screw_graph.h"

namespace morphbus::congruence {

/// What matching a joint with another demanded in vain. Lengths in m, angles in rad.
struct Failure {
  enum class Demand {
    /// The axes lie in one direction; `found` is the angle between them.
    kDirection,
    /// They are as far from the reference point; `wanted` is that of a.
    kDistance,
    /// They pass it on the same side; `found` is how far they miss each other.
    kPlace,
    /// The reference points lie as far apart along the axis.
    kAlong,
    /// The reference points are as far apart across the slide.
    kApart,
    /// They lie alike across the slide; `found` is the miss.
    kAcross,
    /// The bodies beyond the joints correspond to each other.
    kBodies,
    /// The bodies beyond are turned alike; `found` is the angle left, about the axis.
    kTurned,
    /// The limits map onto each other with the offset that the bodies' places have.
    kOffset,
    /// The only value (`wanted`: of the image) is the image of the only value.
    kLocked,
  };
  /// The first demand that could not be met.
  Demand demand;
  /// The joint of a that was to be matched.
  int joint;
  /// The joint of b that was tried as its counterpart, and which way round.
  JointImage counterpart;
  /// Is the demand on the body at the joint's other end?
  bool beyond = false;
  /// What the demand asks for and what there is, as far as Demand says.
  double wanted = 0.0;
  double found = 0.0;
};

/// Bodies and joints of a that have their counterparts in b, and the rotations that take the bodies
/// there.
///
/// Each joint that is matched has its screw axis where its counterpart has it, relative to the
/// bodies at both ends, so that these move alike for all values of the joint. What that demands is
/// worked out in correspondence_commit.cc, joint by joint: one body that is in place and one joint
/// determine where the body at the joint's other end goes, and how it is turned but for a turn
/// about the axis at most.
class Correspondence {
 public:
  /// Nothing is matched yet. `a` and `b` must outlive it.
  Correspondence(const ScrewGraph& a, const ScrewGraph& b, Classes classes);

  /// A state to which Undo goes back. The default is that in which nothing is matched.
  struct Mark {
    size_t bodies = 0;
    size_t joints = 0;
    PartialRotations::Mark rotations;
  };
  /// The present state.
  [[nodiscard]] Mark mark() const { return {order_.size(), joints_order_.size(), R_.mark()}; }
  /// Takes back all that was matched and set since `mark` was taken.
  void Undo(const Mark& mark);

  /// The assemblies, and the classes that bodies and joints must share to correspond.
  [[nodiscard]] const ScrewGraph& a() const { return a_; }
  [[nodiscard]] const ScrewGraph& b() const { return b_; }
  [[nodiscard]] const Classes& classes() const { return classes_; }
  /// By body of a: takes coordinates in it to coordinates in its image.
  [[nodiscard]] PartialRotations& R() { return R_; }
  [[nodiscard]] const PartialRotations& R() const { return R_; }

  /// Counterparts in b of a body or a joint of a; -1 (`to` of a joint) where there is none yet.
  [[nodiscard]] int ImageOf(int body) const { return body_to_[body]; }
  [[nodiscard]] const JointImage& CounterpartOf(int joint) const { return joint_to_[joint]; }
  /// Is the body, the joint of b a counterpart already?
  [[nodiscard]] bool BodyTaken(int image) const { return body_from_[image] >= 0; }
  [[nodiscard]] bool JointTaken(int image) const { return joint_from_[image] >= 0; }
  /// Bodies of a in the order in which they were matched.
  [[nodiscard]] const std::vector<int>& order() const { return order_; }

  /// Matches bodies. How the body is turned is for the caller to set, or for its joints to say.
  void MatchBodies(int body, int image);

  /// Are the two joints of one kind, and their ranges equally wide?
  [[nodiscard]] bool SameRange(int joint, int to) const;
  /// May they correspond by class and range?
  [[nodiscard]] bool MayCorrespond(int joint, int to) const {
    return classes_.joints[0][joint] == classes_.joints[1][to] && SameRange(joint, to);
  }
  /// Adds `to` to `counterparts`, one or both ways round, if it may stand for `joint` of the
  /// matched `body` as far as can be seen at once: by class, place, and the bodies beyond.
  void AddCounterparts(int body, int joint, int to, std::vector<JointImage>& counterparts);

  /// Matches `joint` of the matched `body` with a counterpart, and so the body at its other end.
  /// False where that is impossible, for failure(); the caller must Undo then.
  bool Commit(int body, int joint, const JointImage& counterpart);
  /// What the latest Commit that returned false demanded.
  [[nodiscard]] const Failure& failure() const { return *failure_; }

  /// The mapping, once all bodies and joints are matched.
  [[nodiscard]] Mapping ToMapping();

 private:
  /// A joint and its counterpart as seen from one body and its image, to those at the other ends.
  struct JointPair {
    const ScrewJoint& joint;
    const ScrewJoint& to;
    /// The joint's index among those of a.
    int index;
    JointImage counterpart;
    int body, image, other, other_image;
    /// The axis about which +q moves `other` relative to `body`.
    Eigen::Vector3d d;
    /// What R of both bodies must take d to.
    Eigen::Vector3d d_image;
    /// The axis about which +q' moves `other_image` relative to `image`: sign * d_image.
    Eigen::Vector3d to_axis;
    /// From the reference point of `body` to that of `other` (m).
    Eigen::Vector3d apart;
    /// From the reference point of `image` to that of `other_image` (m).
    Eigen::Vector3d apart_image;
    [[nodiscard]] bool BothLocked() const { return joint.locked && to.locked; }
  };
  [[nodiscard]] JointPair PairOf(int body, int joint, const JointImage& counterpart) const;

  bool Fail(Failure::Demand demand, bool beyond = false, double wanted = 0.0, double found = 0.0);
  [[nodiscard]] bool LockedValueFits(int joint, const JointImage& counterpart) const;
  [[nodiscard]] double AngleOff(int body, const Eigen::Vector3d& d,
                                const Eigen::Vector3d& d_image) const;
  /// The parts of Commit: each demands something of the rotations, or fails.
  bool AlignAxis(const JointPair& pair, bool beyond);
  bool CommitWithin(const JointPair& pair);
  bool CommitAngle(const JointPair& pair);
  bool CommitSlide(const JointPair& pair, bool placed);
  bool PlaceOther(const JointPair& pair);
  /// Angles and offsets (rad, m) of a pair.
  double SnapAngle(const JointPair& pair, const Eigen::Matrix3d& wanted);
  bool AlignJoint(int body, int joint, const JointImage& counterpart);
  [[nodiscard]] double OffsetOf(const JointPair& pair) const;
  [[nodiscard]] double RangeTolerance(const ScrewJoint& joint) const {
    return joint.slide ? slide_tolerance_ : kLimitTolerance;
  }
  [[nodiscard]] double OffsetOfLimits(int joint, const JointImage& counterpart) const;
  [[nodiscard]] double SignWithin(int joint, int to) const;
  /// The parts of ToMapping.
  void SettleTheRest();
  void SettleNeighbours();
  [[nodiscard]] double FinalOffset(int joint, const JointImage& counterpart) const;
  [[nodiscard]] bool KeepsFrame() const;
  [[nodiscard]] std::vector<int> ModuleMap() const;
  [[nodiscard]] int ImageOfRigidModule(int module, std::vector<bool>& free_b) const;

  const ScrewGraph& a_;
  const ScrewGraph& b_;
  Classes classes_;
  double length_tolerance_;  ///< For lengths that places have (m).
  double slide_tolerance_;   ///< For limits of slides, which hold to less (m).
  PartialRotations R_;
  /// Counterparts both ways; -1 where there is none yet.
  std::vector<int> body_to_, body_from_;
  std::vector<JointImage> joint_to_;  ///< `to` is -1 where there is none yet.
  std::vector<int> joint_from_;
  std::vector<int> order_;         ///< Bodies of a in the order in which they were matched.
  std::vector<int> joints_order_;  ///< Joints of a likewise.
  std::optional<Failure> failure_;
};

}  // namespace morphbus::congruence
