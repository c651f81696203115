#pragma once
// What a module holds, as JSON and as text: alike for a running robot (`control inspect`) and for a
// module that a log runs again (`replay --into`).

#include <cstdint>
#include <string>
#include <vector>

#include "bridge/wire/held_state.h"
#include "tools/base/json.h"
#include "vm/image/kinematics_image.h"
#include "vm/image/source_places.h"

namespace morphbus::tools {

/// What a task "waits_for", with "until", seconds of sim time, or "joint".
/// @param until_us  for kSleep: the sim time at which it goes on, microseconds
/// @param joint     for kMotion: the joint's name
Json WaitJson(vm::WaitKind wait, int64_t until_us, const std::string& joint);
/// The same for people: "joint joint_1" or "12.50 s"; "nothing" for a task that runs. Other keys of
/// the object are of no account, so that it may be a task of TasksJson.
std::string WaitText(const Json& wait);

/// Fields by name, each with its "type" and "value".
Json FieldsJson(const std::vector<bridge::HeldValue>& fields);

/// Locals in their order, each with its "name", "type" and "value"; none that has no value yet.
Json LocalsJson(const std::vector<bridge::HeldValue>& locals);

/// The names of a module type's connectors, in their order.
std::vector<std::string> ConnectorNames(const vm::VerifiedKinematics& kinematics);

/// Locals as held, for people: a set of neighbours by the connectors on which they are docked, "c1
/// and c2" or "none", and without a value those to which a loop has still to come.
std::vector<bridge::HeldValue> LocalsForPeople(std::vector<bridge::HeldValue> locals,
                                               const std::vector<std::string>& connectors);

/// Tasks, each with its "kind", "routine", what it waits for (WaitJson) and its "calls", the
/// innermost first: "function", "file" (empty if unknown), "line" and "locals".
/// @param files       those of the program, of which the tasks tell lines
/// @param connectors  of the module's type, by name (LocalsForPeople)
Json TasksJson(const std::vector<bridge::HeldTask>& tasks, const vm::SourceFiles& files,
               const std::vector<std::string>& connectors);

/// The same for people: a line for each field.
std::string FieldsText(const Json& fields);
/// "i = 3, far = true"; a local without a name is called by its number.
std::string LocalsText(const Json& locals);
/// A line for each call, with its place.
std::string CallsText(const Json& calls);
/// A line for each task and each call.
std::string TasksText(const Json& tasks);

}  // namespace morphbus::tools
