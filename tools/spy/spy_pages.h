#pragma once
// The spy's pages about one thing: a channel's fields, a process, the keys.

#include <string>

#include "tools/spy/screen.h"
#include "tools/spy/spy_view.h"

namespace morphbus::tools {

/// What is known of a channel (`row` may be null: it has not been heard), above its fields.
Screen ChannelHead(const ChannelRow* row, const std::string& channel, const ShownFields& fields);
/// The fields of the channel's last message, with sparklines, for `width` cells.
Screen FieldLines(const ShownFields& fields, int width);
/// All that is known of the selected process.
Screen ProcessLines(const SpySnapshot& spy, const SpyUi& ui);
/// The keys, and what the columns mean.
Screen HelpLines();

}  // namespace morphbus::tools
