#pragma once
// Rotations that take bodies of one assembly to bodies of another, each known wholly or up to a
// turn about one axis, with undo.

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace morphbus::congruence {

/// A body's rotation R is fixed by vectors that it must take to others. One vector leaves a turn
/// about it open; bodies whose turns depend on each other share an unknown angle (a group: a
/// union-find whose links are angle' = sign * angle + constant), until something settles it.
class PartialRotations {
 public:
  /// Lengths (m) and angles (rad) within which two things coincide.
  struct Tolerance {
    double length = 1e-9;
    double angle = 1e-6;
  };

  PartialRotations(size_t bodies, const Tolerance& tolerance)
      : tolerance_(tolerance), bodies_(bodies) {}

  [[nodiscard]] bool known(int body) const { return bodies_[body].set; }
  /// False where a turn is still open.
  [[nodiscard]] bool settled(int body) const;
  /// The rotation; for one that is not settled, the one at angle 0.
  [[nodiscard]] Eigen::Matrix3d Value(int body) const;

  /// The group of a body that is not settled, and the axis (in the image) of its turns, so sensed
  /// that the bodies of the group all turn by the same angle.
  [[nodiscard]] int GroupOf(int body) const { return Find(bodies_[body].group).root; }
  [[nodiscard]] Eigen::Vector3d GroupAxis(int body) const;

  void SetWhole(int body, const Eigen::Matrix3d& R);
  /// Known up to a turn about `axis_image` (unit).
  void SetUpToTurn(int body, const Eigen::Matrix3d& R, const Eigen::Vector3d& axis_image);
  /// The same rotation as `other` has, now and whatever becomes of it.
  void SetLike(int body, int other) { bodies_[body] = bodies_[other]; }

  /// Demands R u = image, lengths to `tolerance`; may settle the body's group. False: impossible.
  bool AlignVector(int body, const Eigen::Vector3d& u, const Eigen::Vector3d& image,
                   double tolerance);
  bool AlignPosition(int body, const Eigen::Vector3d& u, const Eigen::Vector3d& image) {
    return AlignVector(body, u, image, tolerance_.length);
  }
  bool AlignDirection(int body, const Eigen::Vector3d& u, const Eigen::Vector3d& image) {
    return AlignVector(body, u, image, tolerance_.angle);
  }
  /// Demands R_Q = Rot(axis, angle) R_T, for bodies that both have the axis (see AlignDirection).
  bool Relate(int body_t, int body_q, const Eigen::Vector3d& axis, double angle);
  /// Demands R = `wanted`.
  bool AlignWhole(int body, const Eigen::Matrix3d& wanted);

  /// What to hand to Undo, to be where we are now. A body's entry is only taken back by Forget.
  struct Mark {
    size_t trail = 0;
    size_t groups = 0;
  };
  [[nodiscard]] Mark mark() const { return {trail_.size(), groups_.size()}; }
  void Undo(const Mark& mark);
  void Forget(int body) { bodies_[body].set = false; }

 private:
  struct BodyEntry {
    bool set = false;
    int group = -1;  ///< -1: R is the rotation.
    Eigen::Matrix3d R;
  };
  struct Group {
    Eigen::Vector3d axis_image;
    int parent = -1;
    double sign = 1.0;      ///< angle = sign * parent's angle + constant
    double constant = 0.0;  ///< Of a root that is settled: its angle.
    bool settled = false;
  };
  /// A group's root, and its own angle as sign * root's angle + constant.
  struct Found {
    int root;
    double sign;
    double constant;
  };
  [[nodiscard]] Found Find(int group) const;
  Group& Change(int group);
  void Settle(int body, double angle);

  Tolerance tolerance_;
  std::vector<BodyEntry> bodies_;
  std::vector<Group> groups_;
  std::vector<std::pair<int, Group>> trail_;  ///< Groups as they were.
};

/// Angle of `R` about unit `axis`, if it is a turn about it.
double AngleAbout(const Eigen::Matrix3d& R, const Eigen::Vector3d& axis);

/// Right-handed turn.
Eigen::Matrix3d Turn(const Eigen::Vector3d& axis, double angle);

/// The rotation that takes unit d to unit d_image and u (square to d) to the direction of u_image.
Eigen::Matrix3d RotationFrom(const Eigen::Vector3d& d, const Eigen::Vector3d& u,
                             const Eigen::Vector3d& d_image, const Eigen::Vector3d& u_image);

}  // namespace morphbus::congruence
