#include "bridge/wire/held_state.h"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <utility>

#include "bridge/wire/codec.h"
#include "bridge/wire/status_codec.h"
#include "compiler/base/check.h"

namespace morphbus::bridge {
namespace {

/// To how many bytes a name or value is cut where not even one fits otherwise: beside the longest
/// labels that a role can have.
constexpr size_t kShortest = 24;

/// How long names and values may be.
struct TextLimits {
  size_t name, value;
};
TextLimits LimitsOf(bool cut_short) {
  return cut_short ? TextLimits{kShortest, kShortest} : TextLimits{kMaxStatusName, kMaxValueText};
}

morphbus::value_t ToWire(const HeldValue& held, const TextLimits& limits) {
  // All texts are cut, as programs may have names and texts of any length, and a datagram may not.
  morphbus::value_t value;
  value.name = CutText(held.name, limits.name);
  value.type_name = held.type;
  value.value_text = CutText(held.value, limits.value);
  return value;
}

HeldValue FromWire(const morphbus::value_t& value) {
  return {value.name, value.type_name, value.value_text};
}

/// A task without its calls.
morphbus::held_task_t ToWire(const HeldTask& held, int number, const TextLimits& limits) {
  morphbus::held_task_t task;
  task.number = static_cast<int8_t>(number);
  task.kind = static_cast<int8_t>(held.kind);
  task.routine_name = CutText(held.routine, limits.name);
  task.wait = static_cast<int8_t>(held.wait);
  task.until_us = held.until_us;
  task.joint_name = CutText(held.joint, limits.name);
  // Its calls follow one by one, as far as there is room in the part.
  task.num_calls = 0;
  return task;
}

/// A call without its locals.
morphbus::call_t ToWire(const HeldCall& held, int number, const TextLimits& limits) {
  morphbus::call_t call;
  call.number = static_cast<int8_t>(number);
  call.function_name = CutText(held.function, limits.name);
  // The wire has 15 bits for a line, and the last number stands for all beyond.
  call.line = static_cast<int16_t>(std::min<int>(held.line, INT16_MAX));
  call.num_locals = 0;
  return call;
}

}  // namespace

HeldSplitter::HeldSplitter(const HeldState& held) : held_(held) {
  // The fields come first. A task, or a call, that has parts is told with the first of them.
  for (int f = 0; f < std::ssize(held.fields); ++f) items_.push_back({-1, -1, f});
  for (int t = 0; t < std::ssize(held.tasks); ++t) {
    const std::vector<HeldCall>& calls = held.tasks[t].calls;
    if (calls.empty()) items_.push_back({t, -1, -1});
    for (int c = 0; c < std::ssize(calls); ++c) {
      if (calls[c].locals.empty()) items_.push_back({t, c, -1});
      for (int v = 0; v < std::ssize(calls[c].locals); ++v) items_.push_back({t, c, v});
    }
  }
}

void HeldSplitter::Add(const Item& item, bool cut_short, morphbus::inspection_t* part) const {
  const TextLimits limits = LimitsOf(cut_short);
  // A field belongs to no task.
  if (item.task < 0) {
    part->fields.push_back(ToWire(held_.fields[item.value], limits));
    ++part->num_fields;
    return;
  }
  // The task and the call that go on, or begin.
  const HeldTask& task = held_.tasks[item.task];
  if (part->tasks.empty() || part->tasks.back().number != item.task) {
    part->tasks.push_back(ToWire(task, item.task, limits));
    ++part->num_tasks;
  }
  // A task that waits to begin has no call yet.
  if (item.call < 0) return;
  morphbus::held_task_t& of = part->tasks.back();
  const HeldCall& call = task.calls[item.call];
  if (of.calls.empty() || of.calls.back().number != item.call) {
    of.calls.push_back(ToWire(call, item.call, limits));
    ++of.num_calls;
  }
  if (item.value < 0) return;
  of.calls.back().locals.push_back(ToWire(call.locals[item.value], limits));
  ++of.calls.back().num_locals;
}

morphbus::inspection_t HeldSplitter::Next(size_t room) {
  morphbus::inspection_t part;
  part.part = parts_++;
  part.num_parts = parts_;
  part.num_fields = part.num_tasks = 0;
  const size_t first = next_;
  // The size is asked of the encoder itself, so that no estimate can be wrong.
  const auto fits = [room](const morphbus::inspection_t& one) {
    return static_cast<size_t>(one._getEncodedSizeNoHash()) <= room;
  };
  for (; next_ < items_.size(); ++next_) {
    morphbus::inspection_t longer = part;
    Add(items_[next_], false, &longer);
    // A value that fills a message by itself is told with its texts cut, since it would never fit.
    if (!fits(longer) && next_ == first) {
      longer = part;
      Add(items_[next_], true, &longer);
      MORPHBUS_CHECK(fits(longer));
    }
    // The item opens the next part.
    if (!fits(longer)) break;
    part = std::move(longer);
  }
  return part;
}

Result<HeldState> JoinHeld(const std::vector<morphbus::inspection_t>& parts) {
  HeldState held;
  // The parts continue each other: a task, or a call, that was not finished goes on in the next
  // part.
  for (size_t p = 0; p < parts.size(); ++p) {
    const morphbus::inspection_t& part = parts[p];
    // Parts may have been lost, or mixed with those of another answer.
    if (part.part != static_cast<int>(p) || part.num_parts != std::ssize(parts)) {
      return Fail("a part of the answer is missing");
    }
    for (const morphbus::value_t& field : part.fields) held.fields.push_back(FromWire(field));
    for (const morphbus::held_task_t& task : part.tasks) {
      // A number that was there last goes on; any other must be the next one.
      const auto tasks = std::ssize(held.tasks);
      if (task.number != tasks && task.number != tasks - 1) return Fail("a task is missing");
      if (task.number == tasks) {
        held.tasks.push_back({static_cast<vm::TaskKind>(task.kind),
                              task.routine_name,
                              static_cast<vm::WaitKind>(task.wait),
                              task.until_us,
                              task.joint_name,
                              {}});
      }
      // Calls are numbered within their task, and go on in the same way.
      std::vector<HeldCall>& calls = held.tasks.back().calls;
      for (const morphbus::call_t& call : task.calls) {
        const auto known = std::ssize(calls);
        if (call.number != known && call.number != known - 1) return Fail("a call is missing");
        if (call.number == known) calls.push_back({call.function_name, call.line, {}});
        for (const morphbus::value_t& local : call.locals) {
          calls.back().locals.push_back(FromWire(local));
        }
      }
    }
  }
  // No part at all is no answer, rather than the answer of a program without fields and tasks.
  if (parts.empty()) return Fail("a part of the answer is missing");
  return held;
}

}  // namespace morphbus::bridge
