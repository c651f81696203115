#include "compiler/base/version.h"

#include "version_text.h"

namespace morphbus {

const char* Version() { return MORPHBUS_VERSION_TEXT; }

}  // namespace morphbus
