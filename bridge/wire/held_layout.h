#pragma once
// The layout of what a module tells of its tasks, fields and variables in STATUS (inspection_t and
// its parts): as bridge/wire/message_layout.h, which includes this.

#include <cstdint>
#include <morphbus/inspection_t.hpp>

#include "bridge/wire/layout_base.h"
#include "vm/image/image.h"
#include "vm/limits.h"

namespace morphbus::bridge::layout {

/// A field or variable with its value, both as text: a listener has no program at hand.
template <class V>
constexpr void Walk(V& v, As<morphbus::value_t>) {
  v.Text("name", kNameText);
  v.Text("type_name", kNameText);
  v.Text("value_text", kMaxValueText);
}

/// A call in which a task stands.
template <class V>
constexpr void Walk(V& v, As<morphbus::call_t>) {
  v.Int8("number", 0, vm::kMaxCallDepth - 1);
  v.Text("function_name", kNameText);
  v.Int16("line", 0, kMost16);
  List8<morphbus::value_t>(v, "num_locals", "locals", vm::image::kMaxLocals);
}

/// A task with its calls. What it waits for is one of vm::WaitKind, from 0.
template <class V>
constexpr void Walk(V& v, As<morphbus::held_task_t>) {
  v.Int8("number", 0, vm::kMaxTasks - 1);
  v.Int8("kind", 0, 3);
  v.Text("routine_name", kNameText);
  v.Int8("wait", 0, 3);
  v.Int64("until_us", 0, kMost64);
  v.Text("joint_name", kNameText);
  List8<morphbus::call_t>(v, "num_calls", "calls", vm::kMaxCallDepth);
}

/// What a module holds, or a part of it.
template <class V>
constexpr void Walk(V& v, As<morphbus::inspection_t>) {
  WalkPart(v);
  List8<morphbus::value_t>(v, "num_fields", "fields", vm::kMaxFields);
  List8<morphbus::held_task_t>(v, "num_tasks", "tasks", vm::kMaxTasks);
}

}  // namespace morphbus::bridge::layout
