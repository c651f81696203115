#include "vm/image/fault.h"

namespace morphbus::vm {

const char* FaultName(FaultCode code) {
  static constexpr const char* kNames[kNumFaultCodes] = {
#define FAULT(name, short_text, sentence) short_text,
#include "vm/image/faults.def"
#undef FAULT
  };
  const auto index = static_cast<int>(code);
  return index < kNumFaultCodes ? kNames[index] : "unknown fault";
}

}  // namespace morphbus::vm
