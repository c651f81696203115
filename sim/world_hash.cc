// The hash of a built world: what two robots have in common when they are one problem to the
// engine.

#include <xxhash.h>

#include <bit>

#include "sim/rigid_body_model.h"

namespace morphbus::sim {
namespace {

// Collects numbers as little-endian bytes, the same on every machine.
class Hasher {
 public:
  void Add(uint64_t x) {
    for (int k = 0; k < 8; ++k) bytes_.push_back(static_cast<uint8_t>(x >> (8 * k)));
  }
  void Add(int x) { Add(static_cast<uint64_t>(static_cast<int64_t>(x))); }
  void Add(double x) { Add(std::bit_cast<uint64_t>(x + 0.0)); }  // -0 + 0 = +0
  void Add(const Eigen::Vector3d& v) {
    for (int k = 0; k < 3; ++k) Add(v(k));
  }
  [[nodiscard]] uint64_t Digest(uint64_t seed) const {
    return XXH64(bytes_.data(), bytes_.size(), seed);
  }

 private:
  std::vector<uint8_t> bytes_;
};

// What the engine gets of a body: mass, inertia, pose, the hulls and which bodies may not touch
// each other; not the names of modules.
void AddBody(const BodySpec& body, Hasher* hasher) {
  hasher->Add(body.mass_kg);
  hasher->Add(body.inertia_B);
  hasher->Add(Eigen::Vector3d(body.X_WB.translation()));
  for (int k = 0; k < 3; ++k) hasher->Add(Eigen::Vector3d(body.X_WB.linear().col(k)));
  hasher->Add(static_cast<int>(body.links.size()));
  for (const LinkSpec& link : body.links) {
    hasher->Add(link.group);
    // A link of one part is hashed as that part alone. The count of several is negative, which no
    // part's number of corners is.
    if (link.parts_B.size() != 1) hasher->Add(-static_cast<int>(link.parts_B.size()));
    for (const std::vector<Eigen::Vector3d>& part : link.parts_B) {
      hasher->Add(static_cast<int>(part.size()));
      for (const Eigen::Vector3d& corner : part) hasher->Add(corner);
    }
    // What few links have is marked by a -1, which nothing that follows a link begins with.
    if (link.friction) {
      hasher->Add(-1);
      hasher->Add(*link.friction);
    }
  }
}

// A joint likewise. Its start value and sign are how a module sees it, which the engine does not.
void AddJoint(const JointSpec& joint, Hasher* hasher) {
  hasher->Add(static_cast<int>(joint.type));
  hasher->Add(joint.body_1);
  hasher->Add(joint.body_2);
  hasher->Add(joint.p_WJ);
  hasher->Add(joint.axis_W);
  for (const double x : {joint.lower, joint.upper, joint.speed, joint.effort}) hasher->Add(x);
  // As of links.
  if (joint.backlash > 0.0 || joint.delay_s > 0.0) {
    hasher->Add(-1);
    hasher->Add(joint.backlash);
    hasher->Add(joint.delay_s);
  }
}

}  // namespace

uint64_t HashRigidBodyModel(const RigidBodyModel& rigid_bodies, uint64_t seed) {
  Hasher hasher;
  hasher.Add(static_cast<int>(rigid_bodies.bodies.size()));
  for (const BodySpec& body : rigid_bodies.bodies) AddBody(body, &hasher);
  hasher.Add(static_cast<int>(rigid_bodies.joints.size()));
  for (const JointSpec& joint : rigid_bodies.joints) AddJoint(joint, &hasher);
  // Which pairs may touch: a choice of ours that changes the run.
  for (const std::vector<bool>& row : rigid_bodies.may_collide) {
    for (const bool collides : row) hasher.Add(collides ? 1 : 0);
  }
  return hasher.Digest(seed);
}

}  // namespace morphbus::sim
