#pragma once
// Faults as sentences: the one place where they are worded, for every tool. Host side only.

#include <string>

#include "vm/image/fault.h"
#include "vm/image/kinematics_image.h"
#include "vm/image/program.h"

namespace morphbus::vm {

/// What the numbers in a fault refer to. A tool that lacks an image leaves it null; the sentence
/// then has numbers in place of names, and no units where they depend on the kind of joint.
struct FaultContext {
  const VerifiedProgram* program = nullptr;
  const VerifiedKinematics* kinematics = nullptr;
};

/// "startup", "behavior", "command" or "handler"; "task" for a kind of a newer version.
const char* TaskKindName(TaskKind kind);

/// What happened with all that a person needs to mend it: names, what was asked and measured, the
/// limit, and, where the fault has ended a task, what becomes of that. One sentence without a full
/// stop, e.g. "joint ANKLE was asked for 95° and goes to 90° at most". Never fails: indices that
/// the images do not have are printed as numbers.
std::string FaultSentence(const Fault& fault, const FaultContext& context);

/// The function in which the fault happened, e.g. "Knee.bend"; empty if in none, "function 3" if
/// there is no program to look it up in.
std::string FaultFunction(const Fault& fault, const VerifiedProgram* program);

/// The function with which the task began that the fault has ended, in the same way; empty if it
/// has ended none.
std::string FaultTask(const Fault& fault, const VerifiedProgram* program);

/// The place, the sentence and the function on one line, as all tools print a fault: "walk.dyn:12:
/// joint ... (in Knee.bend)". `file` is the program's; without one, or for a fault without a
/// source line, the place is left out.
std::string FaultLine(const std::string& file, int line, const std::string& sentence,
                      const std::string& function);

}  // namespace morphbus::vm
