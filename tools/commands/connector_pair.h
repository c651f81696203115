#pragma once
// The pair of connectors that `connections --pair` and `--why` name, and the connections that have
// it.

#include <string>
#include <vector>

#include "compiler/base/result.h"
#include "compiler/model/robot_model.h"

namespace morphbus::tools {

/// A pair as it was written, by names that may not exist in any module.
struct PairText {
  std::string option;  ///< "--pair" or "--why", for messages.
  /// The connector of member a of the connection, which is written first.
  std::string a;
  /// The connector of member b.
  std::string b;
};

/// Reads "c1,c4"; white space round the names does not matter. `option` is the option that the text
/// belongs to. Fails, with the form that is expected, unless there are exactly two names.
Result<PairText> ParsePair(const std::string& option, const std::string& text);

/// A connection and two connectors of its members.
struct ConnectorPair {
  size_t connection = 0;  ///< Index into Model::connection_types.
  /// Index of member a's connector in its module type.
  int a = 0;
  /// Index of member b's connector in its module type.
  int b = 0;
};

/// The pair in each connection that has it: in the one called `connection` if that is not empty,
/// else in any. A success holds at least one pair, in the model's order. The error says which name
/// is unknown, with the nearest one, or that the two names are in the wrong order.
Result<std::vector<ConnectorPair>> FindPairs(const model::Model& model,
                                             const std::string& connection, const PairText& pair);

}  // namespace morphbus::tools
