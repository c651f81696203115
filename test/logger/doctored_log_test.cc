// Every test alters the log of the recorded run in one way, makes checksums and END fit, and asks
// compare (and verify) what they say.
#include <gtest/gtest.h>

#include <algorithm>
#include <morphbus/sim_clock_t.hpp>
#include <numbers>

#include "logger/compare/comparer.h"
#include "logger/log/facts_text.h"
#include "test/logger/recorded_walk.h"
#include "test/logger/temp_log.h"
#include "test/support/doctored_log.h"

namespace morphbus::logger {
namespace {

using bridge::Topic;
using test::DoctoredLog;
using test::SyntheticEvent;

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr int64_t kLater = 75;  ///< A tick at which all have their roles.
constexpr const char* kModule = "m1";

bool InOneSecond(const header_t& header) {
  return header.tick >= kLater && header.tick < kLater + 50;
}

/// Alters the message of one tick.
template <class M, class Alter>
auto AtTick(const Alter& alter) {
  return [alter](M* message) {
    if (message->header.tick == kLater) alter(message);
  };
}

/// One way of altering a log. `lacks`: something is missing, so that verify must notice, and that
/// not even the log itself is equivalent to it.
struct Way {
  const char* name;
  bool lacks;
  void (*alter)(DoctoredLog* log);
};

// Shorthands: what is altered is the first module's, at one tick, unless a way says otherwise.
template <class Alter>
void Transform(DoctoredLog* log, const Alter& alter) {
  log->Change<transform_t>(Topic::kTransform, kModule, AtTick<transform_t>(alter));
}
template <class Alter>
void Actuator(DoctoredLog* log, const Alter& alter) {
  log->Change<actuator_t>(Topic::kActuator, kModule, AtTick<actuator_t>(alter));
}
template <class Alter>
void EveryStatus(DoctoredLog* log, const Alter& alter) {
  log->Change<status_t>(Topic::kStatus, kModule, alter);
}
template <class Alter>
void Reading(DoctoredLog* log, const Alter& alter) {
  log->Change<sensors_t>(Topic::kSensors, "", AtTick<sensors_t>([&](sensors_t* sensors) {
                           for (module_sensors_t& reading : sensors->modules) {
                             if (reading.name == kModule) alter(&reading);
                           }
                         }));
}
template <class Alter>
void Body(DoctoredLog* log, const Alter& alter) {
  log->Change<world_t>(Topic::kWorld, "", AtTick<world_t>([&](world_t* world) {
                         if (world->part == 0) alter(&world->bodies[1]);
                       }));
}
template <class M>
void DropSecond(DoctoredLog* log, Topic topic, const char* process) {
  log->Drop<M>(topic, process, [](const M& message) { return InOneSecond(message.header); });
}
template <class M>
void DropRest(DoctoredLog* log, Topic topic, const char* process) {
  log->Drop<M>(topic, process, [](const M& message) { return message.header.tick >= kLater; });
}

const Way kWays[] = {
    // What modules told each other.
    {"TransformOfOneModuleAbsent", true,
     [](DoctoredLog* log) { log->DropChannels(Topic::kTransform, kModule); }},
    {"TransformEndsHalfWay", true,
     [](DoctoredLog* log) { DropRest<transform_t>(log, Topic::kTransform, kModule); }},
    {"TransformOfOneSecondAbsent", true,
     [](DoctoredLog* log) { DropSecond<transform_t>(log, Topic::kTransform, kModule); }},
    {"NoPosesOfOneModule", false,
     [](DoctoredLog* log) {
       log->Change<transform_t>(Topic::kTransform, kModule,
                                [](transform_t* t) { t->has_pose = 0; });
     }},
    {"NoPosesForASecond", false,
     [](DoctoredLog* log) {
       log->Change<transform_t>(Topic::kTransform, kModule, [](transform_t* t) {
         if (InOneSecond(t->header)) t->has_pose = 0;
       });
     }},
    {"NoPoseInOneTick", false,
     [](DoctoredLog* log) { Transform(log, [](transform_t* t) { t->has_pose = 0; }); }},
    {"PosesStaleForASecond", false,
     [](DoctoredLog* log) {
       log->Change<transform_t>(Topic::kTransform, kModule, [](transform_t* t) {
         if (InOneSecond(t->header)) t->pose_stale = 1;
       });
     }},
    {"PropagatedPositionOfTheRootLinkMoved", false,
     [](DoctoredLog* log) {
       Transform(log, [](transform_t* t) { t->link_poses[0].position_m[1] += 0.001f; });
     }},
    {"PropagatedPositionOfAnotherLinkMoved", false,
     [](DoctoredLog* log) {
       Transform(log, [](transform_t* t) { t->link_poses[1].position_m[1] += 0.001f; });
     }},
    {"PropagatedRotationTurned", false,
     [](DoctoredLog* log) {
       Transform(log, [](transform_t* t) {
         float* q = t->link_poses[2].orientation_wxyz;
         std::swap(q[0], q[1]);
         std::swap(q[2], q[3]);
       });
     }},
    {"OneLinkWithoutPose", false,
     [](DoctoredLog* log) {
       Transform(log, [](transform_t* t) {
         t->link_poses.pop_back();
         --t->num_links;
       });
     }},
    {"TransformRepeatsThePreviousTick", false,
     [](DoctoredLog* log) {
       std::vector<pose_t> previous;
       log->Change<transform_t>(Topic::kTransform, "m3", [&](transform_t* t) {
         if (t->header.tick >= kWalkTicks - 20) t->link_poses = previous;
         if (t->header.tick < kWalkTicks - 20) previous = t->link_poses;
       });
     }},

    // What modules commanded.
    {"ActuatorOfOneModuleAbsent", true,
     [](DoctoredLog* log) { log->DropChannels(Topic::kActuator, kModule); }},
    {"ActuatorEndsHalfWay", true,
     [](DoctoredLog* log) { DropRest<actuator_t>(log, Topic::kActuator, kModule); }},
    {"ActuatorOfOneSecondAbsent", true,
     [](DoctoredLog* log) { DropSecond<actuator_t>(log, Topic::kActuator, kModule); }},
    {"TargetMovedByADegree", false,
     [](DoctoredLog* log) {
       Actuator(log, [](actuator_t* a) {
         a->joints[0].mode = joint_command_t::MODE_POSITION;
         a->joints[0].target_si += kDegree;
         a->joints[0].speed_si = std::max(a->joints[0].speed_si, 0.5);
       });
     }},
    {"SpeedLimitsHalved", false,
     [](DoctoredLog* log) {
       log->Change<actuator_t>(Topic::kActuator, "", [](actuator_t* a) {
         for (joint_command_t& joint : a->joints) joint.speed_si *= 0.5;
       });
     }},
    {"ModeChanged", false,
     [](DoctoredLog* log) {
       Actuator(log, [](actuator_t* a) {
         const bool hold = a->joints[0].mode == joint_command_t::MODE_HOLD;
         a->joints[0] = {};
         a->joints[0].mode = hold ? joint_command_t::MODE_POSITION : joint_command_t::MODE_HOLD;
         a->joints[0].speed_si = hold ? 1.0 : 0.0;
       });
     }},
    {"VelocityCommanded", false,
     [](DoctoredLog* log) {
       Actuator(log, [](actuator_t* a) {
         a->joints[1].mode = joint_command_t::MODE_VELOCITY;
         a->joints[1].target_si = 0.0;
         a->joints[1].speed_si = 0.3;
       });
     }},
    {"ConnectorCommanded", false,
     [](DoctoredLog* log) {
       Actuator(log, [](actuator_t* a) {
         connector_command_t command{};
         command.value = 1;
         a->connectors.push_back(command);
         a->num_connectors = static_cast<int8_t>(a->connectors.size());
       });
     }},
    {"OneJointWithoutCommand", false,
     [](DoctoredLog* log) {
       Actuator(log, [](actuator_t* a) {
         a->joints.pop_back();
         --a->num_joints;
       });
     }},
    {"CommandsOfTwoModulesSwapped", false,
     [](DoctoredLog* log) {
       for (SyntheticEvent& event : log->events()) {
         if (event.channel == "doctored/m1/ACTUATOR") {
           event.channel = "doctored/m2/ACTUATOR";
         } else if (event.channel == "doctored/m2/ACTUATOR") {
           event.channel = "doctored/m1/ACTUATOR";
         }
       }
     }},
    {"CommandedByAnotherProgram", false,
     [](DoctoredLog* log) {
       log->Change<actuator_t>(Topic::kActuator, kModule, [](actuator_t* a) {
         if (a->header.tick >= kLater) a->header.program_hash ^= 5;
       });
     }},
    {"AllNameAnotherProgram", false,
     [](DoctoredLog* log) {
       log->Change<actuator_t>(Topic::kActuator, "",
                               [](actuator_t* a) { a->header.program_hash ^= 5; });
     }},

    // What was sensed.
    {"JointAngleMovedByADegree", false,
     [](DoctoredLog* log) {
       Reading(log, [](module_sensors_t* r) { r->joint_position_si[0] += kDegree; });
     }},
    {"JointVelocityChanged", false,
     [](DoctoredLog* log) {
       Reading(log, [](module_sensors_t* r) { r->joint_velocity_si[1] += 0.1f; });
     }},
    {"JointEffortChanged", false,
     [](DoctoredLog* log) {
       Reading(log, [](module_sensors_t* r) { r->joint_effort_si[1] += 0.1f; });
     }},
    {"OneJointNotSensed", false,
     [](DoctoredLog* log) {
       Reading(log, [](module_sensors_t* r) {
         r->joint_position_si.pop_back();
         r->joint_velocity_si.pop_back();
         r->joint_effort_si.pop_back();
         --r->num_joints;
       });
     }},
    {"OneMateNotSensed", false,
     [](DoctoredLog* log) {
       Reading(log, [](module_sensors_t* r) {
         r->docked.pop_back();
         --r->num_docked;
       });
     }},
    {"AnotherMateSensed", false,
     [](DoctoredLog* log) {
       Reading(log, [](module_sensors_t* r) {
         r->docked[0].mate_module = static_cast<int16_t>((r->docked[0].mate_module + 4) % 9);
       });
     }},
    {"MateSensedTheOtherWayRound", false,
     [](DoctoredLog* log) { Reading(log, [](module_sensors_t* r) { r->docked[0].number ^= 1; }); }},
    {"ModuleNotSensedForASecond", true,
     [](DoctoredLog* log) {
       log->Change<sensors_t>(Topic::kSensors, "", [](sensors_t* s) {
         if (!InOneSecond(s->header)) return;
         std::erase_if(s->modules, [](const module_sensors_t& r) { return r.name == kModule; });
         s->num_modules = static_cast<int16_t>(s->modules.size());
       });
     }},
    {"ModuleNeverSensed", true,
     [](DoctoredLog* log) {
       log->Change<sensors_t>(Topic::kSensors, "", [](sensors_t* s) {
         std::erase_if(s->modules, [](const module_sensors_t& r) { return r.name == kModule; });
         s->num_modules = static_cast<int16_t>(s->modules.size());
       });
     }},
    {"OnePartOfSensorsAbsent", true,
     [](DoctoredLog* log) {
       log->Drop<sensors_t>(Topic::kSensors, "", [](const sensors_t& s) { return s.part == 0; });
     }},
    {"SensorsOfOneTickAbsent", true,
     [](DoctoredLog* log) {
       log->Drop<sensors_t>(Topic::kSensors, "",
                            [](const sensors_t& s) { return s.header.tick == kLater; });
     }},

    // What modules reported.
    {"StatusOfOneModuleAbsent", true,
     [](DoctoredLog* log) { log->DropChannels(Topic::kStatus, kModule); }},
    {"LastStatusAbsent", true,
     [](DoctoredLog* log) {
       int64_t last = 0;
       EveryStatus(log, [&last](status_t* s) { last = s->header.sequence; });
       log->Drop<status_t>(Topic::kStatus, kModule,
                           [last](const status_t& s) { return s.header.sequence == last; });
     }},
    {"RoleRenamed", false,
     [](DoctoredLog* log) {
       EveryStatus(log, [](status_t* s) {
         if (!s->role_name.empty()) s->role_name = "Somebody";
       });
     }},
    {"RoleTakenLater", false,
     [](DoctoredLog* log) {
       EveryStatus(log, [](status_t* s) {
         if (s->header.tick >= 40) return;
         s->role = -1;
         s->role_name.clear();
         s->labels.clear();
         s->num_labels = 0;
       });
     }},
    {"RoleFrozen", false,
     [](DoctoredLog* log) {
       EveryStatus(log, [](status_t* s) {
         if (s->header.tick >= kLater) s->frozen = 1;
       });
     }},
    {"OneLabelUnresolved", false,
     [](DoctoredLog* log) {
       EveryStatus(log, [](status_t* s) {
         if (s->labels.empty()) return;
         s->labels.pop_back();
         --s->num_labels;
       });
     }},
    {"LabelOfAnotherJoint", false,
     [](DoctoredLog* log) {
       EveryStatus(log, [](status_t* s) {
         for (label_t& label : s->labels) {
           if (label.kind == label_t::KIND_JOINT)
             label.index = static_cast<int8_t>(1 - label.index);
         }
       });
     }},
    {"ConventionFlipped", false,
     [](DoctoredLog* log) {
       EveryStatus(log, [](status_t* s) {
         for (int8_t& sign : s->joint_sign) sign = static_cast<int8_t>(-sign);
       });
     }},

    // Where the bodies were.
    {"WorldAbsent", true, [](DoctoredLog* log) { log->DropChannels(Topic::kWorld, ""); }},
    {"WorldAbsentAndNotPromised", false,
     [](DoctoredLog* log) {
       log->DropChannels(Topic::kWorld, "");
       log->Change<sim_clock_t>(Topic::kClock, "", [](sim_clock_t* c) { c->num_world_parts = 0; });
     }},
    {"OnePartOfWorldAbsent", true,
     [](DoctoredLog* log) {
       log->Drop<world_t>(Topic::kWorld, "", [](const world_t& w) { return w.part == 1; });
     }},
    {"OneBodyNeverInWorld", false,
     [](DoctoredLog* log) {
       log->Change<world_t>(Topic::kWorld, "", [](world_t* w) {
         if (w->part != 0) return;
         w->bodies.pop_back();
         --w->num_bodies;
       });
     }},
    {"WorldEndsHalfWay", true, [](DoctoredLog* log) { DropRest<world_t>(log, Topic::kWorld, ""); }},
    {"BodyMoved", false,
     [](DoctoredLog* log) { Body(log, [](body_pose_t* b) { b->position_m[1] += 0.005; }); }},
    {"BodyTurned", false,
     [](DoctoredLog* log) {
       Body(log, [](body_pose_t* b) {
         const double* w = b->orientation_wxyz;
         const Eigen::Quaterniond q = Eigen::Quaterniond(w[0], w[1], w[2], w[3]) *
                                      Eigen::AngleAxisd(2 * kDegree, Eigen::Vector3d::UnitX());
         const double turned[4] = {q.w(), q.x(), q.y(), q.z()};
         std::copy(turned, turned + 4, b->orientation_wxyz);
       });
     }},
    {"BodyAbsentForASecond", false,
     [](DoctoredLog* log) {
       log->Change<world_t>(Topic::kWorld, "", [](world_t* w) {
         if (!InOneSecond(w->header) || w->part != 0) return;
         w->bodies.pop_back();
         --w->num_bodies;
       });
     }},

    // When it was, and how it ended.
    {"ClockOfOneTickAbsent", true,
     [](DoctoredLog* log) {
       log->Drop<sim_clock_t>(Topic::kClock, "",
                              [](const sim_clock_t& c) { return c.header.tick == kLater; });
     }},
    {"LastClockAbsent", true,
     [](DoctoredLog* log) {
       log->Drop<sim_clock_t>(Topic::kClock, "", [](const sim_clock_t& c) {
         return c.phase == sim_clock_t::PHASE_END;
       });
     }},
    {"ClockCountsAnotherModule", true,
     [](DoctoredLog* log) {
       log->Change<sim_clock_t>(Topic::kClock, "", [](sim_clock_t* c) { ++c->num_modules; });
     }},
    {"ClockPromisesAnotherPart", true,
     [](DoctoredLog* log) {
       log->Change<sim_clock_t>(Topic::kClock, "", [](sim_clock_t* c) { ++c->num_world_parts; });
     }},
    {"ClockChangesItsMind", true,
     [](DoctoredLog* log) {
       log->Change<sim_clock_t>(Topic::kClock, "",
                                AtTick<sim_clock_t>([](sim_clock_t* c) { c->tick_us = 10'000; }));
     }},
    {"ModuleSilentAltogether", true,
     [](DoctoredLog* log) {
       for (const Topic topic : {Topic::kTransform, Topic::kActuator, Topic::kStatus}) {
         log->DropChannels(topic, kModule);
       }
     }},
    {"LastSecondAbsent", true,
     [](DoctoredLog* log) {
       const auto late = [](const auto& message) { return message.header.tick >= kWalkTicks - 50; };
       log->Drop<sim_clock_t>(Topic::kClock, "", late);
       log->Drop<sensors_t>(Topic::kSensors, "", late);
       log->Drop<world_t>(Topic::kWorld, "", late);
       for (const char* module : {"m1", "m2", "m3", "m4", "m5", "m6", "m7", "m8", "m9"}) {
         log->Drop<transform_t>(Topic::kTransform, module, late);
         log->Drop<actuator_t>(Topic::kActuator, module, late);
         log->Drop<status_t>(Topic::kStatus, module, late);
       }
     }},
    {"EndCountsFewerTicks", true,
     [](DoctoredLog* log) { log->ChangeEnd([](log_end_t* end) { end->num_ticks = 5; }); }},
    {"EndCountsNoTicks", true,
     [](DoctoredLog* log) { log->ChangeEnd([](log_end_t* end) { end->num_ticks = 0; }); }},
    {"EndCountsMoreTicks", true,
     [](DoctoredLog* log) { log->ChangeEnd([](log_end_t* end) { end->num_ticks += 1; }); }},
    {"EndOfARunThatDidNotEndAsPlanned", false,
     [](DoctoredLog* log) { log->ChangeEnd([](log_end_t* end) { end->clean = 0; }); }},
    {"EndOfAnotherRun", true,
     [](DoctoredLog* log) { log->ChangeEnd([](log_end_t* end) { end->run = "other"; }); }},
    {"EndAbsent", true, [](DoctoredLog* log) { log->DropChannels(Topic::kEnd, ""); }},
    {"DescriptionAbsent", false, [](DoctoredLog* log) { log->DropChannels(Topic::kInfo, ""); }},
    {"TimeShiftedInOneMessage", true,
     [](DoctoredLog* log) {
       Transform(log, [](transform_t* t) { t->header.sim_time_us += 20'000; });
     }},
    {"TickChangedInOneMessage", true,
     [](DoctoredLog* log) { Actuator(log, [](actuator_t* a) { ++a->header.tick; }); }},
    {"AnotherModelInOneMessage", true,
     [](DoctoredLog* log) { Transform(log, [](transform_t* t) { ++t->header.model_hash; }); }},
};

class DoctoredLogTest : public ::testing::TestWithParam<Way> {};

TEST_P(DoctoredLogTest, IsNeverEquivalent) {
  DoctoredLog doctored(walk->path);
  GetParam().alter(&doctored);
  const TempFile file;
  doctored.Write(file.path());
  const RunLog log = Load(file.path());
  const Comparison comparison = Compare(*walk->log, log);
  EXPECT_NE(comparison.verdict, Verdict::kEquivalent) << ComparisonText(comparison, true);
  EXPECT_NE(Compare(log, *walk->log).verdict, Verdict::kEquivalent);
  if (!GetParam().lacks) return;
  EXPECT_FALSE(log.facts.whole()) << VerifyText(log.facts);
  EXPECT_EQ(Compare(log, log).verdict, Verdict::kUnusable);
}

INSTANTIATE_TEST_SUITE_P(AnyWay, DoctoredLogTest, ::testing::ValuesIn(kWays),
                         [](const auto& way) { return std::string(way.param.name); });

}  // namespace
}  // namespace morphbus::logger
