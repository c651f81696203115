#pragma once
// The compiler of M3L, the language of modules, connections and robots (docs/m3l.md).
//
// Library morphbus-m3l. Its functions may be called from any number of threads at once.

#include <morphbus/diagnostic.h>
#include <morphbus/model/model.h>

#include <string>
#include <string_view>
#include <vector>

namespace morphbus {

/// Compiles a file and what it imports. Throws TextError where they have errors, or cannot be read.
/// @param warnings  if not null, gets the warnings of a text without errors.
MORPHBUS_EXPORT Model CompileM3l(const std::string& path,
                                 std::vector<Diagnostic>* warnings = nullptr);
/// The same for a text in memory. `name` stands for the file's name in diagnostics, and for where
/// it lies: what the text imports is read from the disk, relative to the folder of that name.
MORPHBUS_EXPORT Model CompileM3lText(const std::string& name, const std::string& text,
                                     std::vector<Diagnostic>* warnings = nullptr);
/// The text in canonical layout, as `morphbus format` writes it. Throws TextError where it does not
/// parse.
MORPHBUS_EXPORT std::string FormatM3l(const std::string& name, const std::string& text);

}  // namespace morphbus
