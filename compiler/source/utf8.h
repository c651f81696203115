#pragma once
// Source files are UTF-8 (RFC 3629); what is not is reported before anything is made of it, so that
// names, strings and excerpts can go to JSON, XML and terminals as they are.

#include <string_view>

#include "compiler/source/diagnostics.h"

namespace morphbus::source {

/// Bytes of the character that begins at `at`; 0 if none does there: a stray or missing
/// continuation byte, an overlong form, a surrogate, beyond U+10FFFF.
size_t Utf8Length(std::string_view text, size_t at);

/// True if all of `text` is UTF-8.
bool IsUtf8(std::string_view text);

/// One error at the first byte of file `file` that is not UTF-8, if there is one.
void CheckUtf8(const SourceSet& sources, int file, Diagnostics& diagnostics);

}  // namespace morphbus::source
