#include "logger/compare/quantities.h"

namespace morphbus::logger {
namespace {

using bridge::Topic;
using T = Tolerances;

/// The carrier of what is found in no one message.
constexpr std::nullopt_t kNoMessage = std::nullopt;

/// In the order of the enumeration.
constexpr QuantityInfo kQuantities[] = {
    {"role", "", Topic::kStatus, {{{"s", &T::role_s}}}},
    {"propagated position", "propagated", Topic::kTransform, {{{"m", &T::propagated_m}}}},
    {"propagated rotation", "propagated", Topic::kTransform, {{{"rad", &T::propagated_rad}}}},
    {"staleness", "propagated", Topic::kTransform},
    {"simulated position", "simulated", Topic::kWorld, {{{"m", &T::simulated_m}}}},
    {"simulated rotation", "simulated", Topic::kWorld, {{{"rad", &T::simulated_rad}}}},
    {"joint angle", "sensors", Topic::kSensors, {{{"rad", &T::angle_rad}}}},
    {"joint travel", "sensors", Topic::kSensors, {{{"m", &T::travel_m}}}},
    {"joint velocity",
     "sensors",
     Topic::kSensors,
     {{{"rad/s", &T::velocity_rad_s}, {"m/s", &T::velocity_m_s}}}},
    {"joint effort", "sensors", Topic::kSensors, {{{"N m", &T::effort_n_m}, {"N", &T::effort_n}}}},
    {"docking", "sensors", Topic::kSensors},
    {"command", "commands", Topic::kActuator, {{{"rad", &T::command_rad}, {"m", &T::command_m}}}},
    {"speed limit",
     "commands",
     Topic::kActuator,
     {{{"rad/s", &T::command_rad}, {"m/s", &T::command_m}}}},
    {"connector command", "commands", Topic::kActuator},
    {"rest position", "", kNoMessage, {{{"m", &T::propagated_m}}}},
    {"duration", "", kNoMessage},
    {"event", "commands", Topic::kActuator, {{{"s", &T::event_s}}}},
    {"drift in position", "simulated", Topic::kWorld, {{{"m", &T::drift_m}}}},
    {"drift in rotation", "simulated", Topic::kWorld, {{{"rad", &T::drift_rad}}}},
    {"gait cycle", "", kNoMessage, {{{"s", &T::cycle_s}}}},
    {"forward a cycle", "simulated", kNoMessage, {{{"m", &T::forward_m}}}},
    {"sideways a cycle", "simulated", kNoMessage, {{{"m", &T::sideways_m}}}},
    {"turn a cycle", "simulated", kNoMessage, {{{"rad", &T::turn_rad}}}},
    {"height", "simulated", kNoMessage, {{{"m", &T::height_m}}}},
    {"duty", "simulated", kNoMessage, {{{"share", &T::duty}}}},
    {"joint range", "sensors", kNoMessage, {{{"rad", &T::range_rad}, {"m", &T::range_m}}}},
    {"energy a cycle", "sensors", kNoMessage, {{{"share", &T::energy}}}},
    {"cost of transport", "simulated", kNoMessage, {{{"share", &T::transport}}}}};

}  // namespace

const QuantityInfo& InfoOf(Quantity quantity) { return kQuantities[static_cast<int>(quantity)]; }

}  // namespace morphbus::logger
