#include "sim/bodies.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "compiler/model/convex_hull.h"
#include "compiler/model/forward_kinematics.h"
#include "compiler/source/check.h"
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

constexpr double kStartClearance = 0.5e-3;

double RoundTo(double x, double grid) {
  return std::isfinite(x) ? std::round(x * grid) / grid + 0.0 : x;
}

Vector3d RoundPoint(const Vector3d& p) {
  return {RoundToNanometre(p.x()), RoundToNanometre(p.y()), RoundToNanometre(p.z())};
}

bool PointLess(const Vector3d& a, const Vector3d& b) {
  return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
}

bool PointsLess(const std::vector<Vector3d>& a, const std::vector<Vector3d>& b) {
  return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end(), PointLess);
}

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
  std::vector<Vector3d> core_W;

  bool operator<(const PlacedLink& other) const {
    if (p_WoLcm_W != other.p_WoLcm_W) return PointLess(p_WoLcm_W, other.p_WoLcm_W);
    if (mass_kg != other.mass_kg) return mass_kg < other.mass_kg;
    return PointsLess(core_W, other.core_W);
  }
};

PlacedLink PlaceLink(const LinkPhysics& link, LinkRef ref, const Pose& X_WL) {
  PlacedLink placed;
  placed.ref = ref;
  placed.X_WL = X_WL;
  placed.mass_kg = RoundTo(link.mass_kg, 1e9);
  placed.p_WoLcm_W = RoundPoint(X_WL * link.p_LoLcm_L);
  const Matrix3d inertia = X_WL.linear() * link.I_Lcm_L * X_WL.linear().transpose();
  for (int row = 0; row < 3; ++row) {
    for (int column = row; column < 3; ++column) {
      const double rounded = RoundTo(inertia(row, column), kInertiaGrid);
      placed.I_Lcm_W(row, column) = rounded;
      placed.I_Lcm_W(column, row) = rounded;
    }
  }
  for (const Vector3d& p_L : link.core_L) placed.core_W.push_back(RoundPoint(X_WL * p_L));
  SortPoints(&placed.core_W);
  return placed;
}

// The principal frame of inertia I nearest to W, or W itself where I is diagonal already.
Matrix3d PrincipalFrame(const Matrix3d& I_W) {
  const double off = std::max({std::abs(I_W(0, 1)), std::abs(I_W(0, 2)), std::abs(I_W(1, 2))});
  if (off <= kDiagonalTolerance * I_W.trace()) return Matrix3d::Identity();
  const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(I_W);
  const Matrix3d axes = solver.eigenvectors();
  std::array<int, 3> order = {0, 1, 2};
  Matrix3d best = Matrix3d::Identity();
  double best_trace = -std::numeric_limits<double>::infinity();
  do {
    Matrix3d frame;
    for (int k = 0; k < 3; ++k) {
      const Vector3d axis = axes.col(order[static_cast<size_t>(k)]);
      frame.col(k) = axis(k) < 0.0 ? Vector3d(-axis) : axis;
    }
    if (frame.determinant() > 0.0 && frame.trace() > best_trace) {
      best_trace = frame.trace();
      best = frame;
    }
  } while (std::next_permutation(order.begin(), order.end()));
  return best;
}

BodySpec MakeBody(std::vector<PlacedLink> links) {
  std::sort(links.begin(), links.end());
  BodySpec body;
  Vector3d moment = Vector3d::Zero();
  for (const PlacedLink& link : links) {
    body.mass_kg += link.mass_kg;
    moment += link.mass_kg * link.p_WoLcm_W;
  }
  const Vector3d p_WoBo_W = RoundPoint(moment / body.mass_kg);
  Matrix3d I_W = Matrix3d::Zero();
  for (const PlacedLink& link : links) {
    const Vector3d r = link.p_WoLcm_W - p_WoBo_W;
    I_W +=
        link.I_Lcm_W + link.mass_kg * (r.squaredNorm() * Matrix3d::Identity() - r * r.transpose());
  }
  const Matrix3d R_WB = PrincipalFrame(I_W);
  body.X_WB.linear() = R_WB;
  body.X_WB.translation() = p_WoBo_W;
  body.inertia_B = (R_WB.transpose() * I_W * R_WB).diagonal();
  const Pose X_BW = body.X_WB.inverse();
  for (const PlacedLink& link : links) {
    LinkSpec spec;
    spec.ref = link.ref;
    spec.mass_kg = link.mass_kg;
    spec.X_BL = X_BW * link.X_WL;
    spec.p_BoLcm_B = X_BW * link.p_WoLcm_W;
    for (const Vector3d& p_W : link.core_W) {
      spec.hull_B.push_back(RoundPoint(R_WB.transpose() * (p_W - p_WoBo_W)));
    }
    SortPoints(&spec.hull_B);
    body.links.push_back(std::move(spec));
  }
  for (size_t i = 1; i < body.links.size(); ++i) {
    const LinkRef& a = body.links[i].ref;
    const LinkRef& b = body.links[static_cast<size_t>(body.first_link)].ref;
    if (std::pair(a.module, a.link) < std::pair(b.module, b.link)) {
      body.first_link = static_cast<int>(i);
    }
  }
  return body;
}

bool BodyLess(const BodySpec& a, const BodySpec& b) {
  const Vector3d p_a = a.X_WB.translation();
  const Vector3d p_b = b.X_WB.translation();
  if (p_a != p_b) return PointLess(p_a, p_b);
  if (a.mass_kg != b.mass_kg) return a.mass_kg < b.mass_kg;
  return PointsLess(a.links.front().hull_B, b.links.front().hull_B);
}

// A joint as the motion it allows between two bodies: a twist up to its sign.
struct Freedom {
  size_t low = 0;  // The bodies, by number.
  size_t high = 0;
  Eigen::Matrix<double, 6, 1> twist;
};

std::vector<Freedom> Freedoms(const model::Model& model, const model::Robot& robot,
                              const LinkPoseTable& X_WL,
                              const std::vector<std::vector<int>>& body_of) {
  std::vector<Freedom> freedoms;
  for (size_t m = 0; m < robot.modules.size(); ++m) {
    for (const model::Joint& joint : model.TypeOf(robot, static_cast<int>(m)).joints) {
      if (joint.type == model::JointType::kFixed) continue;
      const auto link_a = static_cast<size_t>(joint.link_a);
      const auto a = static_cast<size_t>(body_of[m][link_a]);
      const auto b = static_cast<size_t>(body_of[m][static_cast<size_t>(joint.link_b)]);
      const Vector3d axis_W = X_WL[m][link_a].linear() * joint.axis;
      Freedom freedom{std::min(a, b), std::max(a, b), {}};
      if (joint.type == model::JointType::kPrismatic) {
        freedom.twist << Vector3d::Zero(), axis_W;
      } else {
        freedom.twist << axis_W, (X_WL[m][link_a] * joint.p_MoJo_M).cross(axis_W);
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
      if (f.low != g.low || f.high != g.high || f.low == f.high) continue;
      if ((f.twist - g.twist).norm() < kSameAxis || (f.twist + g.twist).norm() < kSameAxis)
        continue;
      for (std::vector<int>& module : *body_of) {
        for (int& body : module) {
          if (body == static_cast<int>(f.high)) body = static_cast<int>(f.low);
        }
      }
      return true;
    }
  }
  return false;
}

std::vector<BodySpec> MakeBodies(const model::Model& model, const model::Robot& robot,
                                 const LinkPoseTable& X_WL) {
  std::vector<std::vector<int>> group_of = model::BodiesOf(model, robot);
  while (MergeLockedPair(Freedoms(model, robot, X_WL, group_of), &group_of)) {
  }
  std::vector<std::vector<PlacedLink>> groups;
  for (size_t m = 0; m < robot.modules.size(); ++m) {
    const model::ModuleType& type = model.TypeOf(robot, static_cast<int>(m));
    for (size_t l = 0; l < type.links.size(); ++l) {
      const auto group = static_cast<size_t>(group_of[m][l]);
      if (groups.size() <= group) groups.resize(group + 1);
      const LinkRef ref{static_cast<int>(m), static_cast<int>(l)};
      groups[group].push_back(PlaceLink(ComputeLinkPhysics(type, ref.link), ref, X_WL[m][l]));
    }
  }
  std::vector<BodySpec> bodies;
  for (std::vector<PlacedLink>& group : groups) {
    if (!group.empty()) bodies.push_back(MakeBody(std::move(group)));
  }
  std::stable_sort(bodies.begin(), bodies.end(), BodyLess);
  return bodies;
}

void NumberGroups(size_t num_modules, std::vector<BodySpec>* bodies) {
  std::vector<int> number(num_modules, -1);
  int next = 0;
  for (BodySpec& body : *bodies) {
    for (LinkSpec& link : body.links) {
      int& n = number[static_cast<size_t>(link.ref.module)];
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

JointSpec MakeJoint(const Assembly& assembly, const model::ModuleType& type, LinkRef ref,
                    const std::vector<Pose>& X_WL, double start) {
  const model::Joint& joint = type.joints[static_cast<size_t>(ref.link)];
  const auto module = static_cast<size_t>(ref.module);
  const Pose& X_WA = X_WL[static_cast<size_t>(joint.link_a)];
  JointSpec spec;
  spec.module = ref.module;
  spec.joint = ref.link;
  spec.type = joint.type;
  const int body_a = assembly.body_of[module][static_cast<size_t>(joint.link_a)];
  const int body_b = assembly.body_of[module][static_cast<size_t>(joint.link_b)];
  spec.body_1 = std::min(body_a, body_b);
  spec.body_2 = std::max(body_a, body_b);
  spec.axis_W = X_WA.linear() * joint.axis;
  const bool turned = CanonicalDirection(&spec.axis_W);
  spec.sign = turned == (body_a == spec.body_2) ? -1.0 : 1.0;

  // The anchor: the place on the axis nearest to the middle of the two links.
  const Vector3d p_WoJo_W = X_WA * joint.p_MoJo_M;
  const Vector3d middle = 0.5 * (X_WA * ComputeLinkPhysics(type, joint.link_a).p_LoLcm_L +
                                 X_WL[static_cast<size_t>(joint.link_b)] *
                                     ComputeLinkPhysics(type, joint.link_b).p_LoLcm_L);
  spec.p_WJ = RoundPoint(p_WoJo_W + spec.axis_W * spec.axis_W.dot(middle - p_WoJo_W));

  spec.start = start;
  const double low = spec.sign > 0.0 ? joint.lower - start : start - joint.upper;
  const double high = spec.sign > 0.0 ? joint.upper - start : start - joint.lower;
  // A start value a hair outside the limits (rounding, 1e-4 rad at most) widens them.
  spec.lower = std::min(0.0, RoundTo(low, kAngleGrid));
  spec.upper = std::max(0.0, RoundTo(high, kAngleGrid));
  spec.speed = RoundTo(joint.speed, kAngleGrid);
  spec.effort = RoundTo(joint.effort, kAngleGrid);
  return spec;
}

bool JointLess(const JointSpec& a, const JointSpec& b) {
  if (a.p_WJ != b.p_WJ) return PointLess(a.p_WJ, b.p_WJ);
  if (a.axis_W != b.axis_W) return PointLess(a.axis_W, b.axis_W);
  return std::tuple(a.body_1, a.body_2, a.type) < std::tuple(b.body_1, b.body_2, b.type);
}

void MakeJoints(const model::Model& model, const model::Robot& robot, const LinkPoseTable& X_WL,
                const model::JointValues& q, Assembly* assembly) {
  for (size_t m = 0; m < robot.modules.size(); ++m) {
    const model::ModuleType& type = model.TypeOf(robot, static_cast<int>(m));
    assembly->joint_of.emplace_back(type.joints.size(), -1);
    for (size_t j = 0; j < type.joints.size(); ++j) {
      if (type.joints[j].type == model::JointType::kFixed) continue;
      const LinkRef ref{static_cast<int>(m), static_cast<int>(j)};
      assembly->joints.push_back(MakeJoint(*assembly, type, ref, X_WL[m], q[m][j]));
    }
  }
  std::stable_sort(assembly->joints.begin(), assembly->joints.end(), JointLess);
  for (size_t i = 0; i < assembly->joints.size(); ++i) {
    const JointSpec& joint = assembly->joints[i];
    assembly->joint_of[static_cast<size_t>(joint.module)][static_cast<size_t>(joint.joint)] =
        static_cast<int>(i);
  }
}

// Bodies at most two joints apart never collide, nor do two links of one module that are bodies of
// their own; within larger bodies the engine asks for each pair of links.
void FindCollidingPairs(Assembly* assembly) {
  const size_t n = assembly->bodies.size();
  std::vector<std::vector<size_t>> neighbours(n);
  for (const JointSpec& joint : assembly->joints) {
    neighbours[static_cast<size_t>(joint.body_1)].push_back(static_cast<size_t>(joint.body_2));
    neighbours[static_cast<size_t>(joint.body_2)].push_back(static_cast<size_t>(joint.body_1));
  }
  assembly->may_collide.assign(n, std::vector<bool>(n, true));
  for (size_t i = 0; i < n; ++i) {
    assembly->may_collide[i][i] = false;
    for (const size_t j : neighbours[i]) {
      assembly->may_collide[i][j] = false;
      for (const size_t k : neighbours[j]) assembly->may_collide[i][k] = false;
    }
    for (size_t j = 0; j < n; ++j) {
      const std::vector<LinkSpec>& a = assembly->bodies[i].links;
      const std::vector<LinkSpec>& b = assembly->bodies[j].links;
      if (a.size() == 1 && b.size() == 1 && a[0].group == b[0].group) {
        assembly->may_collide[i][j] = false;
      }
    }
  }
}

}  // namespace

double RoundToNanometre(double x) { return RoundTo(x, 1e9); }

LinkPoseTable PlaceOnGround(const model::Model& model, const model::Robot& robot) {
  LinkPoseTable X_WL = model::ForwardKinematics(model, robot, model::StartValues(robot)).X_RL;
  double lowest = std::numeric_limits<double>::infinity();
  for (size_t m = 0; m < robot.modules.size(); ++m) {
    const model::ModuleType& type = model.TypeOf(robot, static_cast<int>(m));
    for (size_t l = 0; l < type.links.size(); ++l) {
      for (const Vector3d& p_L : type.links[l].hull) {
        lowest = std::min(lowest, RoundToNanometre((X_WL[m][l] * p_L).y()));
      }
    }
  }
  const double lift = RoundToNanometre(kStartClearance - (std::isfinite(lowest) ? lowest : 0.0));
  for (std::vector<Pose>& module : X_WL) {
    for (Pose& X : module) X.translation().y() += lift;
  }
  return X_WL;
}

Assembly BuildAssembly(const model::Model& model, const model::Robot& robot,
                       const LinkPoseTable& X_WL, const model::JointValues& q) {
  MORPHBUS_CHECK(X_WL.size() == robot.modules.size() && q.size() == robot.modules.size());
  Assembly assembly;
  assembly.bodies = MakeBodies(model, robot, X_WL);
  NumberGroups(robot.modules.size(), &assembly.bodies);
  for (size_t m = 0; m < robot.modules.size(); ++m) {
    assembly.body_of.emplace_back(model.TypeOf(robot, static_cast<int>(m)).links.size(), -1);
  }
  for (size_t b = 0; b < assembly.bodies.size(); ++b) {
    for (const LinkSpec& link : assembly.bodies[b].links) {
      assembly.body_of[static_cast<size_t>(link.ref.module)][static_cast<size_t>(link.ref.link)] =
          static_cast<int>(b);
    }
  }
  MakeJoints(model, robot, X_WL, q, &assembly);
  FindCollidingPairs(&assembly);
  return assembly;
}

}  // namespace morphbus::sim
