#pragma once
// Reads a plan of faults (`--faults FILE`): lines of text, each a rule. docs/cli.md describes them.

#include <optional>
#include <string>
#include <vector>

#include "bridge/bus/faulty_bus.h"
#include "compiler/source/diagnostics.h"

namespace morphbus::bridge {

/// Rules a plan may have: all of them are looked at for every message.
inline constexpr int kMostFaultRules = 64;
/// The largest number of messages that may overtake one.
inline constexpr int kMostFaultDelay = 256;

/// The rules of text number `file` of `sources`. Nothing if there is any error, which `diagnostics`
/// then has, with its place.
/// @param modules  names of the run's modules, by which rules are found that can never hold; empty
///                 where they are not known.
std::optional<FaultPlan> ParseFaultPlan(const source::SourceSet& sources, int file,
                                        const std::vector<std::string>& modules,
                                        source::Diagnostics* diagnostics);

}  // namespace morphbus::bridge
