#include "sim/bullet_robot.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "compiler/model/forward_kinematics.h"
#include "sim/breakdown.h"
#include "sim/engine_limits.h"
#include "sim/module_sensors.h"

namespace morphbus::sim {
namespace {

/// Whether two lists hold the same connections, in whatever order.
bool SameConnections(std::vector<model::Docking> a, std::vector<model::Docking> b) {
  const auto key = [](const model::Docking& d) {
    return std::tie(d.module_a, d.connector_a, d.module_b, d.connector_b, d.connection_type,
                    d.option);
  };
  const auto before = [&](const model::Docking& x, const model::Docking& y) {
    return key(x) < key(y);
  };
  std::sort(a.begin(), a.end(), before);
  std::sort(b.begin(), b.end(), before);
  return std::equal(
      a.begin(), a.end(), b.begin(), b.end(),
      [&](const model::Docking& x, const model::Docking& y) { return key(x) == key(y); });
}

// A module's own joint value and the physics' canonical angle: q = start + sign * theta, and back.
double ModuleValue(const JointSpec& spec, double theta) { return spec.start + spec.sign * theta; }
double Theta(const JointSpec& spec, double q) { return spec.sign * (q - spec.start); }

// Velocities of a new body from those of the links it is made of: the mean, weighted with mass.
BodyState InheritedState(const World& old_world, const BodySpec& body) {
  BodyState state;
  state.X_WB = body.X_WB;
  for (const LinkSpec& link : body.links) {
    const int old_body = old_world.rigid_bodies().body_of[link.ref.module][link.ref.link];
    const BodyState old = old_world.body(old_body);
    // The old body's velocity at the link's own centre of mass.
    const Eigen::Vector3d r_W =
        body.X_WB * link.p_BoLcm_B - Eigen::Vector3d(old.X_WB.translation());
    const double share = link.mass_kg / body.mass_kg;
    // Bo is the body's centre of mass, so that this sum keeps the links' momentum. Their angular
    // momentum is kept only where all turned alike: the rate below is a mean.
    state.v_WBo_W += share * (old.v_WBo_W + old.w_WB_W.cross(r_W));
    state.w_WB_W += share * old.w_WB_W;
  }
  return state;
}

}  // namespace

Result<std::unique_ptr<BulletRobot>> BulletRobot::Create(std::shared_ptr<const model::Model> model,
                                                         const std::string& robot,
                                                         const BulletRobotOptions& options) {
  // The checks of the robot and the options, each with its own sentence.
  const model::Robot* found = model->FindRobot(robot);
  if (found == nullptr) return Fail("the model has no robot named " + robot);
  if (options.physics_step_us < 100 || options.physics_step_us > 10000) {
    return Fail("the physics step must lie between 100 and 10000 microseconds");
  }
  if (options.tick_us < options.physics_step_us || options.tick_us > 1000000 ||
      options.tick_us % options.physics_step_us != 0) {
    return Fail("the control tick must be a multiple of the physics step, at most one second");
  }
  if (options.world.solver_iterations < 20 || options.world.solver_iterations > 10000) {
    return Fail("solver iterations must lie between 20 and 10000");
  }
  if (!(options.world.friction >= 0.0 && options.world.friction <= 10.0)) {
    return Fail("friction must lie between 0 and 10");
  }
  // Messages name a module by a number of 16 bits with a sign.
  if (found->modules.empty() || found->modules.size() > 32767) {
    return Fail("a simulated robot has 1 to 32767 modules");
  }
  if (Result<void> bearable = CheckShapes(*model, *found); !bearable) {
    return Fail(bearable.error().message);
  }
  // How far a body reaches from its centre of mass is known only once there are bodies.
  std::unique_ptr<BulletRobot> made(new BulletRobot(std::move(model), *found, options));
  if (Result<void> bearable = CheckReach(*made->model_, *found, made->world_->rigid_bodies());
      !bearable) {
    return Fail(bearable.error().message);
  }
  return made;
}

BulletRobot::BulletRobot(std::shared_ptr<const model::Model> model, const model::Robot& robot,
                         const BulletRobotOptions& options)
    : model_(std::move(model)),
      connections_(model_, robot),
      physics_(ComputeLinkPhysics(*model_, robot)),
      mass_factors_(model::DrawMassFactors(*model_, robot, options.noise_seed)),
      options_(options) {
  // The world at the start: the robot put on the ground, all joints at their start values.
  options_.world.physics_step_s = options_.physics_step_us * 1e-6;
  const RigidBodyModel rigid_bodies =
      BuildRigidBodyModel(*model_, robot, physics_, PlaceOnGround(*model_, robot),
                          model::StartValues(robot), mass_factors_);
  delayed_ = DelayedCommands(rigid_bodies.joints, options_.world.physics_step_s);
  world_ = std::make_unique<World>(rigid_bodies, options_.world);
  world_hash_ = world_->hash();
  FindFirstLinks();
  // Nothing has been exerted yet.
  for (const std::vector<int>& joints : rigid_bodies.joint_of) {
    effort_.emplace_back(joints.size(), 0.0F);
  }
}

// Bodies are numbered by first appearance in (module, link) order.
void BulletRobot::FindFirstLinks() {
  first_links_.clear();
  const std::vector<std::vector<int>> body_of = model::BodiesOf(*model_, robot());
  // So the first link that has the next number is its body's first link.
  for (int m = 0; m < static_cast<int>(body_of.size()); ++m) {
    const std::vector<int>& bodies = body_of[m];
    for (int l = 0; l < static_cast<int>(bodies.size()); ++l) {
      if (bodies[l] == static_cast<int>(first_links_.size())) {
        first_links_.push_back({m, l});
      }
    }
  }
}

void BulletRobot::Sense(std::vector<morphbus::module_sensors_t>* out) {
  out->clear();
  const RigidBodyModel& rigid_bodies = world_->rigid_bodies();
  // Poses of links are needed only by sensors.
  const std::vector<model::ModuleType>& types = model_->module_types;
  const bool has_sensors = std::any_of(types.begin(), types.end(),
                                       [](const auto& type) { return !type.sensors.empty(); });
  const LinkPoseTable X_WL = has_sensors ? LinkPoses() : LinkPoseTable();
  // Joint positions, velocities and efforts, in the module's own values.
  for (size_t m = 0; m < robot().modules.size(); ++m) {
    morphbus::module_sensors_t& sensors = out->emplace_back();
    sensors.module_id = static_cast<int16_t>(m);
    sensors.name = robot().modules[m].name;
    const std::vector<int>& joints = rigid_bodies.joint_of[m];
    sensors.num_joints = static_cast<int8_t>(joints.size());
    for (const int joint : joints) {
      // Fixed joints have no canonical joint and read 0.
      const JointState state = joint < 0 ? JointState{} : world_->joint(joint);
      const JointSpec spec = joint < 0 ? JointSpec{} : rigid_bodies.joints[joint];
      // What a servo measures is its motor's side of the joint.
      sensors.joint_position_si.push_back(ModuleValue(spec, state.motor));
      sensors.joint_velocity_si.push_back(static_cast<float>(spec.sign * state.motor_rate));
    }
    sensors.joint_effort_si = effort_[m];
    if (has_sensors) {
      SenseModule(*world_, *model_, robot(), X_WL, static_cast<int>(m), options_.noise_seed, tick_,
                  &sensors);
    }
  }
  connections_.Sense(out);
}

void BulletRobot::Truth(std::vector<morphbus::body_pose_t>* out) {
  out->clear();
  // Every body is named by its first link, and its pose is that link's.
  const LinkPoseTable poses = LinkPoses();
  for (const LinkRef& link : first_links_) {
    const Pose& X_WL = poses[link.module][link.link];
    morphbus::body_pose_t& pose = out->emplace_back();
    pose.module_id = static_cast<int16_t>(link.module);
    pose.link = static_cast<int8_t>(link.link);
    // Of the two quaternions of a rotation the one with w >= 0 is told.
    const Eigen::Quaterniond q_WL(X_WL.linear());
    const double side = q_WL.w() < 0.0 ? -1.0 : 1.0;
    const double wxyz[4] = {q_WL.w(), q_WL.x(), q_WL.y(), q_WL.z()};
    for (int k = 0; k < 3; ++k) pose.position_m[k] = X_WL.translation()(k);
    for (int k = 0; k < 4; ++k) pose.orientation_wxyz[k] = side * wxyz[k];
  }
}

void BulletRobot::Actuate(const morphbus::actuator_t& command) {
  const int modules = static_cast<int>(robot().modules.size());
  if (command.module_id < 0 || command.module_id >= modules) return;
  // It takes effect in Advance(), when the commands of all modules are there.
  pending_.push_back(command);
}

// Connectors first: a module may let go and move in the same tick.
void BulletRobot::Advance() {
  ApplyConnectorCommands();
  ApplyJointCommands();
  ApplyPushes();
  pending_.clear();
  StepPhysics();
  ++tick_;
  breakdown_ = WhyBroken(*world_, *model_, robot());
}

void BulletRobot::StepPhysics() {
  const RigidBodyModel& rigid_bodies = world_->rigid_bodies();
  std::vector<double> effort(rigid_bodies.joints.size(), 0.0);
  std::vector<std::vector<Eigen::Vector3d>> f_W;
  for (const std::vector<int>& links : rigid_bodies.body_of) {
    f_W.emplace_back(links.size(), Eigen::Vector3d::Zero());
  }
  const int steps = options_.tick_us / options_.physics_step_us;
  // Efforts and forces are summed over the steps and divided by their number below: means over the
  // tick, whatever the step is.
  for (int i = 0; i < steps; ++i) {
    delayed_.Deliver(tick_ * steps + i, [this](int module, int joint, const auto& command) {
      CommandJoint(module, joint, command);
    });
    world_->Step();
    for (size_t j = 0; j < effort.size(); ++j) {
      effort[j] += world_->joint(static_cast<int>(j)).motor_effort;
    }
    world_->AddContactForces(&f_W);
  }
  // Fixed joints, and those inside one body, exert nothing that could be measured.
  for (size_t m = 0; m < effort_.size(); ++m) {
    for (size_t j = 0; j < effort_[m].size(); ++j) {
      const int joint = rigid_bodies.joint_of[m][j];
      if (joint < 0) continue;
      effort_[m][j] = static_cast<float>(rigid_bodies.joints[joint].sign * effort[joint] / steps);
    }
  }
  contacts_.clear();
  for (size_t m = 0; m < f_W.size(); ++m) {
    for (size_t l = 0; l < f_W[m].size(); ++l) {
      // Only links that something has pushed are told, which are few.
      if (f_W[m][l].isZero(0.0)) continue;
      morphbus::contact_force_t& contact = contacts_.emplace_back();
      contact.module_id = static_cast<int16_t>(m);
      contact.link = static_cast<int8_t>(l);
      for (int k = 0; k < 3; ++k) contact.force_n[k] = static_cast<float>(f_W[m][l](k) / steps);
    }
  }
}

// Connectors open and close one after the other, but no link moves meanwhile: the poses are those
// of the world as it stands, and that is made anew once they are all through, unless every
// connection is as it was.
void BulletRobot::ApplyConnectorCommands() {
  const std::vector<model::Docking> before = robot().dockings;
  std::optional<LinkPoseTable> X_WL;
  const auto poses = [&] {
    if (!X_WL) X_WL = LinkPoses();
    return *X_WL;
  };
  bool changed = false;
  for (const morphbus::actuator_t& actuator : pending_) {
    for (const morphbus::connector_command_t& command : actuator.connectors) {
      // Not `changed || …`: every command must be carried out.
      changed = connections_.Command(actuator.module_id, command, poses) || changed;
    }
  }
  if (changed && !SameConnections(before, robot().dockings)) Rebuild();
}

// Hands commands to the servos; joints beyond those that the module has are ignored.
void BulletRobot::ApplyJointCommands() {
  const RigidBodyModel& rigid_bodies = world_->rigid_bodies();
  // Said again in every tick, since a world that was made anew has forgotten it.
  for (const int module : lost_) {
    const bool holds = model_->TypeOf(robot(), module).on_loss == model::OnLoss::kHold;
    for (const int joint : rigid_bodies.joint_of[module]) {
      if (joint < 0) continue;
      world_->Command(joint, {.mode = holds ? ServoMode::kHold : ServoMode::kLimp});
    }
  }
  const int64_t step = tick_ * (options_.tick_us / options_.physics_step_us);
  // The commands of a lost module count no more, even if its last one is still there.
  for (const morphbus::actuator_t& actuator : pending_) {
    if (lost_.contains(actuator.module_id)) continue;
    const std::vector<int>& joints = rigid_bodies.joint_of[actuator.module_id];
    const size_t count = std::min(joints.size(), actuator.joints.size());
    for (size_t j = 0; j < count; ++j) {
      if (joints[j] < 0) continue;
      const int joint = static_cast<int>(j);
      if (delayed_.Put(actuator.module_id, joint, actuator.joints[j], step)) continue;
      CommandJoint(actuator.module_id, joint, actuator.joints[j]);
    }
  }
}

void BulletRobot::CommandJoint(int module, int joint, const morphbus::joint_command_t& command) {
  const RigidBodyModel& rigid_bodies = world_->rigid_bodies();
  const int index = rigid_bodies.joint_of[module][joint];
  const JointSpec& spec = rigid_bodies.joints[index];
  world_->Command(index, ToServo(command, spec.start, spec.sign));
}

Result<void> BulletRobot::Disconnect(const std::string& module, const std::string& connector) {
  Result<void> done = connections_.Disconnect(module, connector);
  if (done) Rebuild();
  return done;
}

Result<void> BulletRobot::Connect(const std::string& module, const std::string& connector,
                                  const std::string& mate_module,
                                  const std::string& mate_connector) {
  Result<void> done = connections_.Connect(
      module, connector, [this] { return LinkPoses(); }, mate_module, mate_connector);
  if (done) Rebuild();
  return done;
}

Result<void> BulletRobot::Push(const std::string& module, const Eigen::Vector3d& f_W,
                               const std::string& link, double seconds) {
  const std::optional<int> m = robot().FindModule(module);
  if (!m) return Fail("the robot has no module " + module);
  // A link that is not named is the module's first one.
  const std::optional<int> l =
      link.empty() ? std::optional<int>(0) : model_->TypeOf(robot(), *m).FindLink(link);
  if (!l) return Fail("module " + module + " has no link " + link);
  // A force that is no number would throw the robot out of what the physics can compute. How strong
  // a push may be is for who takes the command.
  if (!f_W.allFinite()) return Fail("a push needs a force of finite newtons");
  // At least one step, so that no push is without any effect.
  const double us = seconds > 0 ? seconds * 1e6 : options_.tick_us;
  const int64_t steps = std::max<int64_t>(1, std::llround(us / options_.physics_step_us));
  pushes_.push_back({{*m, *l}, f_W, steps});
  return {};
}

void BulletRobot::ApplyPushes() {
  const int64_t steps = options_.tick_us / options_.physics_step_us;
  for (LastingPush& push : pushes_) {
    world_->Push(world_->rigid_bodies().body_of[push.link.module][push.link.link], push.f_W,
                 static_cast<int>(std::min(push.steps, steps)));
    // A push may last for many ticks, and end within one.
    push.steps -= steps;
  }
  std::erase_if(pushes_, [](const LastingPush& push) { return push.steps <= 0; });
}

// A fresh world with the new bodies where the links are, as fast as they are. The servos go on from
// their set-points; what they were doing comes again with the next command.
void BulletRobot::Rebuild() {
  const RigidBodyModel& old = world_->rigid_bodies();
  const RigidBodyModel rigid_bodies =
      BuildRigidBodyModel(*model_, robot(), physics_, LinkPoses(), Positions(), mass_factors_);
  auto next = std::make_unique<World>(rigid_bodies, options_.world);
  // Velocities of the bodies come from those of their links.
  for (size_t b = 0; b < rigid_bodies.bodies.size(); ++b) {
    next->set_body(static_cast<int>(b), InheritedState(*world_, rigid_bodies.bodies[b]));
  }
  for (size_t j = 0; j < rigid_bodies.joints.size(); ++j) {
    // Canonical angles may have a new start and sign; the module's own value is what goes on.
    const JointSpec& spec = rigid_bodies.joints[j];
    // Each joint is in the old world too: the joints are those of the modules, whatever is docked.
    const int old_joint = old.joint_of[spec.module][spec.joint];
    const auto carried = [&](double theta) {
      return Theta(spec, ModuleValue(old.joints[old_joint], theta));
    };
    next->SetServo(static_cast<int>(j), carried(world_->set_point(old_joint)),
                   carried(world_->joint(old_joint).motor));
  }
  world_ = std::move(next);
  // The next command of a servo that takes it late may be far.
  delayed_.Repeat(
      [this](int module, int joint, const auto& command) { CommandJoint(module, joint, command); });
  ++rebuilds_;
  FindFirstLinks();
}

LinkPoseTable BulletRobot::LinkPoses() const {
  const RigidBodyModel& rigid_bodies = world_->rigid_bodies();
  LinkPoseTable X_WL;
  for (const std::vector<int>& links : rigid_bodies.body_of) {
    X_WL.emplace_back(links.size(), Pose::Identity());
  }
  // Every link is fixed in its body: X_WL = X_WB * X_BL.
  for (size_t b = 0; b < rigid_bodies.bodies.size(); ++b) {
    const Pose X_WB = world_->body(static_cast<int>(b)).X_WB;
    for (const LinkSpec& link : rigid_bodies.bodies[b].links) {
      X_WL[link.ref.module][link.ref.link] = X_WB * link.X_BL;
    }
  }
  return X_WL;
}

model::JointValues BulletRobot::Positions() const {
  const RigidBodyModel& rigid_bodies = world_->rigid_bodies();
  model::JointValues q;
  // Fixed joints have no canonical joint and stand at 0.
  for (const std::vector<int>& joints : rigid_bodies.joint_of) {
    std::vector<double>& module = q.emplace_back();
    for (const int joint : joints) {
      module.push_back(
          joint < 0 ? 0.0 : ModuleValue(rigid_bodies.joints[joint], world_->joint(joint).theta));
    }
  }
  return q;
}

}  // namespace morphbus::sim
