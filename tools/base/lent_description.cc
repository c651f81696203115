#include "tools/base/lent_description.h"

#include <utility>

#include "logger/log/description.h"

namespace morphbus::tools {

Result<std::string> LentDescription(const std::string& path) {
  // Nothing is lent where it was not asked for.
  if (path.empty()) return std::string();
  Result<std::string> description = logger::ReadDescription(path);
  if (!description) return Fail("--description: " + description.error().message);
  return description;
}

Result<logger::RunLog> LoadLog(const std::string& path, logger::RunLogOptions options,
                               const std::string& lender) {
  Result<std::string> description = LentDescription(lender);
  if (!description) return tl::unexpected(description.error());
  // LoadRunLog takes it only if the log has none of its own.
  options.description = std::move(*description);
  return logger::LoadRunLog(path, options);
}

}  // namespace morphbus::tools
