#pragma once
// What a module's VM tells of itself, as STATUS: roles, labels, tasks, faults, printed lines,
// traced fields, and what it holds. As vm_codec.h, for what people read rather than other modules.

#include <cstddef>
#include <cstdint>
#include <morphbus/status_t.hpp>
#include <string>
#include <vector>

#include "bridge/wire/held_state.h"
#include "vm/module_api.h"

namespace morphbus::bridge {

/// Names behind a StatusReport's numbers, as text.
struct StatusNames {
  /// The module's type in the model.
  std::string type_name;
  std::string role_name;                    ///< Of the report's role; empty without one.
  std::vector<std::string> label_names;     ///< Of its label slots.
  std::vector<bool> label_is_joint;         ///< Else a link.
  std::vector<std::string> task_functions;  ///< By entry of tasks.
};

/// Longest name in a STATUS, bytes; longer ones are cut at a character.
inline constexpr size_t kMaxStatusName = 48;

/// The report as one message, or as several if its faults, or `held`, do not fit into one. Labels
/// always fit; tasks that do not are counted in tasks_omitted. Every message repeats all but the
/// faults, prints and what is held, so that each can be read alone.
/// @param held  what the module holds besides, if it was asked to tell; else null.
std::vector<morphbus::status_t> ToStatus(const vm::StatusReport& report, const StatusNames& names,
                                         uint16_t module_id, uint32_t incarnation, int num_joints,
                                         const HeldState* held = nullptr);

/// Whether what STATUS has among its printed lines is the value of a traced field: no function
/// printed it, and its text is the slot of the field in the role.
inline bool IsTrace(const morphbus::print_t& print) {
  return print.function_index < 0 && print.num_values == 1;
}
/// Such a value.
vm::TraceReport FromTrace(const morphbus::print_t& print);

/// A printed line of a STATUS that Decode accepted, to be worded by vm::PrintText.
vm::PrintReport FromPrint(const morphbus::print_t& print);

/// A fault of a STATUS that Decode accepted, to be worded by vm::FaultSentence.
vm::Fault FromFault(const morphbus::fault_t& fault);

}  // namespace morphbus::bridge
