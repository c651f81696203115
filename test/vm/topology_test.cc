// Robots whose connections open and close at random, cycles included: what the virtual machines
// find out hop by hop against what the offline kinematic graph says of the same assembly.

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <queue>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "compiler/model/forward_kinematics.h"
#include "compiler/model/kinematic_graph.h"
#include "test/support/compiled.h"
#include "test/support/toy_model.h"
#include "test/support/vm_robot.h"
#include "vm/run/context.h"
#include "vm/space/bodies.h"

namespace morphbus::vm {
namespace {

using test::VmRobot;

constexpr double kPoseTolerance =
    2e-5;  // m, and 1 - |q.q'|; a dozen transforms in single precision.
constexpr int kTopologyModules = 14;
constexpr int kSettleFor = 10;
constexpr int kFar = 1000;  // Distance of modules that are cut off.

double DistanceFrom(const PoseF& actual, const model::Pose& expected) {
  const PoseF e = test::ToFloat(expected);
  const float dot =
      actual.q.w * e.q.w + actual.q.x * e.q.x + actual.q.y * e.q.y + actual.q.z * e.q.z;
  return std::max(Norm(Subtract(actual.p, e.p)), 1.0f - std::abs(dot));
}

/// A robot some of whose connections are open, and the offline answers for that assembly.
class Assembly {
 public:
  Assembly(const model::Model& model, const model::Robot& robot, uint64_t seed)
      : model_(model), robot_(robot), closed_(robot.dockings.size(), true), random_(seed) {}

  /// Opens or closes one to four connections, and bends all joints.
  void Change(VmRobot* vms) {
    const size_t changes = 1 + random_() % 4;
    for (size_t i = 0; i < changes; ++i) {
      const size_t d = random_() % closed_.size();
      closed_[d] = !closed_[d];
      vms->SetDocked(static_cast<int>(d), closed_[d]);
    }
    q_ = vms->joints();
    std::uniform_real_distribution<double> unit(-1, 1);
    for (size_t m = 0; m < q_.size(); ++m) {
      const model::ModuleType& type = model_.TypeOf(robot_, static_cast<int>(m));
      for (size_t j = 0; j < q_[m].size(); ++j) {
        if (type.joints[j].type != model::JointType::kFixed) q_[m][j] = 0.4 * unit(random_);
      }
    }
  }
  void CloseAll(VmRobot* vms) {
    for (size_t d = 0; d < closed_.size(); ++d) {
      closed_[d] = true;
      vms->SetDocked(static_cast<int>(d), true);
    }
  }

  /// Lets the joints be where Change has put them, whatever the modules command.
  void Tick(VmRobot* vms, int count) const {
    for (int i = 0; i < count; ++i) {
      vms->joints() = q_;
      vms->Tick();
    }
    vms->joints() = q_;
  }

  /// The robot with its closed connections only.
  [[nodiscard]] model::Robot Present() const {
    return With([this](size_t d) { return closed_[d]; });
  }
  /// Ticks in which news comes everywhere: along the longest way between two modules, or between
  /// two parts of one body, whichever is longer, and one more, since a mate's message names a new
  /// docking one tick after the sensors have seen it. Usually the first is: "diameter + 1 ticks".
  /// But the diameter is that of shortest ways, which may lead across joints, and on the other
  /// side of a joint lies another body. What hangs on a body is told from link to link of that
  /// body, so its news cannot take such a shortcut: a body in the shape of a C, whose ends a joint
  /// and two modules bridge, has its ends two apart in the robot, and as many apart for its news as
  /// the C has dockings. To spare that way every module would have to pass on all bodies of the
  /// robot, not just those that it is part of.
  [[nodiscard]] int NewsTicks() const {
    const model::Robot present = Present();
    return std::max(test::DiameterOf(present), test::BodyDiameterOf(model_, present)) + 1;
  }

  /// Connections between each module and the root; kFar for those that are cut off.
  [[nodiscard]] std::vector<int> Hops() const {
    std::vector<int> hops(robot_.modules.size(), kFar);
    std::queue<int> next;
    hops[static_cast<size_t>(robot_.root_module)] = 0;
    next.push(robot_.root_module);
    for (; !next.empty(); next.pop()) {
      for (size_t d = 0; d < closed_.size(); ++d) {
        const model::Docking& docking = robot_.dockings[d];
        const bool from_a = docking.module_a == next.front();
        if (!closed_[d] || (!from_a && docking.module_b != next.front())) continue;
        const int other = from_a ? docking.module_b : docking.module_a;
        if (hops[static_cast<size_t>(other)] != kFar) continue;
        hops[static_cast<size_t>(other)] = hops[static_cast<size_t>(next.front())] + 1;
        next.push(other);
      }
    }
    return hops;
  }

  /// True poses. Cycles of this robot do not close, so that it matters which way a pose comes: by
  /// the fewest connections, and of several such ways by the receiver's lowest connector.
  [[nodiscard]] model::KinematicState Truth() const {
    const std::vector<int> hops = Hops();
    std::vector<int> chosen(robot_.modules.size(), -1), connector(robot_.modules.size(), kFar);
    for (size_t d = 0; d < closed_.size(); ++d) {
      const model::Docking& docking = robot_.dockings[d];
      for (const bool to_a : {false, true}) {
        const auto to = static_cast<size_t>(to_a ? docking.module_a : docking.module_b);
        const auto from = static_cast<size_t>(to_a ? docking.module_b : docking.module_a);
        const int at = to_a ? docking.connector_a : docking.connector_b;
        if (!closed_[d] || hops[from] == kFar || hops[to] != hops[from] + 1) continue;
        if (at >= connector[to]) continue;
        connector[to] = at;
        chosen[to] = static_cast<int>(d);
      }
    }
    const std::set<int> ways(chosen.begin(), chosen.end());
    const model::Robot tree = With([&](size_t d) { return ways.contains(static_cast<int>(d)); });
    return model::ForwardKinematics(model_, tree, q_);
  }

  /// Different modules that each module is connected with.
  [[nodiscard]] std::vector<size_t> Neighbours() const {
    std::vector<std::set<int>> neighbours(robot_.modules.size());
    for (const model::Docking& docking : Present().dockings) {
      neighbours[static_cast<size_t>(docking.module_a)].insert(docking.module_b);
      neighbours[static_cast<size_t>(docking.module_b)].insert(docking.module_a);
    }
    std::vector<size_t> counts;
    for (const std::set<int>& of_one : neighbours) counts.push_back(of_one.size());
    return counts;
  }

 private:
  template <class Predicate>
  [[nodiscard]] model::Robot With(Predicate kept) const {
    model::Robot robot = robot_;
    robot.dockings.clear();
    for (size_t d = 0; d < closed_.size(); ++d) {
      if (kept(d)) robot.dockings.push_back(robot_.dockings[d]);
    }
    return robot;
  }

  const model::Model& model_;
  const model::Robot& robot_;
  std::vector<bool> closed_;
  model::JointValues q_;
  std::mt19937_64 random_;
};

class TopologyTest : public ::testing::TestWithParam<uint64_t> {
 protected:
  const model::Model model_ = test::ToyModel();
  const model::Robot robot_ = test::RandomRobot(model_, kTopologyModules, 8, GetParam());

  /// Whoever hangs on the root knows where it is, by the newest news that can have come.
  void ExpectPoses(VmRobot& vms, const Assembly& assembly) {
    const std::vector<int> hops = assembly.Hops();
    const model::KinematicState truth = assembly.Truth();
    for (int m = 0; m < vms.size(); ++m) {
      const int distance = hops[static_cast<size_t>(m)];
      if (distance == kFar) continue;
      const PoseState& pose = vms.state(m).pose;
      EXPECT_TRUE(pose.has && !pose.stale) << "module " << m;
      EXPECT_EQ(pose.hops, distance) << "module " << m;
      EXPECT_EQ(pose.sequence, vms.tick() - distance) << "module " << m;
      const auto& links = truth.X_RL[static_cast<size_t>(m)];
      for (size_t i = 0; i < links.size(); ++i) {
        EXPECT_LT(DistanceFrom(pose.X_RL[i], links[i]), kPoseTolerance) << "module " << m;
      }
    }
  }

  /// Bodies of the offline graph of what is connected now, and the joints (module, joint) that
  /// touch each of them.
  struct Bodies {
    std::vector<std::vector<int>> body_of;
    std::map<size_t, std::set<std::pair<int, int>>> joints;

    [[nodiscard]] const std::set<std::pair<int, int>>& At(int m, int link) const {
      return joints.at(
          static_cast<size_t>(body_of[static_cast<size_t>(m)][static_cast<size_t>(link)]));
    }
  };
  [[nodiscard]] Bodies OfflineBodies(const Assembly& assembly) const {
    // Of the graph only who touches whom: axes and loops, which take long, do not matter here.
    Bodies bodies{model::BodiesOf(model_, assembly.Present()), {}};
    for (int m = 0; m < kTopologyModules; ++m) {
      const auto& body_of = bodies.body_of[static_cast<size_t>(m)];
      const model::ModuleType& type = model_.TypeOf(robot_, m);
      for (size_t j = 0; j < type.joints.size(); ++j) {
        const model::Joint& joint = type.joints[j];
        if (joint.type == model::JointType::kFixed) continue;
        for (const int link : {joint.link_a, joint.link_b}) {
          bodies.joints[static_cast<size_t>(body_of[static_cast<size_t>(link)])].insert(
              {m, static_cast<int>(j)});
        }
      }
    }
    return bodies;
  }

  /// The joints that touch each link's body, cut off or not, are those of the offline graph.
  void ExpectBodies(VmRobot& vms, const Assembly& assembly) {
    const Bodies bodies = OfflineBodies(assembly);
    for (int m = 0; m < vms.size(); ++m) {
      const int links = static_cast<int>(bodies.body_of[static_cast<size_t>(m)].size());
      for (int link = 0; link < links; ++link) {
        EXPECT_EQ(JointsOf(vms, m, link), bodies.At(m, link)) << "module " << m << " link " << link;
      }
    }
  }

  /// What kCountingRoles makes of a module, by the offline graph: roles that fit, each with the
  /// joint and the link (-1: none) that its labels name.
  using Fits = std::map<std::string, std::pair<int, int>>;
  [[nodiscard]] Fits OfflineFits(const Bodies& bodies, int m) const {
    const model::ModuleType& type = model_.TypeOf(robot_, m);
    // By the number of adjacent joints, the own joints that have so many.
    std::map<size_t, std::vector<int>> own;
    for (size_t j = 0; j < type.joints.size(); ++j) {
      const model::Joint& joint = type.joints[j];
      if (joint.type == model::JointType::kFixed) continue;
      std::set<std::pair<int, int>> touching = bodies.At(m, joint.link_a);
      touching.insert(bodies.At(m, joint.link_b).begin(), bodies.At(m, joint.link_b).end());
      own[touching.size() - 1].push_back(static_cast<int>(j));
    }
    std::vector<int> ends;
    for (size_t link = 0; link < type.links.size(); ++link) {
      if (bodies.At(m, static_cast<int>(link)).size() == 1) ends.push_back(static_cast<int>(link));
    }
    // A label names one thing or nothing, and of a role and its subrole the subrole is taken.
    Fits fits;
    for (const auto& [adjacent, joints] : own) {
      if (joints.size() != 1) continue;
      const bool is_tip = ends.size() == 1;
      fits[(is_tip ? "Tip" : "Inner") + std::to_string(adjacent)] = {joints[0],
                                                                     is_tip ? ends[0] : -1};
    }
    return fits;
  }

  /// Whoever hangs on the root plays a role that the offline graph allows, with its labels.
  /// Returns how many modules have one.
  int ExpectRolesAndLabels(VmRobot& vms, const Assembly& assembly) {
    const Bodies bodies = OfflineBodies(assembly);
    const std::vector<int> hops = assembly.Hops();
    int playing = 0;
    for (int m = 0; m < vms.size(); ++m) {
      if (hops[static_cast<size_t>(m)] == kFar) continue;
      const Fits fits = OfflineFits(bodies, m);
      const std::string role = vms.RoleOf(m);
      const auto fit = fits.find(role);
      // A module with two joints may fit two roles; the one that it holds then wins.
      EXPECT_EQ(fit != fits.end(), !fits.empty()) << "module " << m << " plays '" << role << "'";
      if (fit == fits.end()) continue;
      EXPECT_EQ(vms.LabelOf(m, "turn"), fit->second.first) << "module " << m << " " << role;
      EXPECT_EQ(vms.LabelOf(m, "end"), fit->second.second) << "module " << m << " " << role;
      ++playing;
    }
    return playing;
  }

  /// Joints (module, joint) that a module knows to touch the body of one of its links.
  std::set<std::pair<int, int>> JointsOf(VmRobot& vms, int m, int link) {
    // Links that a fixed joint holds together have one table, that of the lowest.
    const model::ModuleType& type = model_.TypeOf(robot_, m);
    int lowest = link;
    for (const model::Joint& joint : type.joints) {
      if (joint.type != model::JointType::kFixed) continue;
      if (joint.link_a == link || joint.link_b == link) {
        lowest = std::min({lowest, joint.link_a, joint.link_b});
      }
    }
    std::set<std::pair<int, int>> found;
    const BodyTable& table = vms.state(m).bodies[lowest];
    for (int i = 0; i < table.num; ++i) {
      const BodyRecord& record = table.records[i];
      if (record.live != 0) found.insert({record.module - 1, record.joint});
    }
    return found;
  }
};

TEST_P(TopologyTest, PosesAndBodiesFollowEveryChangeWithinDiameterPlusOneTicks) {
  VmRobot vms(model_, robot_, test::EmptyProgram());
  Assembly assembly(model_, robot_, GetParam());
  int cut_off = 0;
  for (int change = 0; change < 15; ++change) {
    assembly.Change(&vms);
    assembly.Tick(&vms, assembly.NewsTicks());
    ExpectPoses(vms, assembly);
    ExpectBodies(vms, assembly);
    if (HasFailure()) FAIL() << "change " << change << ", tick " << vms.tick();
    const std::vector<int> hops = assembly.Hops();
    cut_off += static_cast<int>(std::count(hops.begin(), hops.end(), kFar));
  }
  EXPECT_GT(cut_off, 0) << "no part was ever cut off";
}

TEST_P(TopologyTest, PartsCutOffGoStaleAndComeBack) {
  VmRobot vms(model_, robot_, test::EmptyProgram());
  Assembly assembly(model_, robot_, GetParam());
  for (int change = 0; change < 8; ++change) {
    assembly.Change(&vms);
    // The last news of the root may go round in the part that is cut off before it ages there.
    assembly.Tick(&vms, assembly.NewsTicks() + static_cast<int>(kPoseStaleTicks) + 1);
    const std::vector<int> hops = assembly.Hops();
    for (int m = 0; m < vms.size(); ++m) {
      const PoseState& pose = vms.state(m).pose;
      const bool fresh = pose.has && !pose.stale;
      EXPECT_EQ(fresh, hops[static_cast<size_t>(m)] != kFar) << "module " << m;
    }
  }
  assembly.CloseAll(&vms);
  assembly.Tick(&vms, assembly.NewsTicks());
  ExpectPoses(vms, assembly);
  ExpectBodies(vms, assembly);
}

constexpr char kDegrees[] = R"(
role Alone extends Module { require sizeof(self.connected) == 0; }
role End extends Module { require sizeof(self.connected) == 1; }
role Between extends Module { require sizeof(self.connected) == 2; }
role Hub extends Module { require sizeof(self.connected) >= 3; }
)";

TEST_P(TopologyTest, RolesFollowEveryChangeAndNoneIsTakenWhereTheRootIsOutOfReach) {
  VmRobot vms(model_, robot_, test::ProgramFrom(kDegrees, model_));
  Assembly assembly(model_, robot_, GetParam());
  const std::vector<std::string> names = {"Alone", "End", "Between", "Hub"};
  std::vector<std::string> before(kTopologyModules);
  int judged = 0;
  // The first roles take two ticks longer, in which neighbours hear of each other.
  vms.Tick(assembly.NewsTicks() + kSettleFor + 2);
  for (int m = 0; m < vms.size(); ++m) before[static_cast<size_t>(m)] = vms.RoleOf(m);
  for (int change = 0; change < 10; ++change) {
    assembly.Change(&vms);
    const std::vector<int> hops = assembly.Hops();
    const std::vector<size_t> neighbours = assembly.Neighbours();
    assembly.Tick(&vms, assembly.NewsTicks() + kSettleFor);
    for (int m = 0; m < vms.size(); ++m) {
      const auto i = static_cast<size_t>(m);
      const std::string fits = names[std::min<size_t>(neighbours[i], 3)];
      if (hops[i] == kFar) continue;
      EXPECT_EQ(vms.RoleOf(m), fits) << "module " << m;
    }
    // Long enough for poses to go stale, and for roles to be judged once more after that.
    assembly.Tick(&vms, static_cast<int>(kPoseStaleTicks) + assembly.NewsTicks() + kSettleFor);
    for (int m = 0; m < vms.size(); ++m) {
      const auto i = static_cast<size_t>(m);
      const std::string fits = names[std::min<size_t>(neighbours[i], 3)];
      const std::string role = vms.RoleOf(m);
      if (hops[i] != kFar) {
        EXPECT_EQ(role, fits) << "module " << m;
      } else if (test::DiameterOf(assembly.Present()) < kSettleFor - kNewsLateTicks) {
        // It keeps the role that it has while that fits, and takes no other. In a larger part the
        // root's last news may be on its way when the surroundings of a module have settled.
        EXPECT_EQ(role, before[i] == fits ? fits : "") << "module " << m;
        ++judged;
      }
      before[i] = role;
    }
    if (HasFailure()) FAIL() << "change " << change << ", tick " << vms.tick();
  }
  EXPECT_EQ(vms.CountFaults(FaultCode::kRoleFlicker), 0);
  EXPECT_GT(judged, 0) << "no small part was ever cut off";
}

/// Roles that tell how many joints are adjacent to a joint of the module, and whether a link of it
/// is an end, which nothing but its own joint touches.
std::string CountingRoles() {
  std::string text;
  for (int n = 0; n < 2 * kTopologyModules; ++n) {
    const std::string number = std::to_string(n);
    text += "role Inner" + number + " extends Module { label turn = self.joints($ANY, " + number +
            "); }\nrole Tip" + number + " extends Inner" + number +
            " { label end = self.links(1); }\n";
  }
  return text;
}

/// Ticks between two changes, so that no role changes so often that it is frozen.
constexpr int kCalm = 80;

TEST_P(TopologyTest, RolesAndLabelsFollowTheOfflineGraphWithinTheSameTicks) {
  VmRobot vms(model_, robot_, test::ProgramFrom(CountingRoles(), model_));
  Assembly assembly(model_, robot_, GetParam());
  vms.Tick(kCalm);
  int playing = ExpectRolesAndLabels(vms, assembly);
  for (int change = 0; change < 10 && !HasFailure(); ++change) {
    assembly.Change(&vms);
    assembly.Tick(&vms, assembly.NewsTicks() + kSettleFor);
    playing += ExpectRolesAndLabels(vms, assembly);
    if (HasFailure()) FAIL() << "change " << change << ", tick " << vms.tick();
    assembly.Tick(&vms, kCalm);
    ExpectRolesAndLabels(vms, assembly);
  }
  EXPECT_GT(playing, 2 * kTopologyModules);
  EXPECT_EQ(vms.CountFaults(FaultCode::kRoleFlicker), 0);
}

TEST_P(TopologyTest, WithLossBodiesRolesAndLabelsFollowAsSoonAsNewsGetsThrough) {
  test::VmRobotOptions options;
  options.loss = 0.3;
  options.late = 0.2;
  options.grace_ticks = 25;
  options.seed = GetParam();
  VmRobot vms(model_, robot_, test::ProgramFrom(CountingRoles(), model_), options);
  Assembly assembly(model_, robot_, GetParam());
  // What is gone is missed after the ticks of grace, and news takes several attempts a hop.
  const int long_enough = 2 * options.grace_ticks + 100;
  vms.Tick(long_enough);
  int playing = 0;
  for (int change = 0; change < 6; ++change) {
    assembly.Change(&vms);
    assembly.Tick(&vms, long_enough);
    ExpectBodies(vms, assembly);
    playing += ExpectRolesAndLabels(vms, assembly);
    if (HasFailure()) FAIL() << "change " << change << ", tick " << vms.tick();
  }
  EXPECT_GT(playing, kTopologyModules);
}

/// Hinges whose links one hang together in a row, from the last to the first, whose links two are
/// docked: a ring of modules, through which their body runs in the shape of a C.
model::Robot RobotInTheShapeOfAC(const model::Model& model, int modules) {
  model::Robot robot = test::ChainRobot(model, modules);
  robot.dockings.push_back({0, 5, modules - 1, 3, 0, 0});
  for (model::Docking& docking : robot.dockings) {
    // c0 and c1 are on link one, c3 and c5 on link two.
    if (docking.module_b == docking.module_a + 1) docking.connector_a = 1, docking.connector_b = 0;
    const std::vector<model::ConnectionOption>& options = model.connection_types[0].options;
    for (size_t o = 0; o < options.size(); ++o) {
      if (options[o].connector_a == docking.connector_a &&
          options[o].connector_b == docking.connector_b) {
        docking.option = static_cast<int>(o);
      }
    }
  }
  return robot;
}

/// The reason for the second part of NewsTicks.
TEST(TopologyBoundTest, NewsOfABodyGoesAlongTheBodyAndNotAcrossJoints) {
  constexpr int kRing = 9;
  const model::Model model = test::ToyModel();
  const model::Robot robot = RobotInTheShapeOfAC(model, kRing);
  const int diameter = test::DiameterOf(robot);
  const int length = test::BodyDiameterOf(model, robot);
  ASSERT_EQ(std::make_pair(diameter, length), std::make_pair(kRing / 2, kRing - 1));
  // How many of the joints that touch its body of links one the first module knows.
  VmRobot vms(model, robot, test::EmptyProgram());
  const auto known = [&vms] {
    const BodyTable& table = vms.state(0).bodies[0];
    return std::count_if(table.records, table.records + table.num,
                         [](const BodyRecord& record) { return record.live != 0; });
  };
  vms.Tick(diameter + 1);
  EXPECT_LT(known(), kRing);
  vms.Tick(length - diameter - 1);
  EXPECT_EQ(known(), kRing - 1);
  vms.Tick();
  EXPECT_EQ(known(), kRing);
}

INSTANTIATE_TEST_SUITE_P(Seeds, TopologyTest, ::testing::Range(uint64_t{1}, uint64_t{25}));

}  // namespace
}  // namespace morphbus::vm
