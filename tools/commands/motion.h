#pragma once
// `check --motion`: which links of neighbouring modules meet within the ranges of their joints.

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "tools/base/model_io.h"
#include "tools/base/options.h"

namespace morphbus::tools {

/// The options of `check` that are about motion.
struct MotionChoice {
  bool wanted = false;
  /// Empty: all robots of the model.
  std::string robot;
  int postures = 1000;
  uint64_t seed = 1;
  /// Those options that mean nothing without --motion, by name.
  std::vector<std::pair<std::string, Option>> others;
};

/// Adds --motion and what belongs to it to `check`. `choice` must live until the command has run.
void AddMotionOptions(Subcommand* sub, MotionChoice* choice);

/// Says on stderr what cannot be used of the options alone, or with a model that has no such robot;
/// true if there is nothing of the kind.
bool IsUsable(const MotionChoice& choice);
bool IsUsable(const MotionChoice& choice, const model::Model& model);

/// Checks the robots chosen. Prints what meets, or, where `json` is not null, writes it there as
/// docs/cli.md has it. Returns kDone if nothing meets, kNo if something does, and kUnusable where
/// hulls are too detailed for a single posture.
int CheckMotions(const MotionChoice& choice, const model::Model& model, Json* json);

}  // namespace morphbus::tools
