#pragma once
// Sources of ours as text, built in, for programs that are compiled elsewhere: the VM core, and the
// controller of modules in Webots.

#include <string>
#include <string_view>
#include <vector>

namespace morphbus::emit {

/// A file of this project.
struct SourceFile {
  std::string_view path;  ///< As in an #include: "vm/image/pose.h".
  std::string_view text;
};

/// All that CMake has built in: sources of the VM core and of what words its values, every header
/// and table of vm/, and webots_controller/.
const std::vector<SourceFile>& ShippedSources();

/// The text of the one at `path`, which must be there.
std::string_view ShippedSource(std::string_view path);

/// The core as two files.
struct MergedVm {
  std::string header;  ///< What a program needs that runs a VM.
  std::string source;  ///< Everything else; it includes the header by the name given.
};

/// Puts every header in the place of its first #include, so that the two files need only the
/// standard library, a compiler for C++20, and `-ffp-contract=off` on processors that would
/// contract a product and a sum.
MergedVm MergeVm(const std::string& header_name);

}  // namespace morphbus::emit
