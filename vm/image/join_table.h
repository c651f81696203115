#pragma once
// The targets of jumps, of which an image states what holds there; so code can be checked in one
// pass, without following a jump.

#include <cstdint>

#include "vm/image/code_state.h"
#include "vm/image/image.h"
#include "vm/image/program.h"
#include "vm/image/verify_error.h"

namespace morphbus::vm {

/// The joins of an image, in the order of the code. Its sections must be sound; what CheckJoins
/// finds out must hold where states are asked for.
class JoinTable {
 public:
  explicit JoinTable(const uint8_t* image);
  /// How many joins there are.
  [[nodiscard]] uint32_t count() const { return joins_.count; }
  /// The byte of the image at which the record of join i stands.
  [[nodiscard]] uint32_t place(uint32_t i) const { return joins_.begin + i * image::kJoinBytes; }
  /// The byte of the image to which jumps to join i lead.
  [[nodiscard]] uint32_t target(uint32_t i) const {
    return code_begin_ + image::ReadU16(image_ + place(i));
  }
  /// The first join whose target is that byte of the image or lies behind it; count() if there is
  /// none. Found by halving.
  [[nodiscard]] uint32_t FirstFrom(uint32_t byte) const;
  /// What the image states of join i: a bit for each local that has been set, and the types on the
  /// stack, 4 bits each, the deepest in the lowest bits, 0 above the top.
  [[nodiscard]] uint16_t set_locals(uint32_t i) const { return image::ReadU16(StateOf(i)); }
  [[nodiscard]] uint32_t stack_types(uint32_t i) const { return image::ReadU32(StateOf(i) + 2); }
  /// The same as a state, with which the code goes on.
  [[nodiscard]] CodeState StateAt(uint32_t i) const;
  /// Why what arrives at join i does not fit what the image states there; nullptr if it does. A
  /// statement may promise less than what arrives, never more.
  [[nodiscard]] const char* ProblemOf(uint32_t i, const CodeState& arriving) const;

 private:
  /// The record of the state that join i names; joins that state the same share one.
  [[nodiscard]] const uint8_t* StateOf(uint32_t i) const;

  const uint8_t* image_;
  image::SectionRange joins_;
  uint32_t states_begin_, code_begin_;
};

/// Checks that all joins name states, are sorted by their targets, and that the types of states lie
/// on the stack from its bottom up. Whether targets are instructions is found with the code.
bool CheckJoins(const VerifiedProgram& program, FirstError* error);

}  // namespace morphbus::vm
