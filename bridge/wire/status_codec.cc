#include "bridge/wire/status_codec.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>
#include <utility>

#include "bridge/wire/codec.h"
#include "bridge/wire/field_copy.h"
#include "bridge/wire/wire_size.h"
#include "compiler/base/check.h"

namespace morphbus::bridge {
namespace {

// A STATUS with the longest labels, and nothing else, leaves room for something that is held.
static_assert(SizeWithoutArrays<morphbus::status_t>() +
                      vm::kMaxLabels * (kMaxStatusName + 5 + 2 * sizeof(int8_t)) + vm::kMaxJoints +
                      HeldSplitter::kLeastRoom <=
                  kMaxPayloadBytes,
              "what a module holds could not be told");

/// Indices into the program's and the type's tables; whoever shows a fault looks the names up.
template <class Wire, class Vm>
void CopyFault(Wire& wire, Vm& vm) {
  Copy(std::tie(wire.code, wire.role, wire.rival_role, wire.function_index, wire.keyword,
                wire.joint, wire.link, wire.connector, wire.asked_axis, wire.ended_task,
                wire.task_function, wire.asked, wire.measured, wire.limit, wire.direction[0],
                wire.direction[1], wire.direction[2]),
       std::tie(vm.code, vm.role, vm.rival_role, vm.function, vm.keyword, vm.joint, vm.link,
                vm.connector, vm.asked_axis, vm.ended_task, vm.task_function, vm.asked, vm.measured,
                vm.limit, vm.direction_R.x, vm.direction_R.y, vm.direction_R.z));
}

/// Source lines and counts beyond what the wire has room for stay at the end of its range.
int16_t To16(uint16_t number) { return static_cast<int16_t>(std::min<int>(number, INT16_MAX)); }

/// Names longer than the message has room for.
std::string Cut(const std::string& name) { return CutText(name, kMaxStatusName); }

/// An item of a list, or something else where the list is shorter than the report.
template <class T>
T ItemOr(const std::vector<T>& items, size_t i, const T& otherwise) {
  return i < items.size() ? items[i] : otherwise;
}

morphbus::fault_t ToFault(const vm::Fault& fault) {
  morphbus::fault_t out;
  CopyFault(out, fault);
  out.line = To16(fault.line);
  // What a program asked for may be anything; the wire carries finite numbers only.
  constexpr float kLargest = 3.4e38F;
  for (float* number : {&out.asked, &out.measured, &out.limit, &out.direction[0], &out.direction[1],
                        &out.direction[2]}) {
    *number = std::isnan(*number) ? 0.0F : std::clamp(*number, -kLargest, kLargest);
  }
  return out;
}

/// What every STATUS of a report says: identity, role, labels, conventions.
morphbus::status_t StatusCore(const vm::StatusReport& report, const StatusNames& names,
                              uint16_t module_id, uint32_t incarnation, int num_joints) {
  morphbus::status_t out;
  out.module_id = static_cast<int16_t>(module_id);
  out.type_name = Cut(names.type_name);
  out.incarnation = static_cast<int32_t>(incarnation);
  // What the module plays, and whether it knows where it is.
  Copy(std::tie(out.role, out.frozen, out.has_pose, out.pose_stale),
       std::tie(report.role, report.frozen, report.has_pose, report.pose_stale));
  out.role_name = Cut(names.role_name);
  // Labels by name, since a listener has no program at hand.
  for (size_t i = 0; i < report.num_labels; ++i) {
    morphbus::label_t label;
    label.name = Cut(ItemOr<std::string>(names.label_names, i, ""));
    const bool joint = i < names.label_is_joint.size() && names.label_is_joint[i];
    label.kind = joint ? morphbus::label_t::KIND_JOINT : morphbus::label_t::KIND_LINK;
    label.index = report.labels[i];
    out.labels.push_back(std::move(label));
  }
  out.num_labels = static_cast<int8_t>(out.labels.size());
  // Conventions are told as signs: +1 or -1 to the actuator's own, 0 without one.
  out.num_joints = static_cast<int8_t>(num_joints);
  out.joint_sign.assign(report.signs, report.signs + num_joints);
  Copy(std::tie(out.ended_behaviors, out.startup_ended),
       std::tie(report.ended_behaviors, report.startup_ended));
  out.num_tasks = out.num_faults = out.tasks_omitted = 0;
  out.faults_dropped = To16(report.faults_dropped);
  out.num_prints = out.num_inspections = 0;
  out.prints_dropped = To16(report.prints_dropped);
  return out;
}

/// Bytes left in the datagram.
size_t RoomIn(const morphbus::status_t& status) {
  const auto size = static_cast<size_t>(status.getEncodedSize());
  return size < kMaxPayloadBytes ? kMaxPayloadBytes - size : 0;
}

constexpr auto kPrint = [](auto& wire, auto& vm) {
  Copy(std::tie(wire.function_index, wire.text), std::tie(vm.function, vm.text));
  CopyList(wire.num_values, wire.values, vm.num_values, vm.values, kCell);
};

/// The value of a traced field, as a line that no function printed.
morphbus::print_t ToTrace(const vm::TraceReport& trace) {
  morphbus::print_t out;
  out.function_index = -1;
  out.line = 0;
  out.text = trace.field;
  out.num_values = 1;
  out.values = {static_cast<int32_t>(trace.value.bits)};
  return out;
}

/// How many printed lines and values of traced fields a report has.
size_t NumLines(const vm::StatusReport& report) {
  return size_t{report.num_prints} + report.num_traces;
}

/// Adds printed lines, and behind them the values of traced fields, from number `next` on as far as
/// they fit; returns the number of the next.
size_t AddPrints(const vm::StatusReport& report, size_t next, morphbus::status_t* out) {
  for (; next < NumLines(report) && out->num_prints < vm::kMaxPrintsPerTick; ++next) {
    morphbus::print_t print;
    if (next < report.num_prints) {
      kPrint(print, report.prints[next]);
      print.line = To16(report.prints[next].line);
    } else {
      print = ToTrace(report.traces[next - report.num_prints]);
    }
    if (static_cast<size_t>(print._getEncodedSizeNoHash()) > RoomIn(*out)) break;
    out->prints.push_back(std::move(print));
    ++out->num_prints;
  }
  return next;
}

/// Adds the tasks that fit, and counts those that do not.
void AddTasks(const vm::StatusReport& report, const StatusNames& names, morphbus::status_t* out) {
  for (size_t i = 0; i < report.num_tasks; ++i) {
    morphbus::task_t task;
    task.kind = static_cast<int8_t>(report.tasks[i].kind);
    task.function_name = Cut(ItemOr<std::string>(names.task_functions, i, ""));
    task.line = To16(report.tasks[i].line);
    // A later task with a shorter name may still fit.
    if (static_cast<size_t>(task._getEncodedSizeNoHash()) > RoomIn(*out)) {
      ++out->tasks_omitted;
      continue;
    }
    out->tasks.push_back(std::move(task));
    ++out->num_tasks;
  }
}

}  // namespace

std::vector<morphbus::status_t> ToStatus(const vm::StatusReport& report, const StatusNames& names,
                                         uint16_t module_id, uint32_t incarnation, int num_joints,
                                         const HeldState* held) {
  std::vector<morphbus::status_t> messages;
  size_t fault = 0, print = 0;
  std::optional<HeldSplitter> rest;
  if (held != nullptr) rest.emplace(*held);
  int16_t num_parts = 0;
  // As many messages as faults, printed lines and what is held need; each says the rest again, so
  // that any one can be read alone.
  do {
    morphbus::status_t& message =
        messages.emplace_back(StatusCore(report, names, module_id, incarnation, num_joints));
    // Counted once.
    if (messages.size() > 1) message.faults_dropped = message.prints_dropped = 0;
    while (fault < report.num_faults) {
      // As many faults as fit; the next message takes the rest.
      morphbus::fault_t one = ToFault(report.faults[fault]);
      if (static_cast<size_t>(one._getEncodedSizeNoHash()) > RoomIn(message)) break;
      message.faults.push_back(std::move(one));
      ++message.num_faults;
      ++fault;
    }
    if (fault >= report.num_faults) print = AddPrints(report, print, &message);
    MORPHBUS_CHECK(fault >= report.num_faults || message.num_faults > 0);
    MORPHBUS_CHECK(fault < report.num_faults || print >= NumLines(report) ||
                   message.num_prints > 0 || message.num_faults > 0);
    // What is held comes behind all of these, in messages without them, where there is room.
    if (rest && fault >= report.num_faults && print >= NumLines(report) &&
        message.num_faults == 0 && message.num_prints == 0) {
      message.inspections.push_back(rest->Next(RoomIn(message)));
      message.num_inspections = 1;
      ++num_parts;
    }
    // Tasks get the room that all this leaves.
    AddTasks(report, names, &message);
  } while (fault < report.num_faults || print < NumLines(report) || (rest && !rest->done()));
  for (morphbus::status_t& message : messages) {
    for (morphbus::inspection_t& part : message.inspections) part.num_parts = num_parts;
  }
  return messages;
}

vm::TraceReport FromTrace(const morphbus::print_t& print) {
  return {static_cast<uint8_t>(print.text), vm::Cell{static_cast<uint32_t>(print.values[0])}};
}

vm::PrintReport FromPrint(const morphbus::print_t& print) {
  vm::PrintReport out;
  kPrint(print, out);
  out.line = static_cast<uint16_t>(print.line);
  return out;
}

vm::Fault FromFault(const morphbus::fault_t& fault) {
  vm::Fault out;
  CopyFault(fault, out);
  out.line = static_cast<uint16_t>(fault.line);
  return out;
}

}  // namespace morphbus::bridge
