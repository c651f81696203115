#pragma once
// The keywords that a module type adds to the role language (paper, Sec. III B): its links, joints,
// connectors and their state variables, in capitals. The DynaRole compiler learns them from XML.

#include <string>
#include <vector>

#include "compiler/base/result.h"
#include "compiler/model/robot_model.h"

namespace morphbus::keywords {

/// A link.
struct LinkKeyword {
  std::string name;     ///< As in M3L: connecting_bar.
  std::string keyword;  ///< As programs write it, after $: LINK_CONNECTING_BAR.
};

/// A joint; its type says which calls fit it, in degrees or in millimetres.
struct JointKeyword {
  std::string name;     ///< joint_1
  std::string keyword;  ///< JOINT_1, after self.
  model::JointType type = model::JointType::kRevolute;
};

/// A state variable of a connector.
struct StateKeyword {
  std::string name;     ///< extended
  std::string keyword;  ///< EXTENDED, as in self.C1.SET_EXTENDED(true).
  /// What may be set, in M3L's order; {false, true} for [bool]. The index of a value is what is
  /// sent (connector_command_t).
  std::vector<model::AttributeValue> values;
};

/// A connector and what can be set of it.
struct ConnectorKeyword {
  std::string name;     ///< c1
  std::string keyword;  ///< C1, after self.
  /// Their keywords need to be unique within this connector only.
  std::vector<StateKeyword> states;
};

/// A sensor; its type says what asking it gives: metres, a bool or a direction.
struct SensorKeyword {
  std::string name;     ///< ir_c1
  std::string keyword;  ///< IR_C1, after self.
  model::SensorType type = model::SensorType::kDistance;
};

/// All keywords of a module type, in the order in which M3L declares the parts.
struct ModuleKeywords {
  /// The module type's name as M3L has it; it is no keyword.
  std::string type_name;
  std::vector<LinkKeyword> links;
  std::vector<JointKeyword> joints;
  std::vector<ConnectorKeyword> connectors;
  std::vector<SensorKeyword> sensors = {};
};

/// The keyword of a part that M3L calls `name`: in capitals, of a link with LINK_ before it.
std::string KeywordOf(const std::string& name, bool is_link);

/// The keywords of a module type. Fails where two names differ in case only, so that one keyword
/// would mean both ("links 'Bar' and 'bar' of module 'M' are both LINK_BAR").
Result<ModuleKeywords> KeywordsOf(const model::ModuleType& type);
/// The keywords of each of a model's module types, in their order. Fails as the function above, for
/// the first type in which keywords clash.
Result<std::vector<ModuleKeywords>> KeywordsOf(const model::Model& model);

}  // namespace morphbus::keywords
