#pragma once
// An assembly flattened for repeated forward kinematics: one step a link, in breadth-first order.

#include <utility>
#include <vector>

#include "compiler/model/forward_kinematics.h"

namespace morphbus::model {

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
  KinematicTree(const Model& model, const Robot& robot) : KinematicTree(model, robot, Omitted()) {}

  [[nodiscard]] int num_links() const { return static_cast<int>(steps_.size()); }
  [[nodiscard]] int num_joints() const { return num_joints_; }
  /// Flat index of a link or joint: modules in order, each with its links (joints) in order.
  [[nodiscard]] int LinkIndex(int module, int link) const { return first_link_[module] + link; }
  [[nodiscard]] int JointIndex(int module, int joint) const { return first_joint_[module] + joint; }

  /// Writes X_RL for each link, by flat index. `q`: num_joints() values (rad, m) by flat index;
  /// `X_RL`: room for num_links() poses.
  void Evaluate(const double* q, Pose* X_RL) const;

  /// How a link is placed: rigidly, by a turn (about an axis of the frame or any other), a slide.
  enum class Kind { kFixed, kTurnX, kTurnY, kTurnZ, kTurn, kSlide };

  struct Step {
    Kind kind = Kind::kFixed;
    int link = 0;
    int parent = -1;    ///< Flat index of a link placed earlier; -1: the robot frame itself.
    int joint = -1;     ///< Flat index; also of a fixed joint.
    int docking = -1;   ///< Index into Robot::dockings.
    double sign = 1.0;  ///< -1 where the tree runs from A to B, or about a negative axis.
    Eigen::Vector3d axis = Eigen::Vector3d::Zero();    ///< Unit, in the parent's frame.
    Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< A point on the axis (m).
    Pose X_PL = Pose::Identity();                      ///< kFixed.
  };
  /// The links, each after the one it hangs from.
  [[nodiscard]] const std::vector<Step>& steps() const { return steps_; }

  /// A joint or docking that the tree did not need: where a loop closes.
  struct Loop {
    int docking = -1;  ///< Index into Robot::dockings, or -1 for a joint inside a module.
    int link_from = 0;
    int link_to = 0;
    int joint = -1;                ///< Flat index, for a joint.
    Pose X_FT = Pose::Identity();  ///< Docking: link_to's frame in link_from's.
    Joint motion;                  ///< Joint: as declared; link_from is its link_b.
    Eigen::Vector3d p_F;           ///< Where the gap is measured, in link_from's frame (m).
  };
  [[nodiscard]] const std::vector<Loop>& loops() const { return loops_; }

  /// Distance (m) and angle (rad) by which `loop` fails to close at these poses and values.
  static std::pair<double, double> Gap(const Loop& loop, const double* q, const Pose* X_RL);

 private:
  static Step JointStep(const Joint& joint, bool places_a);
  void Grow(const Model& model, const Robot& robot, const Omitted& omitted, int start_module,
            int start_link, const Pose& X_RL);
  void CollectLoops(const Model& model, const Robot& robot);

  std::vector<int> first_link_;
  std::vector<int> first_joint_;
  int num_joints_ = 0;
  std::vector<Step> steps_;
  std::vector<Loop> loops_;
  /// By flat link index, in declared order; while building.
  std::vector<std::vector<int>> dockings_at_;
  std::vector<bool> placed_;        ///< By flat link index; while building.
  std::vector<bool> used_docking_;  ///< While building.
  std::vector<bool> used_joint_;    ///< While building.
};

}  // namespace morphbus::model
