#pragma once
// A correspondence of bodies and joints while it grows, with undo. Internal to compiler/congruence.

#include <optional>
#include <vector>

#include "compiler/congruence/assembly.h"
#include "compiler/congruence/classes.h"
#include "compiler/congruence/congruence.h"
#include "compiler/congruence/partial_rotations.h"

namespace morphbus::congruence {

/// A counterpart of a joint.
struct Option {
  int to;
  double sign;
};

/// What matching a joint with another demanded in vain. Lengths in m, angles in rad.
struct Failure {
  enum class Demand {
    kDirection,  ///< The axes lie in one direction; `found` is the angle between them.
    kDistance,   ///< They are as far from the reference point; `wanted` is that of a.
    kPlace,      ///< They pass it on the same side; `found` is how far they miss each other.
    kAlong,      ///< The reference points lie as far apart along the axis.
    kApart,      ///< The reference points are as far apart across the slide.
    kAcross,     ///< They lie alike across the slide; `found` is the miss.
    kBodies,     ///< The bodies beyond the joints correspond to each other.
    kTurned,     ///< The bodies beyond are turned alike; `found` is the angle left, about the axis.
    kOffset,     ///< The limits map onto each other with the offset that the bodies' places have.
    kLocked,     ///< The only value (`wanted`: of the image) is the image of the only value.
  };
  Demand demand;
  int joint;
  Option option;
  bool beyond = false;  ///< Of the body at the joint's other end.
  double wanted = 0.0;
  double found = 0.0;
};

/// The offset that maps `joint`'s limits onto those of `to`, for a joint that has limits; 0 if the
/// limits are the same within kLimitTolerance, or `slide_tolerance` (m) for one that slides.
double OffsetOfLimits(const AssemblyJoint& joint, const AssemblyJoint& to, double sign,
                      double slide_tolerance);

/// Are they of one kind, and their ranges equally wide? `slide_tolerance` in m.
bool SameRange(const AssemblyJoint& joint, const AssemblyJoint& to, double slide_tolerance);

/// Bodies and joints of a that have their counterparts in b, and the rotations that take the bodies
/// there. Each joint that is matched must have its screw axis where its counterpart has it,
/// relative to the bodies at both ends.
class Correspondence {
 public:
  Correspondence(const Assembly& a, const Assembly& b, Classes classes);

  struct Mark {
    size_t bodies;
    size_t joints;
    PartialRotations::Mark rotations;
  };
  [[nodiscard]] Mark mark() const { return {order_.size(), joints_order_.size(), R_.mark()}; }
  void Undo(const Mark& mark);

  [[nodiscard]] const Assembly& a() const { return a_; }
  [[nodiscard]] const Assembly& b() const { return b_; }
  [[nodiscard]] const Classes& classes() const { return classes_; }
  [[nodiscard]] PartialRotations& R() { return R_; }
  [[nodiscard]] const PartialRotations& R() const { return R_; }
  [[nodiscard]] double length_tolerance() const { return length_tolerance_; }
  /// Counterparts; -1 where there is none yet.
  [[nodiscard]] int ImageOf(int body) const { return body_to_[body]; }
  [[nodiscard]] int JointImageOf(int joint) const { return joint_to_[joint].to; }
  [[nodiscard]] bool BodyTaken(int image) const { return body_from_[image] >= 0; }
  [[nodiscard]] bool JointTaken(int image) const { return joint_from_[image] >= 0; }
  /// Bodies of a, as they were matched.
  [[nodiscard]] const std::vector<int>& order() const { return order_; }
  /// What the latest Commit that returned false demanded.
  [[nodiscard]] const Failure& failure() const { return *failure_; }

  /// Matches bodies; the rotation is for the caller to set.
  void MatchBodies(int body, int image);
  /// Matches a seed with an image and places it as `joint`'s axis tells, which is all that is known
  /// (-1: a body alone).
  void PlaceSeed(int seed, int image, int joint, const Option& option);
  /// The counterparts that `joint` of the matched `body` may have.
  [[nodiscard]] std::vector<Option> OptionsFor(int body, int joint) const;
  /// Those of them that are `to`, one or both ways round.
  void AddOptions(int body, int joint, int to, std::vector<Option>& options) const;
  /// May the two joints correspond by class and range?
  [[nodiscard]] bool MayCorrespond(int joint, int to) const;
  /// Is the axis where it should be, relative to `body`? True where its rotation is not settled.
  [[nodiscard]] bool Plausible(int body, int joint, const Option& option) const;
  /// Could the joint, which has both ends in one body, as `option.to` has, have this sign?
  [[nodiscard]] bool StillFits(int joint, const Option& option) const;
  /// Matches `joint` of the matched `body`, and the body at its other end. False: impossible; the
  /// caller must Undo.
  bool Commit(int body, int joint, const Option& option);

  /// The mapping, once all is matched.
  [[nodiscard]] Mapping ToMapping();

 private:
  bool Fail(Failure::Demand demand, bool beyond = false, double wanted = 0.0, double found = 0.0);
  [[nodiscard]] double AngleOff(int body, const Eigen::Vector3d& d,
                                const Eigen::Vector3d& d_image) const;
  bool AlignAxis(int body, int joint, const Option& option, bool beyond);
  bool CommitTurn(int body, int joint, const Option& option);
  bool CommitAngle(int body, int joint, const Option& option);
  bool CommitSlide(int body, int joint, const Option& option);
  bool CommitStill(int body, int joint, const Option& option);
  bool PlaceOther(int body, int joint, const Option& option);
  [[nodiscard]] double SnapAngle(int body, int joint, const Eigen::Matrix3d& R,
                                 const Eigen::Vector3d& axis_image) const;
  [[nodiscard]] double OffsetOf(int joint, const Option& option) const;
  [[nodiscard]] double StillSign(int joint, int to) const;
  void SettleTheRest();
  [[nodiscard]] double FinalOffset(int joint, const Option& option) const;
  [[nodiscard]] bool KeepsFrame() const;
  [[nodiscard]] std::vector<int> ModuleMap() const;

  const Assembly& a_;
  const Assembly& b_;
  Classes classes_;
  double length_tolerance_;
  double slide_tolerance_;
  PartialRotations R_;
  std::vector<int> body_to_, body_from_;
  std::vector<Option> joint_to_;  ///< .to -1: none yet.
  std::vector<int> joint_from_;
  std::vector<int> order_;         ///< Bodies of a, as they were matched.
  std::vector<int> joints_order_;  ///< Joints of a, as they were matched.
  std::optional<Failure> failure_;
};

}  // namespace morphbus::congruence
