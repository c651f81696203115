#include "sim/rigid_body_model.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "compiler/base/check.h"
#include "compiler/model/convex_hull.h"
#include "compiler/model/forward_kinematics.h"
#include "sim/link_physics.h"

namespace morphbus::sim {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Grids other than lengths' 1 nm: coarse against rounding errors, fine against the physics.
constexpr double kInertiaGrid = 1e13;
constexpr double kAngleGrid = 1e12;
constexpr double kDirectionGrid = 1e9;

// Products of inertia below this part of the trace count as none.
constexpr double kDiagonalTolerance = 1e-6;

// A robot starts this far above the ground (m), so that it neither falls far nor starts in contact.
constexpr double kStartClearance = 0.5e-3;

// `x` on the grid of 1/grid; adding 0.0 makes +0 of -0, which would hash differently. Infinities
// stay.
double RoundTo(double x, double grid) {
  return std::isfinite(x) ? std::round(x * grid) / grid + 0.0 : x;
}

Vector3d RoundPoint(const Vector3d& p) {
  return {RoundToNanometre(p.x()), RoundToNanometre(p.y()), RoundToNanometre(p.z())};
}

// The lexicographic order of coordinates, in which everything here is sorted.
bool PointLess(const Vector3d& a, const Vector3d& b) {
  return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
}

bool PointsLess(const std::vector<Vector3d>& a, const std::vector<Vector3d>& b) {
  return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end(), PointLess);
}

// The same for shapes of several parts.
bool PartsLess(const std::vector<std::vector<Vector3d>>& a,
               const std::vector<std::vector<Vector3d>>& b) {
  return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end(), PointsLess);
}

// Corners in order, each once: the same hull then is the same list whichever way it was declared.
void SortPoints(std::vector<Vector3d>* points) {
  std::sort(points->begin(), points->end(), PointLess);
  points->erase(std::unique(points->begin(), points->end()), points->end());
}

// A link in the world: canonical except for `ref` and X_WL.
struct PlacedLink {
  LinkRef ref;
  Pose X_WL = Pose::Identity();
  double mass_kg = 0.0;
  Vector3d p_WoLcm_W;
  Matrix3d I_Lcm_W;
  std::vector<std::vector<Vector3d>> cores_W;
  std::optional<double> friction;

  bool operator<(const PlacedLink& other) const {
    if (p_WoLcm_W != other.p_WoLcm_W) return PointLess(p_WoLcm_W, other.p_WoLcm_W);
    if (mass_kg != other.mass_kg) return mass_kg < other.mass_kg;
    if (cores_W != other.cores_W) return PartsLess(cores_W, other.cores_W);
    return friction < other.friction;
  }
};

// Takes a link's mass, inertia and collision hull to the world and rounds them there: from here on
// nothing depends on how the module is mounted.
PlacedLink PlaceLink(const LinkPhysics& link, double mass_factor, LinkRef ref, const Pose& X_WL) {
  PlacedLink placed;
  placed.ref = ref;
  placed.X_WL = X_WL;
  placed.mass_kg = RoundTo(mass_factor * link.mass_kg, 1e9);
  placed.friction = link.friction;
  placed.p_WoLcm_W = RoundPoint(X_WL * link.p_LoLcm_L);
  // The inertia of the link turned into W: R I R^T. Only one triangle is rounded, so that the
  // result is symmetric to the last bit.
  const Matrix3d inertia = X_WL.linear() * (mass_factor * link.I_Lcm_L) * X_WL.linear().transpose();
  for (int row = 0; row < 3; ++row) {
    for (int column = row; column < 3; ++column) {
      const double rounded = RoundTo(inertia(row, column), kInertiaGrid);
      placed.I_Lcm_W(row, column) = rounded;
      placed.I_Lcm_W(column, row) = rounded;
    }
  }
  for (const std::vector<Vector3d>& core_L : link.cores_L) {
    std::vector<Vector3d>& core_W = placed.cores_W.emplace_back();
    for (const Vector3d& p_L : core_L) core_W.push_back(RoundPoint(X_WL * p_L));
    SortPoints(&core_W);
  }
  // The order in which parts are declared must not count either.
  std::sort(placed.cores_W.begin(), placed.cores_W.end(), PointsLess);
  return placed;
}

// The principal frame of inertia I nearest to W, or W itself where I is diagonal already.
Matrix3d PrincipalFrame(const Matrix3d& I_W) {
  const double off = std::max({std::abs(I_W(0, 1)), std::abs(I_W(0, 2)), std::abs(I_W(1, 2))});
  if (off <= kDiagonalTolerance * I_W.trace()) return Matrix3d::Identity();
  // The eigenvectors come in the order of the moments and with arbitrary signs. Of all right-handed
  // frames that they form the one with the largest trace is nearest to W.
  const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(I_W);
  const Matrix3d axes = solver.eigenvectors();
  std::array<int, 3> order = {0, 1, 2};
  Matrix3d best = Matrix3d::Identity();
  double best_trace = -std::numeric_limits<double>::infinity();
  do {
    Matrix3d frame;
    for (int k = 0; k < 3; ++k) {
      const Vector3d axis = axes.col(order[k]);
      frame.col(k) = axis(k) < 0.0 ? Vector3d(-axis) : axis;
    }
    if (frame.determinant() > 0.0 && frame.trace() > best_trace) {
      best_trace = frame.trace();
      best = frame;
    }
  } while (std::next_permutation(order.begin(), order.end()));
  return best;
}

// One rigid body of links: masses and moments added up in sorted order, because floating-point sums
// depend on the order.
BodySpec MakeBody(std::vector<PlacedLink> links) {
  std::sort(links.begin(), links.end());
  BodySpec body;
  Vector3d moment = Vector3d::Zero();
  for (const PlacedLink& link : links) {
    body.mass_kg += link.mass_kg;
    moment += link.mass_kg * link.p_WoLcm_W;
  }
  // The centre of mass, on the grid, is the body's origin.
  const Vector3d p_WoBo_W = RoundPoint(moment / body.mass_kg);
  Matrix3d I_W = Matrix3d::Zero();
  // The parallel axis theorem takes every link's inertia to the common origin.
  for (const PlacedLink& link : links) {
    const Vector3d r = link.p_WoLcm_W - p_WoBo_W;
    I_W +=
        link.I_Lcm_W + link.mass_kg * (r.squaredNorm() * Matrix3d::Identity() - r * r.transpose());
  }
  // Bullet knows diagonal inertia only, so B is the principal frame.
  const Matrix3d R_WB = PrincipalFrame(I_W);
  body.X_WB.linear() = R_WB;
  body.X_WB.translation() = p_WoBo_W;
  body.inertia_B = (R_WB.transpose() * I_W * R_WB).diagonal();
  // The links are told in B, the hulls rounded once more, since turning them brings back the noise.
  const Pose X_BW = body.X_WB.inverse();
  for (const PlacedLink& link : links) {
    LinkSpec spec;
    spec.ref = link.ref;
    spec.mass_kg = link.mass_kg;
    spec.friction = link.friction;
    spec.X_BL = X_BW * link.X_WL;
    spec.p_BoLcm_B = X_BW * link.p_WoLcm_W;
    for (const std::vector<Vector3d>& core_W : link.cores_W) {
      std::vector<Vector3d>& part_B = spec.parts_B.emplace_back();
      for (const Vector3d& p_W : core_W) {
        part_B.push_back(RoundPoint(R_WB.transpose() * (p_W - p_WoBo_W)));
      }
      SortPoints(&part_B);
    }
    std::sort(spec.parts_B.begin(), spec.parts_B.end(), PointsLess);
    body.links.push_back(std::move(spec));
  }
  // The first link in the numbering of modules names the body to the outside; the engine never sees
  // it.
  for (size_t i = 1; i < body.links.size(); ++i) {
    const LinkRef& a = body.links[i].ref;
    const LinkRef& b = body.links[body.first_link].ref;
    if (std::pair(a.module, a.link) < std::pair(b.module, b.link)) {
      body.first_link = static_cast<int>(i);
    }
  }
  return body;
}

// The order of bodies: by place, then mass, then shape, never by the numbers of modules.
bool BodyLess(const BodySpec& a, const BodySpec& b) {
  const Vector3d p_a = a.X_WB.translation();
  const Vector3d p_b = b.X_WB.translation();
  if (p_a != p_b) return PointLess(p_a, p_b);
  if (a.mass_kg != b.mass_kg) return a.mass_kg < b.mass_kg;
  return PartsLess(a.links.front().parts_B, b.links.front().parts_B);
}

// A joint as the motion it allows between two bodies: a twist up to its sign.
struct Freedom {
  int low = 0;  // The bodies, by number.
  int high = 0;
  Eigen::Matrix<double, 6, 1> twist;
};

// The motions that all joints allow between the bodies of `body_of`, in W.
std::vector<Freedom> Freedoms(const model::Model& model, const model::Robot& robot,
                              const LinkPoseTable& X_WL,
                              const std::vector<std::vector<int>>& body_of) {
  std::vector<Freedom> freedoms;
  for (size_t m = 0; m < robot.modules.size(); ++m) {
    for (const model::Joint& joint : model.TypeOf(robot, static_cast<int>(m)).joints) {
      if (joint.type == model::JointType::kFixed) continue;
      const int a = body_of[m][joint.link_a];
      const int b = body_of[m][joint.link_b];
      const Pose& X_WA = X_WL[m][joint.link_a];
      const Vector3d axis_W = X_WA.linear() * joint.axis;
      Freedom freedom{std::min(a, b), std::max(a, b), {}};
      // A twist is (angular; linear velocity of the point at W's origin): (0; axis) for a slide,
      // and (axis; p x axis) for a turn about an axis through p.
      if (joint.type == model::JointType::kPrismatic) {
        freedom.twist << Vector3d::Zero(), axis_W;
      } else {
        freedom.twist << axis_W, (X_WA * joint.p_MoJo_M).cross(axis_W);
      }
      freedoms.push_back(freedom);
    }
  }
  return freedoms;
}

// Bodies that two joints with different axes hold (M-TRAN's bar, both of whose blocks are part of
// one body) cannot move against each other: they become one, or the engine would fight over them.
bool MergeLockedPair(const std::vector<Freedom>& freedoms, std::vector<std::vector<int>>* body_of) {
  constexpr double kSameAxis = 1e-6;
  for (size_t i = 0; i < freedoms.size(); ++i) {
    for (size_t j = i + 1; j < freedoms.size(); ++j) {
      const Freedom& f = freedoms[i];
      const Freedom& g = freedoms[j];
      // Only joints between the same two bodies can hold these against each other; one twist or its
      // opposite is the same axis.
      if (f.low != g.low || f.high != g.high || f.low == f.high) continue;
      if ((f.twist - g.twist).norm() < kSameAxis || (f.twist + g.twist).norm() < kSameAxis)
        continue;
      // All links of the higher body move over to the lower one.
      for (std::vector<int>& module : *body_of) {
        for (int& body : module) {
          if (body == f.high) body = f.low;
        }
      }
      return true;
    }
  }
  return false;
}

// All bodies of the robot, sorted. Links are grouped by connections and fixed joints, then by
// joints that lock each other.
std::vector<BodySpec> MakeBodies(const model::Model& model, const model::Robot& robot,
                                 const LinkPhysicsTable& physics, const model::MassFactors& factors,
                                 const LinkPoseTable& X_WL) {
  std::vector<std::vector<int>> group_of = model::BodiesOf(model, robot);
  // After a merge two more joints may lie between the same two bodies, so until none is left.
  while (MergeLockedPair(Freedoms(model, robot, X_WL, group_of), &group_of)) {
  }
  // The links of each group, with their mass and shape in the world.
  std::vector<std::vector<PlacedLink>> groups;
  for (size_t m = 0; m < robot.modules.size(); ++m) {
    const model::ModuleType& type = model.TypeOf(robot, static_cast<int>(m));
    for (size_t l = 0; l < type.links.size(); ++l) {
      const int group = group_of[m][l];
      if (std::ssize(groups) <= group) groups.resize(group + 1);
      const LinkRef ref{static_cast<int>(m), static_cast<int>(l)};
      groups[group].push_back(PlaceLink(physics[robot.modules[m].type][l],
                                        model::FactorOf(factors, ref.module, ref.link), ref,
                                        X_WL[m][l]));
    }
  }
  std::vector<BodySpec> bodies;
  for (std::vector<PlacedLink>& group : groups) {
    if (!group.empty()) bodies.push_back(MakeBody(std::move(group)));
  }
  // Bodies that are the same in everything keep the order of their modules.
  std::stable_sort(bodies.begin(), bodies.end(), BodyLess);
  return bodies;
}

// Numbers the modules by the first of their links in canonical order, for the rule that links of
// one module never collide.
void NumberGroups(size_t num_modules, std::vector<BodySpec>* bodies) {
  std::vector<int> number(num_modules, -1);
  int next = 0;
  for (BodySpec& body : *bodies) {
    for (LinkSpec& link : body.links) {
      int& n = number[link.ref.module];
      if (n < 0) n = next++;
      link.group = n;
    }
  }
}

// Makes the first component that is not zero positive; true if that turned the direction round.
bool CanonicalDirection(Vector3d* axis) {
  for (int k = 0; k < 3; ++k) (*axis)(k) = RoundTo((*axis)(k), kDirectionGrid);
  axis->normalize();
  for (int k = 0; k < 3; ++k) {
    if ((*axis)(k) == 0.0) continue;
    const bool turned = (*axis)(k) < 0.0;
    if (turned) *axis = -*axis;
    *axis += Vector3d::Zero();
    return turned;
  }
  return false;
}

// The canonical joint of module ref.module, joint ref.link, whose value is `start` now; `links`
// and X_WL are the module's links and their poses.
JointSpec MakeJoint(const RigidBodyModel& rigid_bodies, const model::ModuleType& type,
                    const std::vector<LinkPhysics>& links, LinkRef ref,
                    const std::vector<Pose>& X_WL, double start) {
  const model::Joint& joint = type.joints[ref.link];
  const std::vector<int>& body_of = rigid_bodies.body_of[ref.module];
  const Pose& X_WA = X_WL[joint.link_a];
  JointSpec spec;
  spec.module = ref.module;
  spec.joint = ref.link;
  spec.type = joint.type;
  const int body_a = body_of[joint.link_a];
  const int body_b = body_of[joint.link_b];
  // The angle is counted from the lower to the higher body about the canonical direction. Either
  // being reversed against the module's own joint (A against B about `axis`) reverses the sign,
  // both do not.
  spec.body_1 = std::min(body_a, body_b);
  spec.body_2 = std::max(body_a, body_b);
  spec.axis_W = X_WA.linear() * joint.axis;
  const bool turned = CanonicalDirection(&spec.axis_W);
  spec.sign = turned == (body_a == spec.body_2) ? -1.0 : 1.0;

  // The anchor: the place on the axis nearest to the middle of the two links.
  const Vector3d p_WoJo_W = X_WA * joint.p_MoJo_M;
  const Vector3d middle = 0.5 * (X_WA * links[joint.link_a].p_LoLcm_L +
                                 X_WL[joint.link_b] * links[joint.link_b].p_LoLcm_L);
  spec.p_WJ = RoundPoint(p_WoJo_W + spec.axis_W * spec.axis_W.dot(middle - p_WoJo_W));

  spec.start = start;
  // The limits, relative to the start and in the canonical sense: they change places under a
  // reversed sign.
  const double low = spec.sign > 0.0 ? joint.lower - start : start - joint.upper;
  const double high = spec.sign > 0.0 ? joint.upper - start : start - joint.lower;
  // A start value outside the limits widens them: by 1e-4 (rad or m) at most at a run's start,
  // where M3L allows as much for rounding; by as much as the joint is beyond them where a docking
  // makes the world anew.
  spec.lower = std::min(0.0, RoundTo(low, kAngleGrid));
  spec.upper = std::max(0.0, RoundTo(high, kAngleGrid));
  spec.speed = RoundTo(joint.speed, kAngleGrid);
  spec.effort = RoundTo(joint.effort, kAngleGrid);
  spec.backlash = RoundTo(joint.backlash, kAngleGrid);
  spec.delay_s = RoundTo(joint.delay_s, kAngleGrid);
  return spec;
}

// The order of joints: by place, direction, then the bodies, which are in canonical order already.
bool JointLess(const JointSpec& a, const JointSpec& b) {
  if (a.p_WJ != b.p_WJ) return PointLess(a.p_WJ, b.p_WJ);
  if (a.axis_W != b.axis_W) return PointLess(a.axis_W, b.axis_W);
  return std::tuple(a.body_1, a.body_2, a.type) < std::tuple(b.body_1, b.body_2, b.type);
}

// All joints that can move, sorted, and the way back from a module's joint to them.
void MakeJoints(const model::Model& model, const model::Robot& robot,
                const LinkPhysicsTable& physics, const LinkPoseTable& X_WL,
                const model::JointValues& q, RigidBodyModel* rigid_bodies) {
  for (size_t m = 0; m < robot.modules.size(); ++m) {
    const model::ModuleType& type = model.TypeOf(robot, static_cast<int>(m));
    rigid_bodies->joint_of.emplace_back(type.joints.size(), -1);
    for (size_t j = 0; j < type.joints.size(); ++j) {
      if (type.joints[j].type == model::JointType::kFixed) continue;
      const LinkRef ref{static_cast<int>(m), static_cast<int>(j)};
      rigid_bodies->joints.push_back(
          MakeJoint(*rigid_bodies, type, physics[robot.modules[m].type], ref, X_WL[m], q[m][j]));
    }
  }
  std::stable_sort(rigid_bodies->joints.begin(), rigid_bodies->joints.end(), JointLess);
  // Where each module's joint has gone to.
  for (size_t i = 0; i < rigid_bodies->joints.size(); ++i) {
    const JointSpec& joint = rigid_bodies->joints[i];
    rigid_bodies->joint_of[joint.module][joint.joint] = static_cast<int>(i);
  }
}

// Bodies at most two joints apart never collide, nor do two links of one module that are bodies of
// their own; within larger bodies the engine asks for each pair of links.
void FindCollidingPairs(RigidBodyModel* rigid_bodies) {
  const size_t n = rigid_bodies->bodies.size();
  // Which bodies a joint connects.
  std::vector<std::vector<int>> neighbours(n);
  for (const JointSpec& joint : rigid_bodies->joints) {
    neighbours[joint.body_1].push_back(joint.body_2);
    neighbours[joint.body_2].push_back(joint.body_1);
  }
  rigid_bodies->may_collide.assign(n, std::vector<bool>(n, true));
  for (size_t i = 0; i < n; ++i) {
    rigid_bodies->may_collide[i][i] = false;
    // Neighbours, and their neighbours: their hulls touch in any posture.
    for (const int j : neighbours[i]) {
      rigid_bodies->may_collide[i][j] = false;
      for (const int k : neighbours[j]) rigid_bodies->may_collide[i][k] = false;
    }
    // Two lone links of one module overlap where its joints are.
    for (size_t j = 0; j < n; ++j) {
      const std::vector<LinkSpec>& a = rigid_bodies->bodies[i].links;
      const std::vector<LinkSpec>& b = rigid_bodies->bodies[j].links;
      if (a.size() == 1 && b.size() == 1 && a[0].group == b[0].group) {
        rigid_bodies->may_collide[i][j] = false;
      }
    }
  }
}

}  // namespace

double RoundToNanometre(double x) { return RoundTo(x, 1e9); }

LinkPoseTable PlaceOnGround(const model::Model& model, const model::Robot& robot) {
  LinkPoseTable X_WL = model::ForwardKinematics(model, robot, model::StartValues(robot)).X_RL;
  // The lowest corner of all hulls; forward kinematics gave poses in R, which is parallel to W.
  double lowest = std::numeric_limits<double>::infinity();
  for (size_t m = 0; m < robot.modules.size(); ++m) {
    const model::ModuleType& type = model.TypeOf(robot, static_cast<int>(m));
    for (size_t l = 0; l < type.links.size(); ++l) {
      for (const Vector3d& p_L : type.links[l].hull) {
        lowest = std::min(lowest, RoundToNanometre((X_WL[m][l] * p_L).y()));
      }
    }
  }
  // The robot is lifted, or let down, until that corner is at the start clearance.
  const double lift = RoundToNanometre(kStartClearance - (std::isfinite(lowest) ? lowest : 0.0));
  for (std::vector<Pose>& module : X_WL) {
    for (Pose& X : module) X.translation().y() += lift;
  }
  return X_WL;
}

RigidBodyModel BuildRigidBodyModel(const model::Model& model, const model::Robot& robot,
                                   const LinkPhysicsTable& physics, const LinkPoseTable& X_WL,
                                   const model::JointValues& q, const model::MassFactors& factors) {
  MORPHBUS_CHECK(X_WL.size() == robot.modules.size() && q.size() == robot.modules.size());
  RigidBodyModel rigid_bodies;
  rigid_bodies.bodies = MakeBodies(model, robot, physics, factors, X_WL);
  // Modules get canonical numbers, links their bodies.
  NumberGroups(robot.modules.size(), &rigid_bodies.bodies);
  for (size_t m = 0; m < robot.modules.size(); ++m) {
    rigid_bodies.body_of.emplace_back(model.TypeOf(robot, static_cast<int>(m)).links.size(), -1);
  }
  for (size_t b = 0; b < rigid_bodies.bodies.size(); ++b) {
    for (const LinkSpec& link : rigid_bodies.bodies[b].links) {
      rigid_bodies.body_of[link.ref.module][link.ref.link] = static_cast<int>(b);
    }
  }
  MakeJoints(model, robot, physics, X_WL, q, &rigid_bodies);
  FindCollidingPairs(&rigid_bodies);
  return rigid_bodies;
}

}  // namespace morphbus::sim
