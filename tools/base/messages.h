#pragma once
// What commands say on stderr, and the exit statuses that go with it.

#include <optional>
#include <string>
#include <vector>

#include "compiler/source/diagnostics.h"

namespace morphbus::tools {

// Exit statuses (docs/cli.md).
inline constexpr int kDone = 0;      ///< Done; the answer is yes.
inline constexpr int kNo = 1;        ///< The answer is no: differs, a check failed.
inline constexpr int kUnusable = 2;  ///< Input or options cannot be used.
inline constexpr int kFailed = 3;    ///< A process failed at run time.

/// True if `fd` is a terminal and the user has not asked for plain output (NO_COLOR, TERM=dumb). No
/// terminal is what this thread says while it is kept (HeldSaying).
bool IsFancyTerminal(int fd);

/// Prints `morphbus: error: message` on stderr and returns kUnusable.
int Unusable(const std::string& message);
/// The same for functions that give nothing where the input cannot be used; returns nothing.
std::nullopt_t Refuse(const std::string& message);
/// The same as Unusable for failures at run time; returns kFailed.
int Failed(const std::string& message);
/// `morphbus: warning: message` on stderr.
void Warn(const std::string& message);

/// How many of a kind are named where there may be thousands.
inline constexpr size_t kMostNamed = 10;

/// Warnings that may be thousands: of each kind the first kMostNamed, then how many more there are.
/// Of one kind are those that differ only in words with a point or a digit in them, as the names of
/// a robot's parts and figures have.
void WarnOfMany(const std::vector<std::string>& messages);

/// Diagnostics on stderr, in colour on a terminal.
void PrintDiagnostics(const source::Diagnostics& diagnostics, const source::SourceSet& sources);

/// " (did you mean 'x'?)" with the one of `names` that is nearest to `name`; "" if none is near.
std::string DidYouMean(const std::string& name, const std::vector<std::string>& names);

/// The names of things that have one, for DidYouMean and for lists.
template <class Things>
std::vector<std::string> NamesOf(const Things& things) {
  std::vector<std::string> names;
  for (const auto& thing : things) names.emplace_back(thing.name);
  return names;
}

/// "a, b, c"; of more than kMostNamed names the first ones "and 1234 more".
std::string NameSome(const std::vector<std::string>& names);

}  // namespace morphbus::tools
