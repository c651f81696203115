#pragma once
// Lines of text that come in pieces, over sockets and pipes and from files.

#include <optional>
#include <string>
#include <string_view>

namespace morphbus::tools {

/// Appends what can be read now, 64 KiB at most; waits if there is nothing yet, unless the
/// descriptor does not wait. False at the end, and after an error.
bool ReadSome(int fd, std::string* buffer);

/// Writes all of it. False, with errno set, if the other end is gone or the disk is full.
bool WriteWhole(int fd, std::string_view text);

/// Takes a whole line off the front of the buffer, without its line feed. Nothing if there is none.
std::optional<std::string> TakeLine(std::string* buffer);

}  // namespace morphbus::tools
