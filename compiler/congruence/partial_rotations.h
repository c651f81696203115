#pragma once
// Rotations that take bodies of one assembly to bodies of another, each known wholly or up to a
// turn about one axis, with undo.

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace morphbus::congruence {

/// The rotation R of each body takes coordinates in it to coordinates in its image. It is
/// determined by vectors that it must take to others. At first it is unknown. One vector leaves a
/// turn about it open: R is known up to an angle. Bodies whose open turns depend on each other
/// share one unknown angle. Such a group is kept as a union-find whose links say angle = sign *
/// parent's angle + constant, so once a vector determines the angle of one body, the rotations of
/// all are known.
///
/// "Settled" means known wholly; "open" the contrary. Bodies are numbered from 0.
class PartialRotations {
 public:
  /// Lengths (m) and angles (rad) within which two things coincide.
  struct Tolerance {
    double length = 1e-9;
    double angle = 1e-6;
  };

  /// For `bodies` bodies, of none of which anything is known.
  PartialRotations(size_t bodies, const Tolerance& tolerance)
      : tolerance_(tolerance), bodies_(bodies) {}

  /// How many angles of R are open: none, one about an axis, or three.
  [[nodiscard]] int freedom(int body) const;
  /// Is none of them open?
  [[nodiscard]] bool settled(int body) const { return freedom(body) == 0; }
  /// The rotation; for one that is open, that at angle 0; the identity for one that is unknown.
  [[nodiscard]] Eigen::Matrix3d Value(int body) const;

  /// The group of a body that is not settled, and the axis (in the image) of its turns, so sensed
  /// that the bodies of the group all turn by the same angle.
  [[nodiscard]] int GroupOf(int body) const { return Find(bodies_[body].group).root; }
  [[nodiscard]] Eigen::Vector3d GroupAxis(int body) const;

  /// From now on R is the rotation of the body.
  void SetWhole(int body, const Eigen::Matrix3d& R);
  /// From now on the rotation is Rot(axis_image, angle) R with an unknown angle; `axis_image` is a
  /// unit vector in the image.
  void SetUpToTurn(int body, const Eigen::Matrix3d& R, const Eigen::Vector3d& axis_image);
  /// From now on the body has the same rotation as `other`, whatever becomes of that.
  void SetLike(int body, int other) { Set(body, bodies_[other]); }

  /// Demands R u = image to within `tolerance` in length; may settle the body's group or, if R was
  /// unknown, leave it known up to a turn. False, and nothing has changed, if that is impossible.
  bool AlignVector(int body, const Eigen::Vector3d& u, const Eigen::Vector3d& image,
                   double tolerance);
  /// AlignVector for positions (m).
  bool AlignPosition(int body, const Eigen::Vector3d& u, const Eigen::Vector3d& image) {
    return AlignVector(body, u, image, tolerance_.length);
  }
  /// AlignVector for unit vectors.
  bool AlignDirection(int body, const Eigen::Vector3d& u, const Eigen::Vector3d& image) {
    return AlignVector(body, u, image, tolerance_.angle);
  }
  /// Demands R_Q = Rot(axis, angle) R_T. Where both are open, `axis` (in the image) must be that of
  /// their turns; their groups become one. False if that is impossible.
  bool Relate(int body_t, int body_q, const Eigen::Vector3d& axis, double angle);
  /// Demands R = `wanted`; settles the body's group if it is open. False if that is impossible.
  bool AlignWhole(int body, const Eigen::Matrix3d& wanted);

  /// A state to which Undo goes back. The default is that in which nothing is known.
  struct Mark {
    size_t bodies = 0;
    size_t changes = 0;
    size_t groups = 0;
  };
  [[nodiscard]] Mark mark() const {
    return {body_trail_.size(), group_trail_.size(), groups_.size()};
  }
  void Undo(const Mark& mark);

 private:
  /// What BodyEntry::group is where it is no group.
  static constexpr int kUnknown = -1;
  static constexpr int kWhole = -2;
  struct BodyEntry {
    /// The group whose angle turns the body; kWhole if R is the rotation.
    int group = kUnknown;
    Eigen::Matrix3d R = Eigen::Matrix3d::Identity();  ///< The rotation at angle 0.
  };
  /// An unknown angle (rad) about an axis.
  struct Group {
    Eigen::Vector3d axis_image;
    /// The group on whose angle this one depends; -1 for a root.
    int parent = -1;
    /// angle = sign * parent's angle + constant
    double sign = 1.0;
    /// Of a settled root: its angle.
    double constant = 0.0;
    /// Of a root: is the angle known?
    bool settled = false;
  };
  /// The root on which a group's angle depends: angle = sign * root's angle + constant.
  struct Found {
    int root;
    double sign;
    double constant;
  };
  [[nodiscard]] Found Find(int group) const;
  /// These keep what was there before for Undo.
  void Set(int body, const BodyEntry& entry);
  Group& Change(int group);
  /// The body must be open.
  void Settle(int body, double angle);

  Tolerance tolerance_;
  std::vector<BodyEntry> bodies_;
  std::vector<Group> groups_;
  std::vector<std::pair<int, BodyEntry>> body_trail_;  ///< Those that changed, as they were before.
  std::vector<std::pair<int, Group>> group_trail_;     ///< Likewise.
};

/// The angle (rad) by which `R` turns about unit `axis`, for an R that turns about it.
double AngleAbout(const Eigen::Matrix3d& R, const Eigen::Vector3d& axis);

/// The rotation by `angle` (rad) about unit `axis`, right-handed.
Eigen::Matrix3d Turn(const Eigen::Vector3d& axis, double angle);

/// The rotation that takes unit d to unit d_image and u (square to d) to the direction of u_image.
Eigen::Matrix3d RotationFrom(const Eigen::Vector3d& d, const Eigen::Vector3d& u,
                             const Eigen::Vector3d& d_image, const Eigen::Vector3d& u_image);

}  // namespace morphbus::congruence
