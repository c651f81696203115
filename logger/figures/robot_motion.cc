#include "logger/figures/robot_motion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <tuple>

#include "bridge/description/run_model.h"
#include "compiler/model/link_mass.h"
#include "compiler/model/mass_spread.h"
#include "logger/log/run_log.h"
#include "logger/log/tracked_body.h"

namespace morphbus::logger {
namespace {

/// A hole in the run that is longer than so many ticks is a damaged number.
constexpr int64_t kMostMissing = 200'000;

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();

using bridge::IsIndex;

/// Each value that is missing is the one before it; before the first one there is the first.
void FillIn(std::vector<double>* row) {
  const auto known =
      std::find_if(row->begin(), row->end(), [](double x) { return !std::isnan(x); });
  double last = known == row->end() ? kNothing : *known;
  for (double& x : *row) last = x = std::isnan(x) ? last : x;
}

/// Gathers the motion of one log.
class MotionGatherer {
 public:
  /// `log` outlives the gatherer.
  explicit MotionGatherer(const RunLog& log);
  RobotMotion Gather();

 private:
  /// A body of the present layout: mass (kg), first moment in the frame of the link that stands for
  /// it (kg m).
  struct BodyMass {
    double kg = 0.0;
    Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  };
  /// Where a link's lowest point may be: its hull, and a ball around it, in L.
  struct LinkShape {
    const std::vector<Eigen::Vector3d>* hull = nullptr;
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    double radius = 0.0;
    double kg = 0.0;
    Eigen::Vector3d p_LoLcm = Eigen::Vector3d::Zero();
  };
  /// A body by its module's index in the robot and its link.
  using BodyName = std::pair<int, int>;

  /// Index of a sim time in the joints' rows; none if it is no time that the run can have.
  std::optional<size_t> Slot(int64_t time_us);
  /// The joint's row; null for a fixed joint, or one that the robot lacks.
  JointSeries* RowOf(int module, int joint);
  // What a module sensed, and what it commanded.
  void TakeSensed(const ModuleSeries& module, const SensorSample& sample);
  void TakeCommands(const ModuleSeries& module, const ActuatorSample& sample);
  /// Places the robot of a tick, by the bodies of WORLD.
  void Place(const WorldSample& world);
  void NoteLoads(const std::vector<morphbus::contact_force_t>& contacts);
  /// Finds which links the bodies carry, and what they weigh.
  void LayOut(const std::vector<BodyName>& bodies, int64_t time_us);
  [[nodiscard]] std::string NameOfLink(int module, int link) const;
  void NoteContacts(const std::vector<bridge::LinkPose>& X_WB);

  const RunLog& log_;
  const model::Model& model_;
  const model::Robot& robot_;
  /// Messages name modules by numbers, which SENSORS explains; usually they are the model's.
  std::map<int, int> model_indices_;
  TrackedBody root_, trunk_;
  std::vector<std::vector<LinkShape>> shapes_;  ///< By module and link.
  RobotMotion motion_;
  std::vector<std::vector<int>> row_of_;  ///< Index in motion_.joints, by module and joint; or -1.
  size_t num_slots_ = 0;
  /// The bodies of the present layout, and where all links are in them.
  std::vector<BodyName> bodies_;
  std::vector<std::vector<bridge::LinkPlace>> places_;
  std::vector<BodyMass> masses_;
  bool complete_ = false;  ///< Whether every link has its place.
  /// By module and link: index in motion_.contacts, or -1.
  std::vector<std::vector<int>> contact_of_;
  /// The loads so far, with sums in the place of means.
  std::map<std::pair<int, int>, LinkLoad> loads_;
};

MotionGatherer::MotionGatherer(const RunLog& log)
    : log_(log),
      model_(*log.model),
      robot_(*log.robot),
      model_indices_(ModelIndices(log)),
      trunk_(Trunk(model_, robot_)) {
  motion_.tick_us = log.tick_us;
  motion_.realtime = log.facts.mode == "realtime";
  // At the start, where joints have their start values, R is where the model has it; from then on
  // the root's body carries it along.
  // R in the frame of the link that carries it.
  const model::LinkRef root = log.described->root;
  root_ = {root, log.described->X_RL_start[root.module][root.link].inverse()};
  // What every link weighs and where it ends, and a row for every joint.
  model::LinkMasses masses(model_);
  const model::MassFactors factors = model::DrawMassFactors(model_, robot_, log.facts.noise_seed);
  for (int m = 0; m < static_cast<int>(robot_.modules.size()); ++m) {
    const model::ModuleType& type = model_.TypeOf(robot_, m);
    std::vector<LinkShape>& links = shapes_.emplace_back();
    for (int l = 0; l < static_cast<int>(type.links.size()); ++l) {
      const model::LinkMass& mass = masses.Of(robot_.modules[m].type, l);
      LinkShape shape{&type.links[l].hull, Eigen::Vector3d::Zero(), 0.0,
                      mass.mass_kg * model::FactorOf(factors, m, l), mass.p_LoLcm_L};
      for (const Eigen::Vector3d& p : *shape.hull) {
        // The ball is round the mean of the corners; it need not be the smallest one, since it only
        // spares most links the look at all corners.
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
          {m, j, type.joints[j].type, robot_.modules[m].name + "." + type.joints[j].name});
    }
    contact_of_.emplace_back(type.links.size(), -1);
  }
}

std::optional<size_t> MotionGatherer::Slot(int64_t time_us) {
  const int64_t tick_us = motion_.tick_us;
  if (tick_us <= 0 || motion_.joints.empty()) return std::nullopt;
  // The first message of all gives the origin, to which all others are counted in ticks.
  if (num_slots_ == 0) motion_.first_us = time_us;
  // Half a tick of rounding is none; a difference of two extreme numbers is no time.
  if (std::abs(time_us / tick_us - motion_.first_us / tick_us) >
      static_cast<int64_t>(num_slots_) + kMostMissing) {
    return std::nullopt;
  }
  // Rounded to the nearest tick: integer division goes towards zero, so that half a tick is added
  // away from it.
  const int64_t slot =
      (time_us - motion_.first_us + (time_us < motion_.first_us ? -1 : 1) * (tick_us / 2)) /
      tick_us;
  // All rows have the same length and the same first tick.
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

JointSeries* MotionGatherer::RowOf(int module, int joint) {
  if (!IsIndex(module, row_of_.size()) || !IsIndex(joint, row_of_[module].size())) return nullptr;
  const int row = row_of_[module][joint];
  return row < 0 ? nullptr : &motion_.joints[row];
}

void MotionGatherer::TakeSensed(const ModuleSeries& module, const SensorSample& sample) {
  const std::optional<size_t> slot = Slot(sample.time_us);
  if (!slot) return;
  for (int j = 0; j < static_cast<int>(sample.position.size()); ++j) {
    JointSeries* row = RowOf(module.model_index, j);
    if (row == nullptr) continue;
    row->position[*slot] = sample.position[j];
    if (IsIndex(j, sample.effort.size())) {
      row->effort[*slot] = static_cast<double>(sample.effort[j]);
    }
  }
}

void MotionGatherer::TakeCommands(const ModuleSeries& module, const ActuatorSample& sample) {
  using morphbus::joint_command_t;
  const std::optional<size_t> slot = Slot(sample.time_us);
  if (!slot) return;
  for (int j = 0; j < static_cast<int>(sample.joints.size()); ++j) {
    JointSeries* row = RowOf(module.model_index, j);
    if (row == nullptr) continue;
    // A joint that holds has its last target.
    const joint_command_t& joint = sample.joints[j];
    row->velocity[*slot] = joint.mode == joint_command_t::MODE_VELOCITY ? joint.speed_si : 0.0;
    if (joint.mode == joint_command_t::MODE_POSITION) row->target[*slot] = joint.target_si;
  }
}

void MotionGatherer::NoteLoads(const std::vector<morphbus::contact_force_t>& contacts) {
  for (const morphbus::contact_force_t& contact : contacts) {
    const int m = IndexById(model_indices_, contact.module_id), l = contact.link;
    if (!IsIndex(m, shapes_.size()) || !IsIndex(l, shapes_[m].size())) continue;
    const Eigen::Vector3d f_W = Eigen::Map<const Eigen::Vector3f>(contact.force_n).cast<double>();
    LinkLoad& load = loads_[{m, l}];
    // A sum for now: Gather divides by the number of ticks of which WORLD is known, those without a
    // push included.
    load.mean_W += f_W;
    load.peak_n = std::max(load.peak_n, f_W.norm());
  }
}

void MotionGatherer::Place(const WorldSample& world) {
  // The order in which bodies came must not show in the last digits of a sum.
  std::vector<std::pair<BodyName, bridge::LinkPose>> named;
  for (const morphbus::body_pose_t& body : world.bodies) {
    bridge::LinkPose X_WB = bridge::LinkPoseIn(body);
    // The numbers are those of a message; only a quaternion of length 1 is a rotation.
    X_WB.rotation.normalize();
    named.push_back({{IndexById(model_indices_, body.module_id), body.link}, X_WB});
  }
  std::ranges::stable_sort(named, {}, &decltype(named)::value_type::first);
  std::vector<BodyName> bodies;
  std::vector<bridge::LinkPose> X_WB;
  for (const auto& [name, X] : named) {
    bodies.push_back(name);
    X_WB.push_back(X);
  }
  // Bodies fall apart and join only where the set of bodies changes.
  if (bodies != bodies_ || masses_.empty()) LayOut(bodies, world.time_us);
  if (!complete_) return;
  // The centre of mass is the sum of the bodies' moments over all of the mass.
  RobotSample sample;
  sample.time_us = world.time_us;
  double kg = 0.0;
  for (size_t b = 0; b < bodies.size(); ++b) {
    // A body's moment about its own origin, turned into W, and its mass at that origin (kg m).
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

void MotionGatherer::LayOut(const std::vector<BodyName>& bodies, int64_t time_us) {
  bodies_ = bodies;
  // Where a link lies in its body changes neither with time nor with joints, so that it is found
  // once a layout.
  places_ = bridge::PlacesInBodies<bridge::LinkPose>(
      model_, robot_, DockingsAt(log_, model_indices_, time_us), bodies);
  masses_.assign(bodies.size(), {});
  complete_ = !bodies.empty();
  for (size_t m = 0; m < places_.size(); ++m) {
    for (size_t l = 0; l < places_[m].size(); ++l) {
      const bridge::LinkPlace& place = places_[m][l];
      // A link in no known body makes the centre of mass unknown, and the ticks of this layout are
      // left out.
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

std::string MotionGatherer::NameOfLink(int module, int link) const {
  return robot_.modules[module].name + "." + model_.TypeOf(robot_, module).links[link].name;
}

void MotionGatherer::NoteContacts(const std::vector<bridge::LinkPose>& X_WB) {
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

RobotMotion MotionGatherer::Gather() {
  // Joints first: their rows are by tick, whatever the order of messages.
  for (const ModuleSeries& module : log_.modules) {
    for (const ActuatorSample& sample : module.actuators) TakeCommands(module, sample);
    for (const SensorSample& sample : module.sensors) TakeSensed(module, sample);
  }
  for (const WorldSample& world : log_.world) {
    Place(world);
    NoteLoads(world.contacts);
  }
  // The map has them by module and link; the sums become means now that all ticks are known.
  for (auto& [who, load] : loads_) {
    std::tie(load.module, load.link) = who;
    load.name = NameOfLink(load.module, load.link);
    load.mean_W /= static_cast<double>(log_.world.size());
    motion_.loads.push_back(std::move(load));
  }
  for (JointSeries& joint : motion_.joints) {
    for (std::vector<double>* row :
         {&joint.target, &joint.velocity, &joint.position, &joint.effort}) {
      FillIn(row);
    }
  }
  // Contacts were found in the order in which links first touched the ground.
  std::ranges::sort(motion_.contacts, {},
                    [](const GroundContact& c) { return std::pair(c.module, c.link); });
  return std::move(motion_);
}

}  // namespace

RobotMotion MotionOf(const RunLog& log) { return MotionGatherer(log).Gather(); }

}  // namespace morphbus::logger
