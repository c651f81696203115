#pragma once
// One well-filled message of every type that travels, encoded.

#include <cstdint>
#include <string>
#include <vector>

#include "compiler/base/result.h"

namespace morphbus::bridge {

struct SampleMessage {
  std::string type;
  std::vector<uint8_t> bytes;
  /// Decodes with all checks; the decoded struct encoded again.
  Result<std::vector<uint8_t>> (*recode)(const uint8_t* data, size_t size) = nullptr;
};

std::vector<SampleMessage> SampleMessages();

}  // namespace morphbus::bridge
