#pragma once
// The notes behind the part of an image that runs: names and source lines, for people.

#include <cstdint>

#include "vm/image/program.h"
#include "vm/image/verify_error.h"

namespace morphbus::vm {

/// Where the lines begin in an image's notes (bytes), and how many there are; source lines of code,
/// which faults name.
struct NoteLines {
  uint32_t begin = 0;
  uint32_t count = 0;
};

/// Checks the notes of a program that is sound otherwise, which fill its bytes from run_size() to
/// `total`: they are those that the header names, so that nobody is told the lines of another
/// program, and their names and lines are whole and as many as the program needs. There may be
/// none; where a build holds no notes there must be none. False after it has noted an error.
bool CheckNotes(const VerifiedProgram& program, uint32_t total, NoteLines* lines,
                FirstError* error);

}  // namespace morphbus::vm
