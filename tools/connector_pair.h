#pragma once
// The pair of connectors that `connections --pair` and `--why` name, and the connections that have
// it.

#include <string>
#include <vector>

#include "compiler/model/robot_model.h"
#include "compiler/source/result.h"

namespace morphbus::tools {

/// A pair as it was written: member a's connector first.
struct PairText {
  std::string option;  ///< "--pair" or "--why", for messages.
  std::string a;
  std::string b;
};

/// Reads "c1,c4"; white space round the names does not matter.
Result<PairText> ParsePair(const std::string& option, const std::string& text);

/// A connection and two connectors of its members.
struct ConnectorPair {
  size_t connection = 0;  ///< Index into Model::connection_types.
  int a = 0;
  int b = 0;
};

/// The pair in each connection that has it: in the one called `connection` if that is not empty,
/// else in any. At least one, or the reason why there is none.
Result<std::vector<ConnectorPair>> FindPairs(const model::Model& model,
                                             const std::string& connection, const PairText& pair);

}  // namespace morphbus::tools
