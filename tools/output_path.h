#pragma once
// Where an output really goes: behind symbolic links, to a stream of this process, onto an input.

#include <optional>
#include <string>
#include <vector>

#include "compiler/source/result.h"

namespace morphbus::tools {

/// `path` with the symbolic links of its last component followed, also where the last of them
/// points to nothing yet: the file that a program which opens `path` would make. A name of one of
/// this process's streams (OwnDescriptor) is left as it is. Fails for links that lead in a circle.
Result<std::string> FollowLinks(const std::string& path);

/// The file descriptor that /dev/stdout, /dev/stderr, /dev/fd/N or /proc/self/fd/N stands for; none
/// for any other path. Such a name is a stream even where it is redirected to a regular file: the
/// file belongs to whoever redirected it, and is neither to be replaced nor written from its start.
std::optional<int> OwnDescriptor(const std::string& path);

/// Whether `path` is standard output: "-", or a name of it as above.
bool IsStdout(const std::string& path);

/// Whether only one file can be written there: "-" (stdout), a stream as above, a pipe, a device.
bool IsStream(const std::string& path);

/// Whether `output` is one of the files `inputs`, by whatever name or link. "-" is none.
bool IsOneOf(const std::string& output, const std::vector<std::string>& inputs);

}  // namespace morphbus::tools
