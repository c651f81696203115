#include "vm/image/verify_error.h"

namespace morphbus::vm {

// An error that follows from the first one would only hide it.
bool FirstError::Note(const char* message, uint32_t offset) {
  if (error_.message == nullptr) error_ = {message, offset};
  return false;
}

bool FirstError::Refuse(uint32_t offset) { return Note(Reason(""), offset); }

}  // namespace morphbus::vm
