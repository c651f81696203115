#pragma once
// The key of a run for a process that is started by hand, and for tools: --key, --open, or what the
// run's folder holds.

#include <string>

#include "bridge/wire/run_key.h"
#include "compiler/base/result.h"
#include "tools/base/options.h"

namespace morphbus::tools {

/// Where a run's folder has its key.
std::string KeyPath(const std::string& folder);

/// Adds --key to a subcommand. `file` must live until the command line is parsed. `otherwise` says
/// which key it is without the option.
void AddKeyFile(Subcommand* sub, std::string* file, const std::string& otherwise);

/// The key of a run that begins here: none if it is open, that of `file` (--key), else a fresh one.
/// Puts it into the run's folder, unless that is empty: a run in one process needs no file. Fails
/// if `file` holds no key, or if --open contradicts --key.
Result<bridge::RunKey> KeyOfNewRun(bool open, const std::string& file, const std::string& folder);

/// The key that a process of run `run` has.
/// @param open  the run has none (--open).
/// @param file  of --key; empty: that of the living run of this name on this machine.
/// Fails in a sentence that says what to do if there is none, or if --open contradicts --key.
Result<bridge::RunKey> ChooseKey(const std::string& run, bool open, const std::string& file);

}  // namespace morphbus::tools
