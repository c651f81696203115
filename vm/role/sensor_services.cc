// What the module's sensors tell its program.

#include <cmath>

#include "vm/role/module_services.h"
#include "vm/run/mathematics.h"
#include "vm/space/spatial.h"

namespace morphbus::vm {

namespace {

/// A reading as programs take it: millimetres of a distance, 0 or 1 of a contact, and of a tilt the
/// degrees between the sensor's direction and straight up.
float ValueOf(const Context& context, int sensor) {
  const KinSensor& s = context.kinematics.sensor(sensor);
  const float* values = context.state.sensor_values + s.first_value;
  switch (s.kind) {
    case SensorKind::kDistance:
      return values[0] * 1000.0f;
    case SensorKind::kContact:
      return values[0];
    case SensorKind::kTilt:
      break;
  }
  const Vec3 up{values[0], values[1], values[2]};
  const Vec3 across = Cross(s.direction, up);
  return Mathematics(Opcode::kAtan2, Norm(across), Dot(s.direction, up));
}

}  // namespace

OpResult ModuleServices::SensorTowards(SensorKind kind, int keyword, Direction d, float* value) {
  const Vec3 wanted = UnitOf(d);
  float best = 0;
  bool found = false;
  for (int i = 0; context_.state.pose.has && i < context_.kinematics.num_sensors(); ++i) {
    if (context_.kinematics.sensor(i).kind != kind) continue;
    // All look towards $ANY.
    const float along = d == Direction::kAny ? 1.0f : Dot(SensorDirection(context_, i), wanted);
    if (!LeadsTowards(along, 1.0f)) continue;
    const float reading = ValueOf(context_, i);
    if (kind == SensorKind::kContact) {
      // Any touch counts.
      *value = found && *value > reading ? *value : reading;
    } else if (!found || along > best) {
      *value = reading;
      best = along;
    }
    found = true;
  }
  if (found) return {};
  return Refuse({.code = FaultCode::kNoSensorThere,
                 .keyword = static_cast<int16_t>(keyword),
                 .direction_R = wanted});
}

OpResult ModuleServices::Tilt(Axis axis, float* degrees) {
  // The role is held only by types that have a tilt sensor: its keyword says so.
  for (int i = 0; i < context_.kinematics.num_sensors(); ++i) {
    const KinSensor& s = context_.kinematics.sensor(i);
    if (s.kind != SensorKind::kTilt) continue;
    const float* values = context_.state.sensor_values + s.first_value;
    // Straight up as R sees it. Were R level, that would be R's own up; the turn about the axis
    // from the one to the other, reversed, is how far R is turned.
    const Vec3 up_R = Rotate(context_.state.pose.X_RL[s.link].q, {values[0], values[1], values[2]});
    const Vec3 up = UnitOf(Direction::kUp);
    const Vec3 a = UnitOf(axis);
    // What lies along the axis is not changed by a turn about it.
    const Vec3 from = Subtract(up_R, Scale(Dot(up_R, a), a));
    const Vec3 to = Subtract(up, Scale(Dot(up, a), a));
    *degrees = Mathematics(Opcode::kAtan2, Dot(Cross(from, to), a), Dot(from, to));
    return {};
  }
  return Refuse({.code = FaultCode::kNoSensorThere});
}

OpResult ModuleServices::SensorReading(SensorKind kind, int keyword, float* value) {
  const int sensor = Keyword(keyword);
  if (sensor < 0) {
    return Refuse({.code = FaultCode::kMissingKeyword, .keyword = static_cast<int16_t>(keyword)});
  }
  // One name may stand for sensors of unlike kinds in two module types.
  if (context_.kinematics.sensor(sensor).kind != kind) {
    return Refuse({.code = FaultCode::kOtherSensor, .keyword = static_cast<int16_t>(keyword)});
  }
  *value = ValueOf(context_, sensor);
  return {};
}

}  // namespace morphbus::vm
