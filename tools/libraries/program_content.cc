#include "tools/libraries/program_content.h"

#include <fmt/format.h>

#include <utility>

#include "vm/image/verifier.h"

namespace morphbus {

Program::Content::Content(std::string the_image) : image(std::move(the_image)) {
  const vm::VerifyError error =
      vm::Verifier::Verify(reinterpret_cast<const uint8_t*>(image.data()),
                           static_cast<uint32_t>(image.size()), &verified);
  if (error.message != nullptr) {
    throw Failure(
        fmt::format("the program image is damaged: {} (byte {})", error.message, error.offset));
  }
}

}  // namespace morphbus
