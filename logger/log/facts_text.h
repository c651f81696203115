#pragma once
// What is told of a log besides its messages, as text for people: `info`, `verify`, `run`.

#include <cstdint>
#include <string>

#include "logger/log/run_facts.h"

namespace morphbus::logger {

/// Text for `morphbus info`, many lines: what the log is of, a table of channels, ledgers, faults,
/// and what VerifyText() says if anything is wrong. It fits a screen, as modules' channels and
/// ledgers are summed up and lists are cut, unless `all` is asked for.
std::string FactsText(const LogFacts& facts, bool all);
/// The commands of a run, a line each, as `run --commands` reads them.
std::string CommandsText(const LogFacts& facts);
/// What a process refused of the messages that it got, though they were sound: nothing that a run
/// alone on its bus has. Counts, and the first of them by name; empty if there was none.
std::string RefusedText(const morphbus::health_t& health);
/// The same as one number.
int64_t RefusedMessages(const morphbus::health_t& health);
/// That the kernel refused filters to a process, what that costs and who knows the way out.
std::string RefusedFiltersText(const morphbus::health_t& health);
/// One line a problem, ending with a verdict line, for `morphbus verify`.
std::string VerifyText(const LogFacts& facts);

}  // namespace morphbus::logger
