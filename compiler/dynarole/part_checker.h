#pragma once
// Parts of the module, by the keywords of the module types that a program is compiled for: joints,
// links, connectors with their state variables, sensors.

#include "compiler/dynarole/conversions.h"
#include "compiler/keywords/keyword_table.h"

namespace morphbus::dynarole {

/// Finds the types and meanings of what names a part. Functions called Infer... return the type;
/// `call` is null where a member stands without parentheses.
class PartChecker {
 public:
  /// All arguments must outlive it.
  PartChecker(const keywords::KeywordTable& keywords, ProgramModel* model, Scope* scope,
              Conversions* conversions, CheckPass* pass)
      : keywords_(keywords),
        model_(*model),
        scope_(*scope),
        conversions_(*conversions),
        pass_(*pass) {}

  /// Makes the expression mean the keyword of that index in the table. The program needs this part,
  /// so that modules without it do not take the role.
  Type UseKeyword(Expr* expr, int keyword);
  /// For self.distance, contact and tilt, of which `expr` is the call: the keyword of the kind of
  /// sensor that they need.
  Type UseSensorKind(Expr* expr, const source::Span& span);
  /// `self.NAME`, which is nothing that is built in and no function.
  Type InferOfSelf(Expr* member, Expr* call);
  /// The keyword of the sensor that `base`, as `self.NAME`, names and nothing else; -1: none. A
  /// sensor is no value, so that its name is looked at before it is one.
  [[nodiscard]] int FindSensor(const Expr& base) const;
  /// `self.SENSOR.GET_DISTANCE()`, where `keyword` is the sensor's. What a sensor is asked must be
  /// what it measures in some module type.
  Type InferSensor(Expr* member, Expr* call, int keyword);
  /// `CONNECTOR.SET_EXTENDED(true)`: a state variable.
  Type InferConnectorState(Expr* member, Expr* call);

 private:
  const keywords::KeywordTable& keywords_;
  ProgramModel& model_;
  Scope& scope_;
  Conversions& conversions_;
  CheckPass& pass_;
  bool listed_self_ = false;  ///< A hint has listed all that `self` has.
};

}  // namespace morphbus::dynarole
