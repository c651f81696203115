#include "bridge/outward/converter.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bridge/outward/scene.h"
#include "compiler/base/text.h"
#include "vm/image/image_texts.h"

namespace morphbus::bridge {
namespace {

/// The names of a robot's modules, in its order.
std::vector<std::string> NamesOf(const model::Robot& robot) {
  std::vector<std::string> names;
  for (const model::ModuleInstance& module : robot.modules) names.push_back(module.name);
  return names;
}

/// A quarter turn about x: what is up in W (y) is up for viewers (z).
LinkPose WorldForViewers() {
  const double half = std::sqrt(0.5);
  return {Eigen::Vector3d::Zero(), Eigen::Quaterniond(half, half, 0.0, 0.0)};
}

/// R in W for a robot that stands on the ground at its start values, its origin above x = z = 0.
LinkPose StandingOnGround(const RunModel& run) {
  // Up is y in W and in R. The robot is lifted until its lowest corner is at height 0.
  double lowest = std::numeric_limits<double>::infinity();
  for (size_t m = 0; m < run.X_RL_start.size(); ++m) {
    const model::ModuleType& type = run.TypeOf(static_cast<int>(m));
    for (size_t l = 0; l < type.links.size(); ++l) {
      for (const Eigen::Vector3d& p_L : type.links[l].hull) {
        lowest = std::min(lowest, (run.X_RL_start[m][l] * p_L).y());
      }
    }
  }
  LinkPose X_WR;
  if (std::isfinite(lowest)) X_WR.position.y() = -lowest;
  return X_WR;
}

}  // namespace

void SetTime(int64_t time_us, google::protobuf::Timestamp* out) {
  out->set_seconds(time_us / 1'000'000);
  out->set_nanos(static_cast<int32_t>(time_us % 1'000'000) * 1000);
}

Converter::Converter(std::shared_ptr<const RunModel> run, std::string source, ProgramText text)
    : run_(std::move(run)),
      source_(std::move(source)),
      text_(std::move(text)),
      listener_(run_->run, run_->model_hash, NamesOf(*run_->robot)),
      words_(run_) {
  if (run_->has_program) colors_.Add(PlayableRoles(run_->images.program()));
  // Until messages say otherwise, the robot is where and as its model declares it.
  X_WR_ = StandingOnGround(*run_);
  dockings_ = DeclaredDockings(run_->model, *run_->robot);
  const size_t count = run_->robot->modules.size();
  position_.resize(count);
  velocity_.resize(count);
  effort_.resize(count);
  target_.resize(count);
  sign_.resize(count);
  states_.resize(count);
  X_RL_.resize(count);
  frames_.resize(count);
  propagated_frames_.resize(count);
  // Names of frames are made once: every tick needs all of them.
  for (int m = 0; m < num_modules(); ++m) {
    const model::ModuleType& type = run_->TypeOf(m);
    target_[m].resize(type.joints.size());
    sign_[m].resize(type.joints.size());
    states_[m].set_module(run_->robot->modules[m].name);
    for (int l = 0; l < static_cast<int>(type.links.size()); ++l) {
      frames_[m].push_back(LinkFrame(source_, *run_, m, l));
      propagated_frames_[m].push_back(LinkFrame(source_ + "/propagated", *run_, m, l));
    }
  }
}

void Converter::Send(OutwardTopic topic, int64_t time_us,
                     const google::protobuf::MessageLite& message) {
  // Where a log is only read through, nothing is serialized.
  if (!*sink_) return;
  message.SerializeToString(&buffer_);
  (*sink_)(topic, time_us * 1000, buffer_);
}

void Converter::Begin(const OutwardSink& sink) {
  sink_ = &sink;
  // The program's text is added here, since only the source knows where to find it.
  morphbus::Description description = DescriptionOf(*run_, colors_);
  // The text is that of the values in the source, whatever the run has chosen.
  if (text_) {
    const std::string& own = run_->program_file;
    const SourceTexts texts = text_(words_.SourceHash(run_->program_hash), own);
    description.set_program_text(texts.own);
    for (const auto& [file, text] : texts.imported) {
      morphbus::SourceText& imported = *description.add_imported();
      imported.set_file(own.substr(0, own.find_last_of('/') + 1) + file);
      imported.set_text(text);
    }
  }
  Send(OutwardTopic::kDescription, 0, description);
  Send(OutwardTopic::kScene, 0, SceneOf(source_, *run_));
}

std::string Converter::DeployedImage(uint64_t hash) const {
  const auto found = words_.deployed().find(hash);
  return found == words_.deployed().end() ? "" : found->second;
}

void Converter::Repeat(const OutwardSink& sink) {
  sink_ = &sink;
  // Both are made to look as if they had never been told.
  modules_changed_ = true;
  SendModules();
  sent_connections_.clear();
  SendConnections(clock_.time_us());
}

bool Converter::Take(std::string_view channel, const uint8_t* data, size_t size,
                     const OutwardSink& sink) {
  sink_ = &sink;
  return listener_.Take(channel, data, size, this) != RunListener::Kind::kBad;
}

void Converter::OnRepeat(const RunMessage& message) {
  if (message.name.topic != Topic::kClock) return;
  clock_.Repeat();
  // A STATUS that came late, since it was asked for, does not wait until the run goes on.
  SendModules();
}

void Converter::Finish(const OutwardSink& sink) {
  sink_ = &sink;
  SendAll();
}

void Converter::SendAll() {
  SendJoints();
  SendWorld();
  SendPropagated();
  SendCommands();
  SendModules();
}

bool Converter::BeginGathering(const morphbus::header_t& header, Gathering* gathering,
                               void (Converter::*flush)()) {
  // A tick that has been sent is not sent again for one that comes late.
  if (header.tick < gathering->tick) return false;
  if (header.tick > gathering->tick) {
    if (gathering->tick >= 0) (this->*flush)();
    // The new tick begins with nobody.
    gathering->tick = header.tick;
    gathering->time_us = header.sim_time_us;
    gathering->have.clear();
  }
  return true;
}

int Converter::NumLiving() const { return num_modules() - num_lost_; }

void Converter::OnClock(const RunMessage& /*message*/, morphbus::sim_clock_t&& clock) {
  // What modules said of the tick before is not waited for any longer.
  if (transforms_.tick >= 0 && transforms_.tick < clock.header.tick) SendPropagated();
  if (actuators_.tick >= 0 && actuators_.tick < clock.header.tick) SendCommands();
  SendModules();
  // The beat itself, with the commands that take effect.
  const bool had_ended = clock_.ended();
  clock_.Take(clock);
  const int64_t time_us = clock_.time_us();
  morphbus::Clock out;
  SetTime(time_us, out.mutable_timestamp());
  out.set_tick(clock_.tick());
  out.set_phase(clock.phase == morphbus::sim_clock_t::PHASE_START ? morphbus::Clock::START
                : clock_.ended()                                  ? morphbus::Clock::END
                                                                  : morphbus::Clock::RUN);
  out.set_end_reason(EscapeControl(clock.end_reason));
  for (const std::string& control : clock.controls) out.add_controls(EscapeControl(control));
  Send(OutwardTopic::kClock, time_us, out);
  // Every command is told, also one of a later version that cannot be read here.
  for (const std::string& control : clock.controls) {
    SendLog(time_us, foxglove::Log::INFO, source_, "command: " + control, {});
  }
  // A module that is lost says nothing any more, and nothing is waited for of it.
  for (int m = 0; m < num_modules(); ++m) {
    if (states_[m].lost() || !clock_.lost().contains(run_->robot->modules[m].name)) continue;
    states_[m].set_lost(true);
    ++num_lost_;
    modules_changed_ = true;
  }
  if (!clock_.ended() || had_ended) return;
  SendAll();
  SendLog(time_us, foxglove::Log::INFO, source_, "the run ends: " + clock.end_reason, {});
}

void Converter::OnSensors(const RunMessage& /*message*/, morphbus::sensors_t&& sensors) {
  // SENSORS also hands out programs, whose names faults will need.
  deployed_.Take(sensors, &words_.deployed());
  if (!BeginGathering(sensors.header, &sensors_, &Converter::SendJoints)) return;
  for (const morphbus::module_sensors_t& reading : sensors.modules) {
    const int m = reading.module_id;
    if (m < 0 || m >= num_modules()) continue;
    // A reading with another number of joints is of no module of this robot.
    const size_t joints = run_->TypeOf(m).joints.size();
    if (static_cast<size_t>(reading.num_joints) != joints) continue;
    sensors_.have.insert(m);
    position_[m] = reading.joint_position_si;
    velocity_[m].assign(reading.joint_velocity_si.begin(), reading.joint_velocity_si.end());
    effort_[m].assign(reading.joint_effort_si.begin(), reading.joint_effort_si.end());
    // The bodies are put together anew only where something was docked or undocked.
    if (!sensed_ || !SameDocked(dockings_[m], reading.docked)) {
      // The first reading of all takes the place of what the model declares.
      if (!sensed_) dockings_.assign(dockings_.size(), {});
      sensed_ = true;
      dockings_[m] = reading.docked;
      places_outdated_ = true;
    }
  }
  if (static_cast<int>(sensors_.have.size()) == num_modules()) SendJoints();
}

void Converter::SendJoints() {
  if (sensors_.tick < 0 || sensors_.have.empty()) return;
  // The same numbers twice: in our schema with targets and signs, and in the one that viewers know.
  morphbus::Joints joints;
  foxglove::JointStates joint_states;
  // Where a log is only read through, the tick still counts as told.
  if (!*sink_) return sensors_.have.clear();
  SetTime(sensors_.time_us, joints.mutable_timestamp());
  SetTime(sensors_.time_us, joint_states.mutable_timestamp());
  joints.set_tick(sensors_.tick);
  for (const int m : sensors_.have) {
    const model::ModuleType& type = run_->TypeOf(m);
    for (size_t j = 0; j < type.joints.size(); ++j) {
      morphbus::JointValue& joint = *joints.add_joints();
      joint.set_module(run_->robot->modules[m].name);
      joint.set_joint(type.joints[j].name);
      joint.set_position(position_[m][j]);
      joint.set_velocity(velocity_[m][j]);
      joint.set_effort(effort_[m][j]);
      if (target_[m][j]) joint.set_target(*target_[m][j]);
      joint.set_sign(sign_[m][j]);
      foxglove::JointState& state = *joint_states.add_joints();
      state.set_name(run_->robot->modules[m].name + "/" + type.joints[j].name);
      state.set_position(position_[m][j]);
      state.set_velocity(velocity_[m][j]);
      state.set_effort(effort_[m][j]);
    }
  }
  // The tick stays, so that what comes late of it is known to be late; the modules do not.
  sensors_.have.clear();
  Send(OutwardTopic::kJoints, sensors_.time_us, joints);
  Send(OutwardTopic::kJointStates, sensors_.time_us, joint_states);
  SendConnections(sensors_.time_us);
}

void Converter::SendConnections(int64_t time_us) {
  // What is only declared is in the description already.
  if (!sensed_) return;
  morphbus::Connections connections;
  for (int m = 0; m < num_modules(); ++m) {
    for (const morphbus::docked_connector_t& docked : dockings_[m]) {
      // Both modules sense a connection; the one with the lower number tells of it.
      const int mate = docked.mate_module;
      if (mate < m || mate >= num_modules()) continue;
      // Connectors that the types do not have are left out: the message may be made up.
      const auto& own_type = run_->TypeOf(m).connectors;
      const auto& mate_type = run_->TypeOf(mate).connectors;
      if (!IsIndex(docked.connector, own_type.size()) ||
          !IsIndex(docked.mate_connector, mate_type.size())) {
        continue;
      }
      morphbus::ModuleConnection& connection = *connections.add_connections();
      connection.set_module_a(run_->robot->modules[m].name);
      connection.set_connector_a(own_type[docked.connector].name);
      connection.set_module_b(run_->robot->modules[mate].name);
      connection.set_connector_b(mate_type[docked.mate_connector].name);
    }
  }
  // They are told when they change, compared without the time.
  std::string bytes = connections.SerializeAsString() + '.';  // Never empty, also without any.
  if (bytes == sent_connections_) return;
  sent_connections_ = std::move(bytes);
  SetTime(time_us, connections.mutable_timestamp());
  Send(OutwardTopic::kConnections, time_us, connections);
}

void Converter::AddTransform(int64_t time_us, const std::string& parent, const std::string& child,
                             const LinkPose& X, foxglove::FrameTransforms* out) {
  foxglove::FrameTransform& transform = *out->add_transforms();
  SetTime(time_us, transform.mutable_timestamp());
  transform.set_parent_frame_id(parent);
  transform.set_child_frame_id(child);
  transform.mutable_translation()->set_x(X.position.x());
  transform.mutable_translation()->set_y(X.position.y());
  transform.mutable_translation()->set_z(X.position.z());
  transform.mutable_rotation()->set_x(X.rotation.x());
  transform.mutable_rotation()->set_y(X.rotation.y());
  transform.mutable_rotation()->set_z(X.rotation.z());
  transform.mutable_rotation()->set_w(X.rotation.w());
}

void Converter::AddBaseFrames(int64_t time_us, foxglove::FrameTransforms* out) {
  // Names begin with the source, so that several runs can be shown in one scene.
  AddTransform(time_us, "world", source_ + "/world", WorldForViewers(), out);
  AddTransform(time_us, source_ + "/world", source_ + "/robot", X_WR_, out);
}

void Converter::OnWorld(const RunMessage& /*message*/, morphbus::world_t&& world) {
  if (!BeginGathering(world.header, &world_, &Converter::SendWorld)) return;
  // The first part of a tick takes the place of the bodies of the tick before; a part that comes
  // twice counts once.
  if (world_.have.empty()) {
    bodies_.clear();
    contacts_.clear();
  }
  if (!world_.have.insert(world.part).second) return;
  bodies_.insert(bodies_.end(), world.bodies.begin(), world.bodies.end());
  contacts_.insert(contacts_.end(), world.contacts.begin(), world.contacts.end());
  if (static_cast<int>(world_.have.size()) == world.num_parts) SendWorld();
}

void Converter::SendWorld() {
  if (world_.tick < 0 || world_.have.empty()) return;
  world_.have.clear();
  // Which links belong to which body is found anew only where it may have changed.
  std::vector<std::pair<int, int>> keys;
  for (const morphbus::body_pose_t& body : bodies_) keys.emplace_back(body.module_id, body.link);
  if (places_outdated_ || keys != placed_bodies_) {
    places_ = PlacesInBodies<LinkPose>(run_->model, *run_->robot, dockings_, keys);
    placed_bodies_ = std::move(keys);
    places_outdated_ = false;
  }
  const auto X_WL = [&](int module, int link) {
    const LinkPlace& place = places_[module][link];
    const morphbus::body_pose_t& body = bodies_[place.body];
    return LinkPoseIn(body) * place.X_BL;
  };
  // R goes with the root, unless the root has a sensor: then R stays where it was at the start.
  const auto [root, link] = run_->root;
  if (!run_->root_sensor && places_[root][link].body >= 0) {
    X_WR_ = X_WL(root, link) * Inverse(ToLinkPose(run_->X_RL_start[root][link]));
  }
  if (!*sink_) return;
  // All links of a tick in one message, so that no viewer sees half a robot moved.
  foxglove::FrameTransforms transforms;
  AddBaseFrames(world_.time_us, &transforms);
  // A link that no body carries has no pose, and is left out.
  for (int m = 0; m < num_modules(); ++m) {
    for (int l = 0; l < static_cast<int>(places_[m].size()); ++l) {
      if (places_[m][l].body < 0) continue;
      AddTransform(world_.time_us, source_ + "/world", frames_[m][l], X_WL(m, l), &transforms);
    }
  }
  Send(OutwardTopic::kTransforms, world_.time_us, transforms);
  SendForces();
}

void Converter::OnTransform(const RunMessage& message, morphbus::transform_t&& transform) {
  const int module = message.module;
  // Sender and channel must agree.
  if (module < 0 || transform.module_id != module) return;
  if (!BeginGathering(transform.header, &transforms_, &Converter::SendPropagated)) return;
  transforms_.have.insert(module);
  // A module that has lost its pose is drawn nowhere rather than where it was.
  X_RL_[module].clear();
  if (transform.has_pose && transform.link_poses.size() == frames_[module].size()) {
    X_RL_[module] = std::move(transform.link_poses);
  }
  if (static_cast<int>(transforms_.have.size()) >= NumLiving()) SendPropagated();
}

void Converter::SendPropagated() {
  if (transforms_.tick < 0 || transforms_.have.empty()) return;
  if (!*sink_) return transforms_.have.clear();
  const int64_t time_us = transforms_.time_us;
  // In frames of their own, so that viewers can lay both robots over each other.
  foxglove::FrameTransforms propagated, links;
  AddBaseFrames(time_us, &propagated);
  links = propagated;
  for (const int m : transforms_.have) {
    for (size_t l = 0; l < X_RL_[m].size(); ++l) {
      const LinkPose X_RL = LinkPoseIn(X_RL_[m][l]);
      AddTransform(time_us, source_ + "/robot", propagated_frames_[m][l], X_RL, &propagated);
      if (!clock_.has_world())
        AddTransform(time_us, source_ + "/robot", frames_[m][l], X_RL, &links);
    }
  }
  transforms_.have.clear();
  Send(OutwardTopic::kPropagated, time_us, propagated);
  // Where nothing simulates a world, what the modules believe is all there is.
  if (!clock_.has_world()) Send(OutwardTopic::kTransforms, time_us, links);
}

}  // namespace morphbus::bridge
