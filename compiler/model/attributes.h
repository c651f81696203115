#pragma once
// The numeric attributes of links, joints and sensors: what they measure and which values they may
// have. The M3L checker reads them by this table, and settings of a run (`run --set`) change them
// by it.

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "compiler/base/result.h"
#include "compiler/model/robot_model.h"

namespace morphbus::model {

/// What an attribute measures. Where it stands in a part decides with it which unit its numbers
/// have: a joint that slides has metres where one that turns has radians.
enum class Measure {
  kEffort,    ///< N·m, or N of a slide.
  kSpeed,     ///< rad/s, or m/s of a slide.
  kTravel,    ///< Of a joint or a reading: rad, or a length.
  kTime,      ///< Seconds.
  kMass,      ///< kg.
  kRatio,     ///< A number without a unit.
  kFraction,  ///< A share, which people also write as a percentage.
};

/// How the numbers of an attribute are written in M3L, and so in settings.
struct Unit {
  /// "N·m"; "" for a number without one. A length is written in units of its module.
  std::string name;
  /// The SI value of 1 as it is written: metres per model unit for a length, else 1.
  double si = 1.0;
  /// Whether it may be written in degrees.
  bool angle = false;
};

/// A numeric attribute of links, joints or sensors (`Part`). Values are SI.
template <class Part>
struct NumericAttribute {
  /// Its name in M3L; limits, which M3L writes as an interval, are `lower` and `upper` here.
  std::string_view name;
  Measure measure = Measure::kRatio;
  double least = 0.0;
  double most = 0.0;
  /// The value that a part has; nothing where it has none of its own.
  std::optional<double> (*get)(const Part& part) = nullptr;
  void (*set)(Part* part, double value) = nullptr;
  /// Whether parts like this one have it: a contact sensor has no noise.
  bool (*fits)(const Part& part) = nullptr;
  /// Whether `least` itself is too little.
  bool above_least = false;

  /// Whether it may have this value.
  [[nodiscard]] bool Allows(double value) const {
    return (above_least ? value > least : value >= least) && value <= most;
  }
};

/// The attributes of links, of joints and of sensors, in the order in which they are listed.
template <class Part>
std::span<const NumericAttribute<Part>> NumericAttributes();
template <>
std::span<const NumericAttribute<Link>> NumericAttributes<Link>();
template <>
std::span<const NumericAttribute<Joint>> NumericAttributes<Joint>();
template <>
std::span<const NumericAttribute<Sensor>> NumericAttributes<Sensor>();

/// The attribute called `name`, which there must be (checked).
template <class Part>
const NumericAttribute<Part>& AttributeNamed(std::string_view name);

/// How a measure of this part is written in a module whose unit is `unit_m` metres.
Unit UnitOf(Measure measure, const Link& link, double unit_m);
Unit UnitOf(Measure measure, const Joint& joint, double unit_m);
Unit UnitOf(Measure measure, const Sensor& sensor, double unit_m);

/// The range for people, in SI: "from 1e-9 to 1e9 N·m", "above 0 and at most 1e9 kg".
template <class Part>
std::string RangeText(const NumericAttribute<Part>& attribute, const Part& part);

/// Why limits cannot be these: out of the range of `lower` and `upper`, or too far apart. "" if
/// they can. That they are in order is not asked here.
std::string WhyNoLimits(double lower, double upper);

/// Whether a start value keeps the joint's limits; it may be off them by 1e-4 (rad or m), for
/// rounding.
bool KeepsLimits(const Joint& joint, double start);

/// One number of a model that a setting can change.
struct SettableAttribute {
  /// "MTRAN.joint_1.torque": module type, part, attribute.
  std::string name;
  /// The unit of the numbers below, as it is written.
  std::string unit;
  /// What it is now; nothing where the part has no value of its own.
  std::optional<double> value;
  double least = 0.0;
  double most = 0.0;
};
/// All that can be set, by module types, and in each its links, joints and sensors in their order.
std::vector<SettableAttribute> SettableAttributes(const Model& model);

/// Sets `name`, TYPE.PART.ATTRIBUTE, of all modules of a type. `value` is a number as M3L has it,
/// in degrees with `deg` behind it, a time also in `ms`, a fraction also in `%`. Fails, in one
/// sentence, if there is no such attribute, or it cannot have this value; the model then stays as
/// it is.
Result<void> SetAttribute(Model* model, std::string_view name, std::string_view value);

}  // namespace morphbus::model
