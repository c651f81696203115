#pragma once
// What the spy says of its keys: those that do something now, and all of them with what the columns
// mean.

#include <string>
#include <utility>
#include <vector>

#include "tools/spy/screen.h"
#include "tools/spy/spy_snapshot.h"
#include "tools/spy/spy_ui.h"

namespace morphbus::tools {

/// A key and what it does.
using KeyHint = std::pair<std::string, std::string>;

/// The keys that do something now, the most useful ones first. `scrolls`: the page has more lines
/// than the screen.
std::vector<KeyHint> KeyHints(const SpySnapshot& spy, const SpyUi& ui, bool scrolls);

/// The page of the help, in lines of at most `width` cells; keys that do nothing here are left out.
Screen HelpLines(const SpySnapshot& spy, const SpyUi& ui, int width);

}  // namespace morphbus::tools
