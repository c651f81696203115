#pragma once
// Turns untrusted bytes into a VerifiedProgram, once, in linear time.

#include <cstdint>

#include "vm/image/code_facts.h"
#include "vm/image/program.h"
#include "vm/image/role_tree.h"
#include "vm/image/verify_error.h"

namespace morphbus::vm {

/// One verification: runs the checks of each part in their order, and alone fills in a
/// VerifiedProgram.
class Verifier {
 public:
  /// Checks `bytes` (header, hash, every table, every instruction: jumps, stack depth, types,
  /// arity, bounded call depth, finite numbers) and fills `out`, which then refers to `bytes`. On
  /// error `out` is left empty (size() == 0).
  static VerifyError Verify(const uint8_t* bytes, uint32_t size, VerifiedProgram* out);

 private:
  Verifier(const uint8_t* bytes, uint32_t size, VerifiedProgram* out)
      : bytes_(bytes), size_(size), out_(*out) {}

  /// All steps in order. Each returns false after it has noted an error, and relies on what those
  /// before it have proved: tables before code, because code refers to them; calls behind it,
  /// because they need every function.
  bool Run();
  /// Magic, version, size, hash, and an instruction budget that lets programs run.
  bool CheckHeader();
  /// The sections follow each other without gaps and fill the image; where they are is known from
  /// here on.
  bool CheckSections();
  /// The table of roles, whose places are known from here on, and the tree that they make.
  bool CheckRoles();
  /// The joins, and each function's code between them.
  bool CheckCode();
  /// All calls; from here on it is known which keywords each role needs.
  bool CheckCalls();
  /// The notes behind the part that runs, if there are any.
  bool CheckNotes();

  const uint8_t* bytes_;
  uint32_t size_;
  /// What the checks of the parts read, as far as it has been proved.
  VerifiedProgram& out_;
  FirstError error_;
  RoleTree tree_;
  /// What each function's code needs and may do.
  CodeFacts facts_[kMaxFunctions];
};

}  // namespace morphbus::vm
