#pragma once
// The steps of a module's tasks in one tick that runs again, by instruction or by source line.

#include <string>
#include <vector>

#include "bridge/wire/held_state.h"
#include "logger/compare/module_rerun.h"
#include "tools/base/json.h"

namespace morphbus::tools {

/// Collects what tasks do, step by step, and what each step changes of locals and fields.
class StepTrace {
 public:
  /// A line's step goes on until the task comes to another line or call, or back in a loop.
  enum class By { kInstruction, kLine };

  explicit StepTrace(By by) : by_(by) {}

  /// Takes the next moment of the tick.
  void Take(const logger::ComputedStep& step);

  /// The steps as docs/cli.md has them, of which the first 100,000 are kept.
  [[nodiscard]] const Json& steps() const { return steps_; }
  /// How many more there were.
  [[nodiscard]] int64_t dropped() const { return dropped_; }

 private:
  /// Where a task stands, and what it could change there.
  struct Moment {
    int depth = 0, function = 0, line = 0;
    uint32_t pc = 0;
    std::vector<bridge::HeldValue> locals, fields;
  };
  static Moment MomentOf(const logger::ComputedStep& step);
  /// Adds to the last step what is another value than at its beginning.
  void NoteChanges(const Moment& now);
  /// Whether the line that the last step began goes on.
  [[nodiscard]] bool GoesOn(const Moment& now) const;
  void Begin(const logger::ComputedStep& step, Moment now);

  const By by_;
  Json steps_ = Json::array();
  int64_t dropped_ = 0;
  bool open_ = false;  ///< The last step has begun and its task runs on.
  Moment begun_;       ///< Where it began.
  uint32_t last_pc_ = 0;
};

/// The steps for people: a line each, with the source file's name; what it changed below it.
std::string StepsText(const Json& steps, int64_t dropped);

}  // namespace morphbus::tools
