// Sensors of a module type.

#include <fmt/format.h>

#include "compiler/m3l/check_module.h"
#include "compiler/m3l/evaluate.h"

namespace morphbus::m3l::internal {
namespace {

using Eigen::Vector3d;

// Sensors of one module; their readings travel in every SENSORS message.
constexpr size_t kMaxSensors = 12;

/// Checks one sensor: its type, where it sits and looks, its range and noise.
class SensorChecker {
 public:
  SensorChecker(ModuleScope& scope, const SensorDecl& decl)
      : scope_(scope),
        decl_(decl),
        attributes_(decl, "sensor '" + decl.name.text + "'",
                    {"type", "link", "origin", "direction", "range", "noise"}, &scope.diagnostics) {
  }

  void Check() {
    // Each attribute is checked whatever the others are like, so that all errors are found; only a
    // sensor without any is taken over.
    const int errors = scope_.diagnostics.error_count();
    model::Sensor sensor;
    sensor.name = decl_.name.text;
    const bool typed = CheckType(sensor);
    CheckLink(sensor);
    CheckPlace(sensor);
    if (typed) CheckRange(sensor);
    if (typed) CheckNoise(sensor);
    if (errors == scope_.diagnostics.error_count() && !decl_.broken) {
      scope_.module.type.sensors.push_back(std::move(sensor));
    }
  }

 private:
  bool CheckType(model::Sensor& sensor) {
    const Expr* expr = attributes_.Required("type", "types are distance, contact and tilt");
    if (!expr) return false;
    // The type may be written as a name or in quotes.
    const std::string name = expr->kind == ExprKind::kString ? expr->text : SingleName(*expr);
    const std::optional<model::SensorType> type = model::SensorTypeNamed(name);
    if (!type) {
      scope_.diagnostics.Error(expr->span, "unknown type of sensor").hint =
          NameHint(name, {std::begin(model::kSensorTypeNames), std::end(model::kSensorTypeNames)},
                   "types are");
      return false;
    }
    sensor.type = *type;
    return true;
  }

  /// The link that carries it.
  void CheckLink(model::Sensor& sensor) {
    const Expr* expr = attributes_.Required("link", "name the link that carries it: link=NAME");
    if (!expr) return;
    // A sensor is rigid with one link, by which its place is known at all joint values.
    const std::string name = SingleName(*expr);
    if (const std::optional<int> link = scope_.module.type.FindLink(name)) {
      sensor.link = *link;
    } else if (!scope_.names_lost) {
      scope_.diagnostics.Error(expr->span, "there is no link '" + name + "'").hint =
          NameHint(name, NamesOf(scope_.module.type.links), "links are");
    }
  }

  void CheckPlace(model::Sensor& sensor) {
    if (const Expr* expr = attributes_.Required("origin", "write origin=(x, y, z)")) {
      sensor.p_MoSo_M = EvaluatePoint(*expr, "origin", scope_).value_or(Vector3d::Zero());
    }
    const Expr* expr = attributes_.Required("direction", "write direction=(x, y, z)");
    const auto direction =
        expr ? EvaluateVector(*expr, "direction", &scope_.diagnostics) : std::nullopt;
    if (!direction) return;
    // Coordinates of any size are allowed here, so that the norm must not overflow.
    if (direction->stableNorm() > 1e-12) {
      sensor.direction = direction->stableNormalized();
    } else {
      scope_.diagnostics.Error(expr->span, attributes_.what() + " has a direction of length zero");
    }
  }

  /// How far it sees: needed for a distance, allowed for a contact.
  void CheckRange(model::Sensor& sensor) {
    if (sensor.type == model::SensorType::kTilt) return RefuseFor("range", sensor);
    const Expr* expr = sensor.type == model::SensorType::kDistance
                           ? attributes_.Required("range", "say how far it sees: range=0.5")
                           : attributes_.Optional("range");
    if (expr == nullptr) return;
    CheckNumber(model::AttributeNamed<model::Sensor>("range"), scope_, &attributes_, &sensor);
  }

  /// The standard deviation of a reading: model units, or radians.
  void CheckNoise(model::Sensor& sensor) {
    if (sensor.type == model::SensorType::kContact) return RefuseFor("noise", sensor);
    CheckNumber(model::AttributeNamed<model::Sensor>("noise"), scope_, &attributes_, &sensor);
  }

  void RefuseFor(const std::string& key, const model::Sensor& sensor) {
    // A key that means nothing for the type is a slip in one of the two.
    const Attribute* attribute = decl_.Find(key);
    if (attribute == nullptr) return;
    scope_.diagnostics.Error(attribute->key.span, fmt::format("a {} sensor has no {}",
                                                              SensorTypeName(sensor.type), key));
  }

  ModuleScope& scope_;
  const SensorDecl& decl_;
  AttributeReader attributes_;
};

}  // namespace

void CheckSensors(ModuleScope& scope) {
  const std::vector<SensorDecl>& sensors = scope.module.decl->sensors;
  // All are checked before their number is, so that the first ones have their errors told.
  for (const SensorDecl& sensor : sensors) SensorChecker(scope, sensor).Check();
  if (sensors.size() <= kMaxSensors) return;
  scope.diagnostics.Error(sensors[kMaxSensors].name.span,
                          fmt::format("a module has at most {} sensors", kMaxSensors));
}

}  // namespace morphbus::m3l::internal
