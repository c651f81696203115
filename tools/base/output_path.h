#pragma once
// Where an output really goes: behind symbolic links, to a stream of this process, onto an input,
// and what it may take the place of.

#include <optional>
#include <string>
#include <vector>

#include "compiler/base/result.h"

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
/// Companion files then have no place to lie, and nothing that is there is replaced.
bool IsStream(const std::string& path);

/// Whether `output` is one of the files `inputs`, by whatever name or link. "-" is none, and
/// neither is a file that does not exist yet.
bool IsOneOf(const std::string& output, const std::vector<std::string>& inputs);

/// What commands write. Each kind begins in a way of its own (the table in output_path.cc), by
/// which an earlier output is told from somebody's own file: commands replace the one without
/// asking and spare the other.
enum class OutputKind {
  kLog,
  kProgramImage,
  kKinematicsImage,
  kModel,
  kKeywords,
  kUrdf,
  kSdf,
  kMjcf,
  kMjcfPart,
  kWebots,
  kCode,  ///< C, and the Makefile of a controller.
  kMesh,
  kCuts,
  kDot,
  kSvg,
  kPng,
  kReport,
  kVariants,
};

/// Fails, with a message for the user, if an output of `kind` must not be written to `path`: if
/// that is one of the files `inputs` that the command reads, or, without `force`, if it takes the
/// place of a file that is neither empty nor begins as such an output does. Streams, paths where
/// nothing is yet, and an empty path (no output) are free.
Result<void> CheckOutput(const std::string& path, OutputKind kind, bool force,
                         const std::vector<std::string>& inputs);

/// Whether an output may be written: CheckOutput, whose error is printed on stderr. Commands ask it
/// before they write anything, so that a refusal leaves everything as it was.
bool MayWrite(const std::string& path, OutputKind kind, bool force,
              const std::vector<std::string>& inputs);
/// The same for a log, under both its names: PATH.partial while it is written, and PATH.
bool MayWriteLog(const std::string& path, bool force, const std::vector<std::string>& inputs);

}  // namespace morphbus::tools
