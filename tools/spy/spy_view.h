#pragma once
// The spy's screen, laid out for a width and a height.

#include <cstdint>
#include <string>
#include <vector>

#include "tools/spy/field_history.h"
#include "tools/spy/screen.h"
#include "tools/spy/spy_snapshot.h"
#include "tools/spy/spy_ui.h"

namespace morphbus::tools {

/// What is known of the fields of the selected channel.
struct ShownFields {
  const FieldHistory* history = nullptr;  ///< Null before the channel's first message.
  std::string problem;                    ///< Why the last message could not be decoded.
  /// Then: the first bytes of it, kMostDumped at most, and how many it has.
  std::vector<uint8_t> bytes = {};
  size_t size = 0;

  static constexpr size_t kMostDumped = 4096;
};

/// The line about a run: its name, whether it runs, sim time, speed, tick.
ScreenLine RunLine(const RunRow& run);

/// The whole screen: `height` lines of at most `width` cells each, whatever there is to show; both
/// at least 1. Notes in `ui` what can be seen: where lists are scrolled to, so that the selected
/// row is in sight, and how many rows they have.
Screen DrawSpy(const SpySnapshot& spy, const ShownFields& fields, SpyUi* ui, int width, int height);

}  // namespace morphbus::tools
