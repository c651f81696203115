#pragma once
// Logs as commands load them: with a description from elsewhere if they hold none (--description).

#include <string>

#include "compiler/base/result.h"
#include "logger/log/run_log.h"

namespace morphbus::tools {

/// The serialized description in the file or log `path`; empty if `path` is, which stands for no
/// --description. Fails if there is none in it.
Result<std::string> LentDescription(const std::string& path);

/// Loads the log at `path`. If it holds no description it gets that of `lender`, a file or log, or
/// none if `lender` is empty.
Result<logger::RunLog> LoadLog(const std::string& path, logger::RunLogOptions options,
                               const std::string& lender);

}  // namespace morphbus::tools
