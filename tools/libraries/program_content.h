#pragma once
// What is inside the programs of the library dynarole, for the libraries above it.

#include <morphbus/dynarole/program.h>

#include <string>

#include "vm/image/program.h"

namespace morphbus {

/// An image and its verified form, which refers to it.
class MORPHBUS_HIDDEN Program::Content {
 public:
  /// Throws Failure where the verifier refuses the image.
  explicit Content(std::string image);
  /// A copy would refer to the original's bytes.
  Content(const Content&) = delete;
  Content& operator=(const Content&) = delete;

  std::string image;
  vm::VerifiedProgram verified;
};

}  // namespace morphbus
