#include "vm/image/verify_error.h"

namespace morphbus::vm {

bool FirstError::Note(const char* message, uint32_t offset) {
  if (error_.message == nullptr) error_ = {message, offset};
  return false;
}

bool FirstError::Refuse(uint32_t offset) { return Note(Reason(""), offset); }

}  // namespace morphbus::vm
