#pragma once
// The spy's pages about one thing: a channel's fields, a process.

#include <string>

#include "tools/spy/screen.h"
#include "tools/spy/spy_view.h"

namespace morphbus::tools {

/// What is known of a channel (`row` may be null: it has not been heard), above its fields.
Screen ChannelHead(const ChannelRow* row, const std::string& channel, const ShownFields& fields,
                   int width);
/// How many lines the fields of the channel's last message take.
int FieldCount(const ShownFields& fields);
/// `rows` of these lines from number `first` on, with sparklines, for `width` cells. What a field's
/// path has in common with that of the line above is left blank.
Screen FieldLines(const ShownFields& fields, int first, int rows, int width);
/// All that is known of the selected process.
Screen ProcessLines(const SpySnapshot& spy, const SpyUi& ui);

}  // namespace morphbus::tools
