#pragma once
// Where an output really goes: behind symbolic links, to a stream of this process, onto an input,
// and what it may take the place of.

#include <string>
#include <string_view>
#include <vector>

#include "compiler/base/result.h"

namespace morphbus::tools {

/// `path` with the symbolic links of its last component followed, also where the last of them
/// points to nothing yet: the file that a program which opens `path` would make. A name of one of
/// this process's streams (compiler/base/read_file.h) is left as it is. Fails for links that lead
/// in a circle.
Result<std::string> FollowLinks(const std::string& path);

/// Whether `path` is standard output: "-", or a name of it as above.
bool IsStdout(const std::string& path);

/// Whether only one file can be written there: "-" (stdout), a stream as above, a pipe, a device.
/// Companion files then have no place to lie, and nothing that is there is replaced.
bool IsStream(const std::string& path);

/// Whether `output` is one of the files `inputs`, by whatever name or link. "-" is none, and
/// neither is a file that does not exist yet.
bool IsOneOf(const std::string& output, const std::vector<std::string>& inputs);

/// What commands write. Each kind begins in a way of its own, by which an earlier output is told
/// from a file of another origin: commands replace the one without asking and spare the other.
struct OutputKind {
  std::string_view name;    ///< With its article, for messages.
  std::string_view starts;  ///< Its first bytes; an empty text fits every file.
  /// What else stands in its first 256 bytes, where the first ones are common.
  std::string_view has = "";
  /// It has no magic bytes, and what it begins with could be a text's: no text is of this kind.
  bool binary = false;
};
namespace outputs {
inline constexpr std::string_view kXml = "<?xml version=";
/// The back ends sign the text files that they write with this.
inline constexpr std::string_view kByExport = "morphbus export";

inline constexpr OutputKind kLog = {"a log", "\xED\xA1\xDA\x01"};
inline constexpr OutputKind kCompressedLog = {"a compressed log", "\x28\xB5\x2F\xFD"};
inline constexpr OutputKind kMcap = {"an MCAP file", "\x89MCAP"};
inline constexpr OutputKind kCsvTable = {"a table of a log", "time [s]"};
inline constexpr OutputKind kJsonLines = {"a log as JSON lines", "{\"event\":"};
inline constexpr OutputKind kDescription = {"a run's description", "\n", "", true};
inline constexpr OutputKind kProgramImage = {"a program image", "DYNI"};
inline constexpr OutputKind kKinematicsImage = {"a kinematics image", "MKIN"};
inline constexpr OutputKind kModel = {"a compiled model", "\n", "", true};
inline constexpr OutputKind kKeywords = {"a module type's keywords", kXml, "\n<module version="};
inline constexpr OutputKind kUrdf = {"a URDF file", kXml, "\n<robot name="};
inline constexpr OutputKind kSdf = {"an SDFormat file", kXml, "\n<sdf version="};
inline constexpr OutputKind kMjcf = {"an MJCF file", kXml, "\n<mujoco model="};
inline constexpr OutputKind kMjcfPart = {"a part of an MJCF file", kXml, "\n<mujocoinclude"};
inline constexpr OutputKind kWebots = {"an exported world of Webots", "#VRML_SIM", kByExport};
/// C, and the Makefile of a controller.
inline constexpr OutputKind kCode = {"exported code", "", kByExport};
inline constexpr OutputKind kMesh = {"an exported mesh", "Morphbus hull"};
inline constexpr OutputKind kCuts = {"a list of cuts", "{\n  \"robot\":", "\"cuts\":"};
inline constexpr OutputKind kDot = {"a graph for Graphviz", "graph \""};
inline constexpr OutputKind kSvg = {"an SVG picture", kXml, "\n<svg "};
inline constexpr OutputKind kPng = {"a PNG picture", "\x89PNG"};
inline constexpr OutputKind kWebp = {"a WebP picture", "RIFF", "WEBP"};
// An MP4 begins with the length of its first part, which is below 256 bytes.
inline constexpr OutputKind kMp4 = {"an MP4 video", {"\0\0\0", 3}, "ftyp", true};
inline constexpr OutputKind kGif = {"a GIF picture", "GIF8"};
inline constexpr OutputKind kPdf = {"a PDF sheet", "%PDF-"};
inline constexpr OutputKind kReport = {"an HTML report", "<!DOCTYPE html>"};
inline constexpr OutputKind kSweepCsv = {"a table of a sweep", "row,"};
inline constexpr OutputKind kSweepJson = {"the rows of a sweep", "[\n{\"row\":"};
inline constexpr OutputKind kSettings = {"settings that were found",
                                         "# Found by morphbus optimise."};
inline constexpr OutputKind kVariants = {"a list of variants", "// ",
                                         ": other connections, the same kinematics."};
inline constexpr OutputKind kManual = {"a manual page of morphbus", ".TH morphbus"};
}  // namespace outputs

/// Fails, with a message for the user, if an output of `kind` must not be written to `path`: if
/// that is one of the files `inputs` that the command reads, or, without `force`, if it takes the
/// place of a file that is neither empty nor begins as such an output does. Streams, paths where
/// nothing is yet, and an empty path (no output) are free.
Result<void> CheckOutput(const std::string& path, const OutputKind& kind, bool force,
                         const std::vector<std::string>& inputs);

/// Whether an output may be written: CheckOutput, whose error is printed on stderr. Commands ask it
/// before they write anything, so that a refusal leaves everything as it was.
bool MayWrite(const std::string& path, const OutputKind& kind, bool force,
              const std::vector<std::string>& inputs);
/// The same for a log, under both its names: PATH.partial while it is written, and PATH.
bool MayWriteLog(const std::string& path, bool force, const std::vector<std::string>& inputs);

}  // namespace morphbus::tools
