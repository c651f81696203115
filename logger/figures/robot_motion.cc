#include "logger/figures/robot_motion.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "compiler/model/forward_kinematics.h"
#include "compiler/model/link_mass.h"

namespace morphbus::logger {
namespace {

/// A hole in the run that is longer than so many ticks is a damaged number.
constexpr int64_t kMostMissing = 200'000;

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();

bool IsIndex(int i, size_t size) { return i >= 0 && static_cast<size_t>(i) < size; }

/// The pose of the link by which WORLD names a body.
bridge::LinkPose PoseOf(const morphbus::body_pose_t& body) {
  const double* p = body.position_m;
  const double* q = body.orientation_wxyz;
  return {Eigen::Vector3d(p[0], p[1], p[2]),
          Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized()};
}

/// Adds what WORLD says of a link unless something was said of it.
template <class Entry>
void AddOnce(const Entry& entry, std::vector<Entry>* entries) {
  const bool known = std::any_of(entries->begin(), entries->end(), [&](const Entry& other) {
    return other.module_id == entry.module_id && other.link == entry.link;
  });
  if (!known) entries->push_back(entry);
}

/// Each value that is missing is the one before it; before the first one there is the first.
void FillIn(std::vector<double>* row) {
  const auto known =
      std::find_if(row->begin(), row->end(), [](double x) { return !std::isnan(x); });
  double last = known == row->end() ? kNothing : *known;
  for (double& x : *row) last = x = std::isnan(x) ? last : x;
}

}  // namespace

model::LinkRef RootLinkOf(const model::Robot& robot, int module) {
  return {module, module == robot.root_module ? robot.root_link : 0};
}

MotionRecorder::MotionRecorder(const model::Model& model, const model::Robot& robot,
                               const Options& options)
    : model_(model), robot_(robot), options_(options), trunk_(Trunk(model, robot)) {
  motion_.tick_us = options.tick_us;
  motion_.realtime = options.realtime;
  const model::KinematicState start =
      model::ForwardKinematics(model, robot, model::StartValues(robot));
  // R in the frame of the link that carries it.
  root_ = {options.root, start.X_RL[options.root.module][options.root.link].inverse()};
  dockings_ = bridge::DeclaredDockings(model, robot);
  sensed_dockings_.resize(robot.modules.size());
  // What every link weighs and where it ends, and a row for every joint.
  for (int m = 0; m < static_cast<int>(robot.modules.size()); ++m) {
    const model::ModuleType& type = model.TypeOf(robot, m);
    std::vector<LinkShape>& links = shapes_.emplace_back();
    for (int l = 0; l < static_cast<int>(type.links.size()); ++l) {
      const model::LinkMass mass = model::ComputeLinkMass(type, l);
      LinkShape shape{&type.links[l].hull, Eigen::Vector3d::Zero(), 0.0, mass.mass_kg,
                      mass.p_LoLcm_L};
      for (const Eigen::Vector3d& p : *shape.hull) {
        shape.centre += p / static_cast<double>(shape.hull->size());
      }
      for (const Eigen::Vector3d& p : *shape.hull) {
        shape.radius = std::max(shape.radius, (p - shape.centre).norm());
      }
      links.push_back(shape);
      motion_.mass_kg += shape.kg;
    }
    std::vector<int>& rows = row_of_.emplace_back();
    for (int j = 0; j < static_cast<int>(type.joints.size()); ++j) {
      const bool fixed = type.joints[j].type == model::JointType::kFixed;
      rows.push_back(fixed ? -1 : static_cast<int>(motion_.joints.size()));
      if (fixed) continue;
      motion_.joints.push_back(
          {m, j, type.joints[j].type, robot.modules[m].name + "." + type.joints[j].name});
    }
    contact_of_.emplace_back(type.links.size(), -1);
  }
}

void MotionRecorder::Take(const morphbus::sensors_t& sensors) {
  for (const morphbus::module_sensors_t& module : sensors.modules) {
    TakeSensed(sensors.header.sim_time_us, module.module_id, module.joint_position_si,
               module.docked, module.joint_effort_si);
  }
}

void MotionRecorder::Take(const morphbus::actuator_t& actuator) {
  TakeCommands(actuator.header.sim_time_us, actuator.module_id, actuator.joints);
}

void MotionRecorder::Take(const morphbus::world_t& world) {
  TakeBodies(world.header.sim_time_us, world.bodies, world.contacts);
}

std::optional<size_t> MotionRecorder::Slot(int64_t time_us) {
  const int64_t tick_us = options_.tick_us;
  if (tick_us <= 0 || motion_.joints.empty()) return std::nullopt;
  if (num_slots_ == 0) motion_.first_us = time_us;
  // Half a tick of rounding is none; a difference of two extreme numbers is no time.
  if (std::abs(time_us / tick_us - motion_.first_us / tick_us) >
      static_cast<int64_t>(num_slots_) + kMostMissing) {
    return std::nullopt;
  }
  const int64_t slot =
      (time_us - motion_.first_us + (time_us < motion_.first_us ? -1 : 1) * (tick_us / 2)) /
      tick_us;
  const auto grow = [&](size_t before, size_t behind) {
    for (JointSeries& joint : motion_.joints) {
      for (std::vector<double>* row :
           {&joint.target, &joint.velocity, &joint.position, &joint.effort}) {
        row->insert(row->begin(), before, kNothing);
        row->insert(row->end(), behind, kNothing);
      }
    }
    num_slots_ += before + behind;
  };
  // The first message need not be that of the first tick.
  if (slot < 0) {
    grow(static_cast<size_t>(-slot), 0);
    motion_.first_us += slot * tick_us;
    return 0;
  }
  if (static_cast<size_t>(slot) >= num_slots_) grow(0, static_cast<size_t>(slot) + 1 - num_slots_);
  return static_cast<size_t>(slot);
}

JointSeries* MotionRecorder::RowOf(int module, int joint) {
  if (!IsIndex(module, row_of_.size()) || !IsIndex(joint, row_of_[module].size())) return nullptr;
  const int row = row_of_[module][joint];
  return row < 0 ? nullptr : &motion_.joints[row];
}

void MotionRecorder::TakeSensed(int64_t time_us, int module, const std::vector<double>& position,
                                const std::vector<morphbus::docked_connector_t>& docked,
                                const std::vector<float>& effort) {
  if (!IsIndex(module, robot_.modules.size())) return;
  if (const std::optional<size_t> slot = Slot(time_us)) {
    for (int j = 0; j < static_cast<int>(position.size()); ++j) {
      JointSeries* row = RowOf(module, j);
      if (row == nullptr) continue;
      row->position[*slot] = position[j];
      if (IsIndex(j, effort.size())) row->effort[*slot] = static_cast<double>(effort[j]);
    }
  }
  // Dockings are the same for most of a run.
  auto& known = sensed_dockings_[module];
  if (known && bridge::SameDocked(*known, docked)) return;
  known = docked;
  changed_dockings_[time_us][module] = docked;
}

void MotionRecorder::TakeCommands(int64_t time_us, int module,
                                  const std::vector<morphbus::joint_command_t>& joints) {
  using morphbus::joint_command_t;
  const std::optional<size_t> slot = Slot(time_us);
  if (!slot) return;
  for (int j = 0; j < static_cast<int>(joints.size()); ++j) {
    JointSeries* row = RowOf(module, j);
    if (row == nullptr) continue;
    // A joint that holds has its last target.
    const bool turns = joints[j].mode == joint_command_t::MODE_VELOCITY;
    row->velocity[*slot] = turns ? joints[j].speed_si : 0.0;
    if (joints[j].mode == joint_command_t::MODE_POSITION) row->target[*slot] = joints[j].target_si;
  }
}

void MotionRecorder::TakeBodies(int64_t time_us, const std::vector<morphbus::body_pose_t>& bodies,
                                const std::vector<morphbus::contact_force_t>& contacts) {
  // Parts of one tick make one list; a part that comes again adds nothing.
  WorldAtTick& world = worlds_[time_us];
  for (const morphbus::body_pose_t& body : bodies) AddOnce(body, &world.bodies);
  for (const morphbus::contact_force_t& contact : contacts) AddOnce(contact, &world.contacts);
  // What is so old is complete.
  const int64_t late_us = int64_t{kMostLateTicks} * std::max(options_.tick_us, 1);
  while (worlds_.rbegin()->first - worlds_.begin()->first > late_us) {
    TakeWhole(worlds_.begin()->first, std::move(worlds_.begin()->second));
    worlds_.erase(worlds_.begin());
  }
}

void MotionRecorder::TakeWhole(int64_t time_us, WorldAtTick world) {
  Place(time_us, std::move(world.bodies));
  NoteLoads(world.contacts);
}

void MotionRecorder::NoteLoads(const std::vector<morphbus::contact_force_t>& contacts) {
  ++num_worlds_;
  for (const morphbus::contact_force_t& contact : contacts) {
    const int m = contact.module_id, l = contact.link;
    if (!IsIndex(m, shapes_.size()) || !IsIndex(l, shapes_[m].size())) continue;
    const Eigen::Vector3d f_W = Eigen::Map<const Eigen::Vector3f>(contact.force_n).cast<double>();
    LinkLoad& load = loads_[{m, l}];
    load.mean_W += f_W;
    load.peak_n = std::max(load.peak_n, f_W.norm());
  }
}

void MotionRecorder::Place(int64_t time_us, std::vector<morphbus::body_pose_t> bodies) {
  // What was docked by then.
  while (!changed_dockings_.empty() && changed_dockings_.begin()->first <= time_us) {
    for (auto& [module, docked] : changed_dockings_.begin()->second) dockings_[module] = docked;
    changed_dockings_.erase(changed_dockings_.begin());
  }
  // The order in which parts came must not show in the last digits of a sum.
  const auto name_of = [](const morphbus::body_pose_t& b) {
    return std::pair(b.module_id, b.link);
  };
  std::sort(bodies.begin(), bodies.end(),
            [&](const auto& a, const auto& b) { return name_of(a) < name_of(b); });
  // Bodies fall apart and join only where the set of bodies changes.
  std::vector<std::pair<int, int>> names;
  for (const morphbus::body_pose_t& body : bodies) names.emplace_back(body.module_id, body.link);
  if (names != bodies_ || masses_.empty()) LayOut(names);
  if (!complete_) return;
  std::vector<bridge::LinkPose> X_WB;
  for (const morphbus::body_pose_t& body : bodies) X_WB.push_back(PoseOf(body));
  // The centre of mass is the sum of the bodies' moments over all of the mass.
  RobotSample sample;
  sample.time_us = time_us;
  double kg = 0.0;
  for (size_t b = 0; b < bodies.size(); ++b) {
    sample.p_WCm += masses_[b].kg * X_WB[b].position + X_WB[b].rotation * masses_[b].moment;
    kg += masses_[b].kg;
  }
  sample.p_WCm /= kg;
  // Root and trunk go with their links, whatever body these belong to by now.
  const auto frame = [&](const TrackedBody& tracked) {
    const bridge::LinkPlace& place = places_[tracked.link.module][tracked.link.link];
    return X_WB[place.body] * place.X_BL * bridge::ToLinkPose(tracked.X_LP);
  };
  sample.p_WR = frame(root_).position;
  const bridge::LinkPose X_WT = frame(trunk_);
  sample.p_WT = X_WT.position;
  sample.q_WT = X_WT.rotation;
  motion_.track.push_back(sample);
  NoteContacts(X_WB);
}

void MotionRecorder::LayOut(const std::vector<std::pair<int, int>>& bodies) {
  bodies_ = bodies;
  places_ = bridge::PlacesInBodies<bridge::LinkPose>(model_, robot_, dockings_, bodies);
  masses_.assign(bodies.size(), {});
  complete_ = !bodies.empty();
  for (size_t m = 0; m < places_.size(); ++m) {
    for (size_t l = 0; l < places_[m].size(); ++l) {
      const bridge::LinkPlace& place = places_[m][l];
      if (place.body < 0) {
        complete_ = false;
        continue;
      }
      const LinkShape& shape = shapes_[m][l];
      BodyMass& body = masses_[place.body];
      body.kg += shape.kg;
      body.moment += shape.kg * (place.X_BL.position + place.X_BL.rotation * shape.p_LoLcm);
    }
  }
}

std::string MotionRecorder::NameOfLink(int module, int link) const {
  return robot_.modules[module].name + "." + model_.TypeOf(robot_, module).links[link].name;
}

void MotionRecorder::NoteContacts(const std::vector<bridge::LinkPose>& X_WB) {
  const int sample = static_cast<int>(motion_.track.size()) - 1;
  for (int m = 0; m < static_cast<int>(places_.size()); ++m) {
    for (int l = 0; l < static_cast<int>(places_[m].size()); ++l) {
      const LinkShape& shape = shapes_[m][l];
      const bridge::LinkPlace& place = places_[m][l];
      if (shape.hull->empty()) continue;
      const bridge::LinkPose X_WL = X_WB[place.body] * place.X_BL;
      // A ball that is clear of the ground has nothing in it that is not.
      if ((X_WL.position + X_WL.rotation * shape.centre).y() - shape.radius >= kContactHeightM) {
        continue;
      }
      double lowest = std::numeric_limits<double>::infinity();
      for (const Eigen::Vector3d& p : *shape.hull) {
        lowest = std::min(lowest, (X_WL.position + X_WL.rotation * p).y());
      }
      if (lowest >= kContactHeightM) continue;
      int& index = contact_of_[m][l];
      if (index < 0) {
        index = static_cast<int>(motion_.contacts.size());
        motion_.contacts.push_back({m, l, NameOfLink(m, l), {}});
      }
      // A stance lasts as long as no sample is without it.
      auto& stances = motion_.contacts[index].stances;
      if (stances.empty() || stances.back().second != sample) stances.emplace_back(sample, sample);
      stances.back().second = sample + 1;
    }
  }
}

RobotMotion MotionRecorder::Finish() {
  for (auto& [time_us, world] : worlds_) TakeWhole(time_us, std::move(world));
  worlds_.clear();
  for (auto& [who, load] : loads_) {
    const auto [m, l] = who;
    load.module = m;
    load.link = l;
    load.name = NameOfLink(m, l);
    load.mean_W /= static_cast<double>(num_worlds_);
    motion_.loads.push_back(std::move(load));
  }
  loads_.clear();
  for (JointSeries& joint : motion_.joints) {
    for (std::vector<double>* row :
         {&joint.target, &joint.velocity, &joint.position, &joint.effort}) {
      FillIn(row);
    }
  }
  std::sort(motion_.contacts.begin(), motion_.contacts.end(), [](const auto& a, const auto& b) {
    return std::pair(a.module, a.link) < std::pair(b.module, b.link);
  });
  return std::move(motion_);
}

}  // namespace morphbus::logger
