#pragma once
// An assembly flattened for repeated forward kinematics: one step a link, in breadth-first order.

#include <utility>
#include <vector>

#include "compiler/model/forward_kinematics.h"

namespace morphbus::model {

/// A spanning tree of the robot's links, whose edges are joints and dockings.
/// Built once for a robot; evaluating it allocates nothing and does not need the model any more.
class KinematicTree {
 public:
  /// Dockings by index into Robot::dockings, joints by flat index. Empty: none.
  struct Omitted {
    std::vector<bool> dockings;
    std::vector<bool> joints;
  };

  /// Breadth first from the robot's root link; from each link over its module's joints, then over
  /// its dockings, both in declared order. Links that hang off nothing start trees of their own,
  /// the first of each with its frame in R's origin. Goes round what is in `omitted`, which then is
  /// in loops().
  KinematicTree(const Model& model, const Robot& robot, const Omitted& omitted);
  /// The same with nothing left out.
  KinematicTree(const Model& model, const Robot& robot) : KinematicTree(model, robot, Omitted()) {}

  [[nodiscard]] int num_links() const { return static_cast<int>(steps_.size()); }
  [[nodiscard]] int num_joints() const { return num_joints_; }
  /// Flat index of a link or joint: modules in order, each with its links (joints) in order.
  [[nodiscard]] int LinkIndex(int module, int link) const { return first_link_[module] + link; }
  [[nodiscard]] int JointIndex(int module, int joint) const { return first_joint_[module] + joint; }

  /// Writes X_RL for each link, by flat index. `q`: num_joints() values (rad, m) by flat index;
  /// `X_RL`: room for num_links() poses.
  void Evaluate(const double* q, Pose* X_RL) const;

  /// How a link is placed: rigidly, by a turn about x, y or z of the frame or about any other axis,
  /// or by a slide. Turns about the frame's own axes are kinds of their own because they change two
  /// columns of a rotation only.
  enum class Kind { kFixed, kTurnX, kTurnY, kTurnZ, kTurn, kSlide };

  /// How one link is placed: its pose from that of the link that it hangs from.
  struct Step {
    Kind kind = Kind::kFixed;
    /// The flat index of the link.
    int link = 0;
    /// The flat index of a link placed earlier; -1 stands for the robot frame itself.
    int parent = -1;
    /// The flat index of the joint, also of a fixed one; -1 for a docking or a root.
    int joint = -1;
    /// The index into Robot::dockings; -1 for a joint or a root.
    int docking = -1;
    /// -1 where the tree runs from A to B, or about a negative axis; where both hold, 1 again.
    double sign = 1.0;
    /// The unit direction of the axis in the parent's frame.
    Eigen::Vector3d axis = Eigen::Vector3d::Zero();
    /// A point on the axis in the parent's frame (m).
    Eigen::Vector3d origin = Eigen::Vector3d::Zero();
    /// The pose of the link in its parent, for kFixed.
    Pose X_PL = Pose::Identity();
  };
  /// The links, each after the one it hangs from.
  [[nodiscard]] const std::vector<Step>& steps() const { return steps_; }

  /// A joint or docking that the tree did not need: where a loop closes.
  struct Loop {
    /// The index into Robot::dockings, or -1 for a joint inside a module.
    int docking = -1;
    /// The flat indices of the links F and T that should be held together.
    int link_from = 0;
    int link_to = 0;
    /// The flat index of the joint, or -1 for a docking.
    int joint = -1;
    /// For a docking: the pose of link_to's frame T in link_from's frame F.
    Pose X_FT = Pose::Identity();
    /// For a joint: the joint as declared; link_from is its link_b.
    Joint motion;
    /// The point where the gap is measured, in link_from's frame (m).
    Eigen::Vector3d p_F;
  };
  /// The loops, those over dockings first, each in declared order.
  [[nodiscard]] const std::vector<Loop>& loops() const { return loops_; }

  /// Distance (m) and angle (rad) by which `loop` fails to close at these poses and values.
  static std::pair<double, double> Gap(const Loop& loop, const double* q, const Pose* X_RL);

 private:
  /// The step over `joint`: to its link A if `places_a`, else from A to B.
  static Step JointStep(const Joint& joint, bool places_a);
  /// Grows a tree from a link with pose `X_RL`, unless the link is placed already.
  void Grow(const Model& model, const Robot& robot, const Omitted& omitted, int start_module,
            int start_link, const Pose& X_RL);
  /// Fills in loops_ with the dockings and joints that no tree has used.
  void CollectLoops(const Model& model, const Robot& robot);

  /// For each module: the flat index of its first link, and of its first joint.
  std::vector<int> first_link_;
  std::vector<int> first_joint_;
  int num_joints_ = 0;
  std::vector<Step> steps_;
  std::vector<Loop> loops_;
  /// The dockings at each link by its flat index, in declared order; used only while building.
  std::vector<std::vector<int>> dockings_at_;
  /// True for each link, by flat index, that has its place; used only while building.
  std::vector<bool> placed_;
  /// True for each docking that is an edge of a tree; used only while building.
  std::vector<bool> used_docking_;
  /// True for each joint, by flat index, that is an edge of a tree; used only while building.
  std::vector<bool> used_joint_;
};

}  // namespace morphbus::model
