#pragma once
// Why bytes were refused that were to be verified, and at which of them.

#include <cstdint>

#include "vm/limits.h"

namespace morphbus::vm {

/// Why an image was refused.
struct VerifyError {
  /// What is wrong, as a constant text; nullptr if the image was accepted.
  const char* message = nullptr;
  /// The byte of the image at which it was noticed.
  uint32_t offset = 0;
};

/// The text on a host. A microcontroller says only where an image is wrong: the same image refused
/// on a host says why, and sentences take flash.
constexpr const char* Reason(const char* text) { return kSmallProfile ? "refused" : text; }

/// Keeps the first error of a verification, which is the one that counts: later ones may follow
/// from it.
class FirstError {
 public:
  /// Notes an error at this byte of the image, unless one is noted already; returns false.
  bool Fail(const char* message, uint32_t offset) {
    if constexpr (kSmallProfile) return Refuse(offset);
    return Note(message, offset);
  }
  /// The error that was noted; without a message if there was none.
  [[nodiscard]] const VerifyError& error() const { return error_; }

 private:
  bool Note(const char* message, uint32_t offset);
  /// The same without a text, so that no caller on a microcontroller has to hand one over.
  bool Refuse(uint32_t offset);

  VerifyError error_;
};

}  // namespace morphbus::vm
