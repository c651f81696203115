#pragma once
// The option --seed, alike wherever there is chance.

#include <cstdint>
#include <string>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace morphbus::tools {

/// Adds `--seed` to a subcommand: a whole number, 0 to 2^64 - 1. What is none, or is larger, is
/// refused (a plain unsigned option would take -1 for the largest, and cut what is too large).
CLI::Option* AddSeed(CLI::App* sub, uint64_t* seed, const std::string& what);

}  // namespace morphbus::tools
