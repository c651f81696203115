#include "vm/image/call_checker.h"

#include "vm/image/image.h"
#include "vm/image/opcodes.h"

namespace morphbus::vm {

bool CallChecker::CheckCalls() {
  for (int i = 0; i < program_.num_functions(); ++i) {
    if (!VisitFunction(i, 0)) return false;
  }
  return true;
}

// Depth is at most kMaxCallDepth, so this recursion is short.
bool CallChecker::VisitFunction(int function, int depth) {
  // What has been found of a function is found once, however many call it.
  Reach& reach = functions_[function];
  CodeFacts& facts = facts_[function];
  const FunctionInfo info = program_.function(function);
  if (reach.visit == kVisiting) {
    return error_.Fail("functions call each other in a circle", info.code_begin);
  }
  if (depth >= kMaxCallDepth) return error_.Fail("calls nest too deep", info.code_begin);
  if (reach.visit == kDone) return true;
  // The deepest, largest and strongest of all that may be called counts.
  reach.visit = kVisiting;
  Reach called;
  called.effect = facts.effect & 3;
  bool calls = false;
  for (int slot = 0; slot < kMaxRoutines; ++slot) {
    if ((facts.methods_called >> slot & 1) == 0) continue;
    // Whichever role is played, its function in the slot may be the one that runs.
    if (!VisitSlot(info.role, slot, depth + 1)) return false;
    Raise(&called, slots_[info.role][slot]);
    calls = true;
  }
  if (facts.super_called != 0) {
    const int callee = facts.super_called - 1;
    if (!VisitFunction(callee, depth + 1)) return false;
    Raise(&called, functions_[callee]);
    calls = true;
    // The function above is run as part of this one, so that its role needs those parts of a
    // module, too.
    facts.keywords |= facts_[callee].keywords;
  }
  // The callee's frame begins at its arguments; counting them twice is simple and safe.
  const int cells = called.cells + info.num_locals + facts.max_stack;
  const int call_depth = calls ? called.call_depth + 1 : 0;
  if (call_depth >= kMaxCallDepth) return error_.Fail("calls nest too deep", info.code_begin);
  // A task has a fixed stack, so that running code needs no check of it.
  if (cells > kStackCells) return error_.Fail("task needs too many cells", info.code_begin);
  reach.cells = static_cast<uint16_t>(cells & 0x7f);
  reach.call_depth = static_cast<uint16_t>(call_depth & 0xf);
  reach.effect = called.effect;
  reach.visit = kDone;
  return true;
}

// A call by a slot may reach the function of the owner or of any role that extends it. What holds
// for a role and all below it is noted for the role, so that each is gone through once. A role on
// the way cannot be come upon again: it would be by a function that is being visited.
bool CallChecker::VisitSlot(int top, int slot, int depth) {
  for (int role = top;;) {
    Reach& reach = slots_[role][slot];
    if (reach.visit == kNew) {
      const int callee = program_.role(role).methods[slot];
      if (!VisitFunction(callee, depth)) return false;
      Raise(&reach, functions_[callee]);
      // First down to those that extend it.
      if (tree_.FirstChild(role) >= 0) {
        role = tree_.FirstChild(role);
        continue;
      }
    }
    // Then up, until there is another way down.
    for (;;) {
      slots_[role][slot].visit = kDone;
      if (role == top) return true;
      const int parent = program_.role(role).parent;
      Raise(&slots_[parent][slot], slots_[role][slot]);
      if (tree_.NextSibling(role) >= 0) break;
      role = parent;
    }
    role = tree_.NextSibling(role);
  }
}

void CallChecker::Raise(Reach* most, const Reach& reach) {
  if (reach.cells > most->cells) most->cells = reach.cells;
  if (reach.call_depth > most->call_depth) most->call_depth = reach.call_depth;
  if (reach.effect > most->effect) most->effect = reach.effect;
}

bool CallChecker::CheckEffects() {
  // They are evaluated whenever the surroundings have changed, on modules that do not play the
  // role.
  bool pure = true;
  const auto check = [&](int function) {
    pure = pure && functions_[function].effect == static_cast<uint8_t>(Effect::kPure);
  };
  for (int i = 0; i < program_.num_roles(); ++i) {
    const RoleInfo role = program_.role(i);
    for (int k = 0; k < role.num_requirements; ++k) check(role.requirements[k]);
    for (int k = 0; k < role.num_labels; ++k) check(role.labels[k]);
  }
  return pure || error_.Fail("requirement or label acts on the module",
                             SectionOf(program_.bytes(), image::Section::kRoles).begin);
}

}  // namespace morphbus::vm
