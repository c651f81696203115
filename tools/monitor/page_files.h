#pragma once
// The files of the monitor's page, read into memory once.

#include <map>
#include <string>

#include "bridge/outward/request_gate.h"
#include "compiler/base/result.h"

namespace morphbus::tools {

/// The page in `folder`, by path ("/" for index.html). Fails if there is no index.html in it, or
/// if it holds more than a page does (1000 files or 64 MiB).
Result<std::map<std::string, bridge::PageFile>> LoadPage(const std::string& folder);

/// What is served in place of a page that was not built: says so, and what works nevertheless.
std::map<std::string, bridge::PageFile> PageOfNoPage();

}  // namespace morphbus::tools
