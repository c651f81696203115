#pragma once
// What a module holds besides its role, labels and conventions: fields, and tasks with their calls
// and variables. All of it by name and as text, for people; in parts on STATUS, and back.

#include <cstddef>
#include <cstdint>
#include <morphbus/inspection_t.hpp>
#include <string>
#include <vector>

#include "compiler/base/result.h"
#include "vm/module_api.h"
#include "vm/run/state.h"

namespace morphbus::bridge {

/// A field, parameter or variable.
struct HeldValue {
  std::string name;   ///< Empty where the image has no notes.
  std::string type;   ///< As listings call it, e.g. "float".
  std::string value;  ///< As it would stand in the program.
};

/// A call in which a task stands.
struct HeldCall {
  std::string function;           ///< With its role, e.g. "Junction.gait".
  int line = 0;                   ///< Source line at which it stands, from 1; 0 if unknown.
  std::vector<HeldValue> locals;  ///< Parameters, then variables.
};

/// A task that runs or waits.
struct HeldTask {
  vm::TaskKind kind = vm::TaskKind::kStartup;
  std::string routine;  ///< The role's routine that it runs; the outermost call is usually of it.
  vm::WaitKind wait = vm::WaitKind::kNone;
  int64_t until_us = 0;         ///< Sim time at which it goes on, for kSleep; else 0.
  std::string joint;            ///< The joint that must come to rest, for kMotion; else empty.
  std::vector<HeldCall> calls;  ///< The innermost first.
};

/// What a module holds at the end of a tick.
struct HeldState {
  std::vector<HeldValue> fields;  ///< Of the role, in the order of their slots.
  std::vector<HeldTask> tasks;    ///< In the order in which the module keeps them.
};

/// Puts a state into messages, as much as fits into each. Long names and values are cut at a
/// character (kMaxStatusName, kMaxValueText).
class HeldSplitter {
 public:
  /// `held` outlives the splitter.
  explicit HeldSplitter(const HeldState& held);

  /// True once a part has been made and nothing is left to tell.
  [[nodiscard]] bool done() const { return parts_ > 0 && next_ == items_.size(); }
  /// The next part, of at most `room` bytes, which are at least kLeastRoom; its num_parts is yet to
  /// be set. It tells at least one thing more, with its texts cut to what fits.
  morphbus::inspection_t Next(size_t room);

  /// Bytes that one value takes at most with its task and its call, cut as far as is allowed.
  static constexpr size_t kLeastRoom = 192;

 private:
  /// A thing to tell: a field, or something of a task. Indices that do not apply are -1: a task
  /// without calls has only `task`, a call without locals has no `value`.
  struct Item {
    int task = -1, call = -1, value = -1;
  };
  /// Adds an item, with the task and the call that it belongs to if the part has them not yet.
  void Add(const Item& item, bool cut_short, morphbus::inspection_t* part) const;

  const HeldState& held_;
  std::vector<Item> items_;
  size_t next_ = 0;
  int16_t parts_ = 0;
};

/// Puts the parts together again, which are all there and in their order. Fails if one is missing
/// or continues what has not begun.
Result<HeldState> JoinHeld(const std::vector<morphbus::inspection_t>& parts);

}  // namespace morphbus::bridge
