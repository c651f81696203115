// Who calls whom: no circles, bounded depth and cells, effects only where they are allowed. Every
// function, and every slot of every role, is visited once, so this is linear in functions and
// table.
#include "vm/image/image.h"
#include "vm/image/opcodes.h"
#include "vm/image/verifier.h"

namespace morphbus::vm {

using image::Section;
using image::SectionOf;

// Calls go through the role's slots, so a call may reach the function of any subrole. No recursion
// can be, and the depth and cells that any task can need are bounded here, once.
bool Verifier::CheckCalls() {
  for (int i = 0; i < out_.num_functions_; ++i) {
    if (!VisitCalls(i, 0)) return false;
  }
  // With every function visited, the keywords of each role are known.
  for (int i = 0; i < out_.num_roles_; ++i) CollectKeywords(i);
  return true;
}

// Depth is at most kMaxCallDepth, so this recursion is short; every function is visited once.
bool Verifier::VisitCalls(int function, int depth) {
  FunctionFacts& facts = facts_[function];
  const FunctionInfo info = out_.function(function);
  at_ = info.code_begin;
  if (facts.visit == 1) return Fail("functions call each other in a circle", at_);
  if (depth >= kMaxCallDepth) return Fail("calls nest too deep", at_);
  if (facts.visit == 2) return true;
  // While it is being visited, meeting it again means a circle. The deepest, largest and strongest
  // of all that may be called counts.
  facts.visit = 1;
  CallFacts called;
  called.effect = facts.effect;
  bool calls = false;
  const int owner = OwnerOf(function);
  for (int slot = 0; slot < kMaxRoutines; ++slot) {
    if ((facts.methods_called >> slot & 1) == 0) continue;
    if (!VisitSlot(owner, slot, depth + 1)) return false;
    Raise(&called, slots_[owner][slot]);
    calls = true;
  }
  if (facts.super_called != 0) {
    const int callee = facts.super_called - 1;
    if (!VisitCalls(callee, depth + 1)) return false;
    Raise(&called, FactsOf(callee));
    calls = true;
    // The callee may stand in no table of the role that uses the caller.
    facts.keywords |= facts_[callee].keywords;
  }
  facts.effect = called.effect;
  facts.call_depth = static_cast<uint8_t>(calls ? called.call_depth + 1 : 0);
  // The callee's frame begins at its arguments; counting them twice is simple and safe.
  const int cells = called.cells + info.num_locals + facts.max_stack;
  at_ = info.code_begin;
  if (facts.call_depth >= kMaxCallDepth) return Fail("calls nest too deep", at_);
  if (cells > kStackCells) return Fail("task needs too many cells", at_);
  facts.total_cells = static_cast<uint8_t>(cells);
  facts.visit = 2;
  return true;
}

// A call by a slot may reach the function of the owner or of any role that extends it. What holds
// for a role and all below it is noted for the role, so that each is gone through once. A role on
// the way cannot be come upon again: it would be by a function that is being visited.
bool Verifier::VisitSlot(int top, int slot, int depth) {
  for (int role = top;;) {
    CallFacts& facts = slots_[role][slot];
    if (facts.done == 0) {
      const int callee = out_.role(role).methods[slot];
      if (!VisitCalls(callee, depth)) return false;
      Raise(&facts, FactsOf(callee));
      // First down to those that extend it.
      if (first_child_[role] != kNoRole) {
        role = first_child_[role];
        continue;
      }
    }
    // Then up, until there is another way down.
    for (;;) {
      slots_[role][slot].done = 1;
      if (role == top) return true;
      const int parent = out_.role(role).parent;
      Raise(&slots_[parent][slot], slots_[role][slot]);
      if (next_sibling_[role] != kNoRole) break;
      role = parent;
    }
    role = next_sibling_[role];
  }
}

void Verifier::Raise(CallFacts* most, const CallFacts& facts) {
  if (facts.cells > most->cells) most->cells = facts.cells;
  if (facts.call_depth > most->call_depth) most->call_depth = facts.call_depth;
  if (facts.effect > most->effect) most->effect = facts.effect;
}

Verifier::CallFacts Verifier::FactsOf(int function) const {
  const FunctionFacts& facts = facts_[function];
  CallFacts called;
  called.cells = static_cast<uint16_t>(facts.total_cells & 0x7f);
  called.call_depth = static_cast<uint16_t>(facts.call_depth & 0xf);
  called.effect = facts.effect;
  return called;
}

// Requirements and labels are evaluated whenever the surroundings change, so they must not act.
bool Verifier::CheckEffects() {
  bool pure = true;
  const auto check = [&](int function) {
    pure = pure && facts_[function].effect == static_cast<uint8_t>(Effect::kPure);
  };
  for (int i = 0; i < out_.num_roles_; ++i) {
    const RoleInfo role = out_.role(i);
    for (int k = 0; k < role.num_requirements; ++k) check(role.requirements[k]);
    for (int k = 0; k < role.num_labels; ++k) check(role.labels[k]);
  }
  return pure ||
         Fail("requirement or label acts on the module", SectionOf(bytes_, Section::kRoles).begin);
}

}  // namespace morphbus::vm
