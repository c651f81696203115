#pragma once
// What modules told of themselves when they were asked (`control inspect`), as JSON and as text:
// alike for a running robot and for the inspections that a log holds.

#include <morphbus/status_t.hpp>
#include <string>

#include "bridge/wire/held_state.h"
#include "compiler/model/robot_model.h"
#include "logger/log/run_log.h"
#include "tools/base/json.h"
#include "vm/image/source_places.h"

namespace morphbus::tools {

/// What one module told, whole, and a STATUS that told a part of it: each says the rest as well.
struct Inspection {
  morphbus::status_t status;
  bridge::HeldState held;
};

/// The files of the program in an image, as the image names them; none if it names none or is
/// damaged.
vm::SourceFiles SourceOfImage(const std::string& image);

/// One module's answer: "module", "type", "tick", "seconds", "role", "frozen", "has_pose",
/// "pose_stale", "labels", "conventions", "program" (the source file; empty if unknown), "fields",
/// "tasks".
Json InspectionJson(const std::string& module, const model::ModuleType& type,
                    const Inspection& inspection, const vm::SourceFiles& program);

/// What the modules told in the run that a log holds: for each tick in which any did, "tick",
/// "seconds" and "modules", the answers in the robot's order. Answers of which a part is missing
/// are left out.
Json InspectionsOf(const logger::RunLog& log);

/// Answers of one tick for people.
std::string AnswersText(const Json& answers);
/// The same of all ticks, each under a line with its time.
std::string InspectionsText(const Json& inspections);

}  // namespace morphbus::tools
