#pragma once
// The source of the VM core as text, built in, for programs that are compiled elsewhere.

#include <string>
#include <string_view>
#include <vector>

namespace morphbus::emit {

/// A file of the VM core.
struct VmSource {
  std::string_view path;  ///< As in an #include: "vm/image/pose.h".
  std::string_view text;
};

/// All that the core consists of: headers, tables and sources. CMake fills it in.
const std::vector<VmSource>& VmSources();

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
