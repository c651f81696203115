#pragma once
// The tables of an image whose records have one size, and the texts that they name. Each function
// returns false after it has noted an error, which is at the record that is wrong.

#include <cstdint>

#include "vm/image/image.h"
#include "vm/image/program.h"
#include "vm/image/verify_error.h"

namespace morphbus::vm {

/// A text lies within these strings, and has no control characters, as texts are printed to
/// terminals and logs. `offset` and `size` are its place in them (bytes), `at` is its record.
bool CheckText(const VerifiedProgram& program, image::SectionRange strings, uint32_t offset,
               uint32_t size, uint32_t at, FirstError* error);
/// The text record at `at` is that of a name, which is not empty.
bool CheckName(const VerifiedProgram& program, uint32_t at, FirstError* error);
/// Keywords are of known kinds and have names.
bool CheckKeywords(const VerifiedProgram& program, FirstError* error);
/// Constants are values of their types; the places of values in texts are sound.
bool CheckConstants(const VerifiedProgram& program, FirstError* error);
/// Signatures and types of locals are known, and the code of each function begins where that of the
/// one before it ends.
bool CheckFunctions(const VerifiedProgram& program, FirstError* error);

}  // namespace morphbus::vm
