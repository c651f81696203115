#include "compiler/emit/shipped_sources.h"

#include <algorithm>
#include <optional>
#include <set>

#include "compiler/base/check.h"

namespace morphbus::emit {
namespace {

/// What a program includes that runs a VM.
constexpr std::string_view kInterface[] = {"vm/vm.h",
                                           "vm/image/verifier.h",
                                           "vm/image/kinematics_verifier.h",
                                           "vm/image/print_line.h",
                                           "vm/image/directions.h",
                                           "vm/spread/packet.h"};

/// The path in a line `#include "vm/..."`; nothing for other lines.
std::optional<std::string_view> IncludedPath(std::string_view line) {
  constexpr std::string_view kBegin = "#include \"";
  if (!line.starts_with(kBegin)) return std::nullopt;
  line.remove_prefix(kBegin.size());
  return line.substr(0, line.find('"'));
}

/// Writes files one behind the other, each #include replaced by what it stands for.
class Merger {
 public:
  /// Adds a file, unless it is a header that has been added already. Tables (.def) and handlers
  /// (.inc) mean something else at each place.
  void Add(std::string_view path, std::string* out) {
    if (path.ends_with(".h") && !added_.insert(path).second) return;
    std::string_view text = ShippedSource(path);
    while (!text.empty()) {
      const size_t end = std::min(text.find('\n'), text.size() - 1);
      const std::string_view line = text.substr(0, end + 1);
      text.remove_prefix(end + 1);
      if (const std::optional<std::string_view> included = IncludedPath(line)) {
        // A file stands where it is first included, before what needs it; a later #include of it
        // stands for nothing.
        Add(*included, out);
      } else if (!line.starts_with("#pragma once")) {
        out->append(line);
      }
    }
  }

 private:
  std::set<std::string_view> added_;
};

}  // namespace

std::string_view ShippedSource(std::string_view path) {
  const std::vector<SourceFile>& all = ShippedSources();
  const auto file = std::ranges::find(all, path, &SourceFile::path);
  MORPHBUS_CHECK(file != all.end());
  return file->text;
}

MergedVm MergeVm(const std::string& header_name) {
  const std::string origin =
      "// Merged from the sources of Morphbus (BSD 3-Clause License, Copyright (c) 2026, the "
      "Morphbus authors).\n// Written by morphbus export, not by hand.\n";
  Merger merger;
  MergedVm merged{origin + "#pragma once\n\n", origin + "#include \"" + header_name + "\"\n\n"};
  // The same merger writes both, so that the source holds no header that the one file above has.
  for (const std::string_view path : kInterface) merger.Add(path, &merged.header);
  for (const SourceFile& file : ShippedSources()) {
    const bool of_vm = file.path.starts_with("vm/") && file.path.ends_with(".cc");
    if (of_vm) merger.Add(file.path, &merged.source);
  }
  return merged;
}

}  // namespace morphbus::emit
