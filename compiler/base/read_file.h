#pragma once
// Files that people name, read whole.

#include <cstddef>
#include <optional>
#include <string>

#include "compiler/base/result.h"

namespace morphbus {

/// The file descriptor that /dev/stdin, /dev/stdout, /dev/stderr, /dev/fd/N or /proc/self/fd/N
/// stands for; none for any other path. Such a name is a stream even where it is redirected to a
/// regular file: the file belongs to the shell or program that redirected it, and is neither to be
/// replaced nor written from its start.
std::optional<int> OwnDescriptor(const std::string& path);

/// The content of a file of at most `limit` bytes. Besides regular files it takes streams of this
/// process (OwnDescriptor), such as the pipe behind a shell's `<(command)`, which are read to their
/// end once: reading one again gives the same bytes. Other pipes and devices are refused, since
/// opening or reading them could block or never end. A file that grows while it is read is stopped
/// at the limit. The error is the reason alone, without the path, which callers name in their own
/// words.
Result<std::string> ReadWholeFile(const std::string& path, size_t limit);

}  // namespace morphbus
