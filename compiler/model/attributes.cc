#include "compiler/model/attributes.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "compiler/base/check.h"
#include "compiler/base/nearest_name.h"
#include "compiler/base/quantity.h"

namespace morphbus::model {
namespace {

/// What can be computed with: beyond it squares of distances lose the micrometres.
constexpr double kMostTravel = 1e6;
/// Of motors: so that what is computed of both (a damping) is finite in single precision, too.
constexpr double kLeastDrive = 1e-9;
constexpr double kMostDrive = 1e9;
constexpr double kMostMass_kg = 1e9;
constexpr double kMostSight = 1000.0;  // m, and for the noise of a tilt rad.
constexpr double kMostFriction = 10.0;
/// So that a link weighs something three standard deviations below the mean.
constexpr double kMostSpread = 0.3;
constexpr double kMostPlay = 1.0;  // rad or m
constexpr double kMostDelay_s = 1.0;

bool Always(const Link& /*link*/) { return true; }
bool HasMotor(const Joint& joint) { return joint.type != JointType::kFixed; }
bool HasLimits(const Joint& joint) {
  return joint.type == JointType::kRevolute || joint.type == JointType::kPrismatic;
}
bool HasRange(const Sensor& sensor) { return sensor.type != SensorType::kTilt; }
bool HasNoise(const Sensor& sensor) { return sensor.type != SensorType::kContact; }

/// Reads and writes a member of a part.
template <class Part, auto kMember>
std::optional<double> Get(const Part& part) {
  return part.*kMember;
}
template <class Part, auto kMember>
void Set(Part* part, double value) {
  part->*kMember = value;
}

/// A row of a table: the attribute that is kept in a member of the part.
template <class Part, auto kMember>
constexpr NumericAttribute<Part> Row(std::string_view name, Measure measure, double least,
                                     double most, bool (*fits)(const Part&)) {
  return {name, measure, least, most, Get<Part, kMember>, Set<Part, kMember>, fits, false};
}

/// The same where the least value is too little.
template <class Part>
constexpr NumericAttribute<Part> Above(NumericAttribute<Part> row) {
  row.above_least = true;
  return row;
}

constexpr std::array kLinkAttributes = {
    Above(Row<Link, &Link::mass_kg>("mass", Measure::kMass, 0.0, kMostMass_kg, Always)),
    Row<Link, &Link::friction>("friction", Measure::kRatio, 0.0, kMostFriction, Always),
    Row<Link, &Link::mass_spread>("mass_spread", Measure::kFraction, 0.0, kMostSpread, Always),
};

constexpr std::array kJointAttributes = {
    Row<Joint, &Joint::lower>("lower", Measure::kTravel, -kMostTravel, kMostTravel, HasLimits),
    Row<Joint, &Joint::upper>("upper", Measure::kTravel, -kMostTravel, kMostTravel, HasLimits),
    Row<Joint, &Joint::effort>("torque", Measure::kEffort, kLeastDrive, kMostDrive, HasMotor),
    Row<Joint, &Joint::speed>("speed", Measure::kSpeed, kLeastDrive, kMostDrive, HasMotor),
    Row<Joint, &Joint::backlash>("backlash", Measure::kTravel, 0.0, kMostPlay, HasMotor),
    Row<Joint, &Joint::delay_s>("delay", Measure::kTime, 0.0, kMostDelay_s, HasMotor),
};

constexpr std::array kSensorAttributes = {
    Row<Sensor, &Sensor::range_m>("range", Measure::kTravel, 1e-6, kMostSight, HasRange),
    Row<Sensor, &Sensor::noise>("noise", Measure::kTravel, 0.0, kMostSight, HasNoise),
};

/// The unit of a measure that is one of lengths or of angles.
Unit TravelUnit(bool is_length, double unit_m) {
  if (!is_length) return {.name = "rad", .angle = true};
  const std::string name = unit_m == 1.0 ? "m" : fmt::format("units of {} m", NumberText(unit_m));
  return {.name = name, .si = unit_m};
}

/// The unit of a measure that is the same in all parts, or of a part that slides or turns.
Unit UnitOf(Measure measure, bool slides, double unit_m) {
  const auto plain = [](const char* name) { return Unit{.name = name}; };
  switch (measure) {
    case Measure::kEffort:
      return plain(slides ? "N" : "N·m");
    case Measure::kSpeed:
      return {.name = slides ? "m/s" : "rad/s", .angle = !slides};
    case Measure::kTravel:
      return TravelUnit(slides, unit_m);
    case Measure::kTime:
      return plain("s");
    case Measure::kMass:
      return plain("kg");
    case Measure::kRatio:
    case Measure::kFraction:
      break;
  }
  return plain("");
}

/// A number as people write it, to 9 digits: 1e9 and not 1e+09 or 1000000000.
std::string ShortNumber(double value) {
  std::array<char, 32> digits = {};
  const double rounded = ReadNumber<double>(NumberText(value)).value_or(value);
  std::string text(digits.data(),
                   std::to_chars(digits.data(), digits.data() + digits.size(), rounded).ptr);
  const size_t e = text.find('e');
  if (e == std::string::npos) return text;
  // An exponent has a sign and two digits at least.
  if (text[e + 1] == '+') text.erase(e + 1, 1);
  const size_t first = text.find_first_not_of('-', e + 1);
  if (text[first] == '0') text.erase(first, 1);
  return text;
}

/// " N·m", or nothing for a number without a unit.
std::string Behind(const std::string& unit) { return unit.empty() ? "" : " " + unit; }

/// The numbers of a setting in the units that M3L has, as SI; nothing for another text.
std::optional<double> ReadValue(std::string_view text, Measure measure, const Unit& unit) {
  if (unit.angle) return ReadRadians(text);
  if (measure == Measure::kTime) return ReadSeconds(text);
  if (measure == Measure::kFraction) return ReadFraction(text);
  const std::optional<double> number = ReadPlainNumber(text);
  return number ? std::optional(*number * unit.si) : std::nullopt;
}

/// " (did you mean 'x'?)", or nothing if no name is near.
std::string Nearest(std::string_view name, const std::vector<std::string>& names) {
  const std::string nearest = NearestName(std::string(name), names);
  return nearest.empty() ? "" : fmt::format(" (did you mean '{}'?)", nearest);
}

template <class Items>
std::vector<std::string> Names(const Items& items) {
  std::vector<std::string> names;
  for (const auto& item : items) names.emplace_back(item.name);
  return names;
}

/// Calls `visit(part, kind)` for all parts of a type that have numeric attributes.
template <class Type, class Visit>
void ForEachPart(Type& type, const Visit& visit) {
  for (auto& link : type.links) visit(link, "link");
  for (auto& joint : type.joints) visit(joint, "joint");
  for (auto& sensor : type.sensors) visit(sensor, "sensor");
}

/// The attributes that a part has, by name.
template <class Part>
std::vector<const NumericAttribute<Part>*> AttributesOf(const Part& part) {
  std::vector<const NumericAttribute<Part>*> attributes;
  for (const NumericAttribute<Part>& attribute : NumericAttributes<Part>()) {
    if (attribute.fits(part)) attributes.push_back(&attribute);
  }
  return attributes;
}

/// The range of an attribute as it is written: "1e-9 to 1e9 N·m".
template <class Part>
std::string Expected(const NumericAttribute<Part>& attribute, const Unit& unit) {
  const std::string least = ShortNumber(attribute.least / unit.si);
  const std::string most = ShortNumber(attribute.most / unit.si) + Behind(unit.name);
  return attribute.above_least ? fmt::format("above {} and at most {}", least, most)
                               : fmt::format("{} to {}", least, most);
}

/// Sets one attribute of a part; what is wrong with the value, or "".
template <class Part>
std::string SetPart(const NumericAttribute<Part>& attribute, double unit_m, std::string_view value,
                    Part* part) {
  const Unit unit = UnitOf(attribute.measure, *part, unit_m);
  const std::optional<double> number = ReadValue(value, attribute.measure, unit);
  if (!number || !attribute.Allows(*number)) {
    return fmt::format("{}: expected {}{}, not '{}'", attribute.name, Expected(attribute, unit),
                       unit.angle ? ", or degrees with 'deg' behind them" : "", value);
  }
  attribute.set(part, *number);
  return "";
}

/// What is wrong with the limits of a joint, with the robots that have it; "" if nothing is.
std::string WhyBadLimits(const Model& model, int type_index, int joint_index) {
  const ModuleType& type = model.module_types[type_index];
  const Joint& joint = type.joints[joint_index];
  if (!HasLimits(joint)) return "";
  const double si = UnitOf(Measure::kTravel, joint, type.unit_m).si;
  const std::string limits =
      fmt::format("[{}, {}]", NumberText(joint.lower / si), NumberText(joint.upper / si));
  if (joint.lower > joint.upper) return "the limits " + limits + " are the wrong way round";
  if (const std::string why = WhyNoLimits(joint.lower, joint.upper); !why.empty()) return why;
  for (const Robot& robot : model.robots) {
    for (const ModuleInstance& module : robot.modules) {
      if (module.type != type_index) continue;
      const double start = module.start[joint_index];
      if (KeepsLimits(joint, start)) continue;
      return fmt::format("'{}.{}' of robot {} starts at {}, outside the limits {}", module.name,
                         joint.name, robot.name, NumberText(start / si), limits);
    }
  }
  return "";
}

/// The three names of an attribute.
struct AttributeName {
  std::string_view type, part, attribute;
};
std::optional<AttributeName> SplitName(std::string_view name) {
  const size_t first = name.find('.');
  const size_t second = first == std::string_view::npos ? first : name.find('.', first + 1);
  if (second == std::string_view::npos) return std::nullopt;
  const AttributeName split = {name.substr(0, first), name.substr(first + 1, second - first - 1),
                               name.substr(second + 1)};
  const bool whole = !split.type.empty() && !split.part.empty() && !split.attribute.empty() &&
                     split.attribute.find('.') == std::string_view::npos;
  return whole ? std::optional(split) : std::nullopt;
}

/// Sets an attribute of the part called so in a module type, if there is one.
Result<void> SetInType(const AttributeName& name, std::string_view value, ModuleType* type) {
  std::vector<std::string> parts;
  std::string error;
  bool found = false;
  ForEachPart(*type, [&](auto& part, const char* kind) {
    parts.push_back(part.name);
    if (part.name != name.part || found) return;
    found = true;
    std::vector<std::string> known;
    for (const auto* attribute : AttributesOf(part)) {
      if (attribute->name == name.attribute) {
        error = SetPart(*attribute, type->unit_m, value, &part);
        if (!error.empty()) error = fmt::format("{}.{}.{}", name.type, name.part, error);
        return;
      }
      known.emplace_back(attribute->name);
    }
    error =
        fmt::format("{} '{}' of {} has no attribute '{}' that can be set{}{}", kind, part.name,
                    type->name, name.attribute, Nearest(name.attribute, known),
                    known.empty() ? "" : "; it has " + fmt::format("{}", fmt::join(known, ", ")));
  });
  if (!found) {
    error = fmt::format("{} has no link, joint or sensor '{}'{}; it has {}", type->name, name.part,
                        Nearest(name.part, parts), fmt::join(parts, ", "));
  }
  return error.empty() ? Result<void>() : Fail(error);
}

}  // namespace

template <>
std::span<const NumericAttribute<Link>> NumericAttributes<Link>() {
  return kLinkAttributes;
}
template <>
std::span<const NumericAttribute<Joint>> NumericAttributes<Joint>() {
  return kJointAttributes;
}
template <>
std::span<const NumericAttribute<Sensor>> NumericAttributes<Sensor>() {
  return kSensorAttributes;
}

template <class Part>
const NumericAttribute<Part>& AttributeNamed(std::string_view name) {
  const auto all = NumericAttributes<Part>();
  const auto found =
      std::ranges::find_if(all, [&](const auto& attribute) { return attribute.name == name; });
  MORPHBUS_CHECK(found != all.end());
  return *found;
}
template const NumericAttribute<Link>& AttributeNamed<Link>(std::string_view name);
template const NumericAttribute<Joint>& AttributeNamed<Joint>(std::string_view name);
template const NumericAttribute<Sensor>& AttributeNamed<Sensor>(std::string_view name);

Unit UnitOf(Measure measure, const Link& /*link*/, double unit_m) {
  return UnitOf(measure, false, unit_m);
}
Unit UnitOf(Measure measure, const Joint& joint, double unit_m) {
  return UnitOf(measure, joint.type == JointType::kPrismatic, unit_m);
}
Unit UnitOf(Measure measure, const Sensor& sensor, double unit_m) {
  // What is not a tilt is measured in lengths.
  return UnitOf(measure, sensor.type != SensorType::kTilt, unit_m);
}

template <class Part>
std::string RangeText(const NumericAttribute<Part>& attribute, const Part& part) {
  const std::string text = Expected(attribute, UnitOf(attribute.measure, part, 1.0));
  return attribute.above_least ? text : "from " + text;
}
template std::string RangeText(const NumericAttribute<Link>& attribute, const Link& part);
template std::string RangeText(const NumericAttribute<Joint>& attribute, const Joint& part);
template std::string RangeText(const NumericAttribute<Sensor>& attribute, const Sensor& part);

std::string WhyNoLimits(double lower, double upper) {
  const bool fit = std::abs(lower) <= kMostTravel && std::abs(upper) <= kMostTravel &&
                   upper - lower <= kMostTravel;
  return fit ? "" : fmt::format("limits are at most {} rad or metres", ShortNumber(kMostTravel));
}

bool KeepsLimits(const Joint& joint, double start) {
  constexpr double kTolerance = 1e-4;
  return start >= joint.lower - kTolerance && start <= joint.upper + kTolerance;
}

std::vector<SettableAttribute> SettableAttributes(const Model& model) {
  std::vector<SettableAttribute> settable;
  for (const ModuleType& type : model.module_types) {
    ForEachPart(type, [&](const auto& part, const char* /*kind*/) {
      for (const auto* attribute : AttributesOf(part)) {
        const Unit unit = UnitOf(attribute->measure, part, type.unit_m);
        std::optional<double> value = attribute->get(part);
        if (value) *value /= unit.si;
        settable.push_back({fmt::format("{}.{}.{}", type.name, part.name, attribute->name),
                            unit.name, value, attribute->least / unit.si,
                            attribute->most / unit.si});
      }
    });
  }
  return settable;
}

Result<void> SetAttribute(Model* model, std::string_view name, std::string_view value) {
  const std::optional<AttributeName> split = SplitName(name);
  if (!split) {
    return Fail(fmt::format(
        "'{}' is no attribute: expected TYPE.PART.ATTRIBUTE, such as MTRAN.joint_1.torque", name));
  }
  const auto type = std::ranges::find_if(
      model->module_types, [&](const ModuleType& one) { return one.name == split->type; });
  if (type == model->module_types.end()) {
    const std::vector<std::string> types = Names(model->module_types);
    return Fail(fmt::format("the model has no module type '{}'{}; it has {}", split->type,
                            Nearest(split->type, types), fmt::join(types, ", ")));
  }
  // A value that does not fit the rest of the model is taken back.
  const ModuleType before = *type;
  if (Result<void> set = SetInType(*split, value, &*type); !set) return set;
  const int type_index = static_cast<int>(type - model->module_types.begin());
  for (int j = 0; j < std::ssize(type->joints); ++j) {
    if (type->joints[j].name != split->part) continue;
    const std::string why = WhyBadLimits(*model, type_index, j);
    if (why.empty()) break;
    *type = before;
    return Fail(fmt::format("{}: {}", name, why));
  }
  return {};
}

}  // namespace morphbus::model
