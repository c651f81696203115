#include "compiler/source/utf8.h"

#include "compiler/base/text.h"
#include "compiler/base/utf8.h"

namespace morphbus::source {

void CheckUtf8(const SourceSet& sources, int file, Diagnostics* diagnostics) {
  const std::string_view text = sources.text(file);
  const size_t at = FirstNotUtf8(text);
  if (at == text.size()) return;
  // One error is enough: a file in another encoding has thousands of such bytes.
  const bool more = FirstNotUtf8(text, at + 1) < text.size();
  // The message names the byte, which tells one encoding from another.
  diagnostics
      ->Error({file, at, at + 1}, "byte \\x" + Hex(static_cast<unsigned char>(text[at]), 2) +
                                      " is not UTF-8" + (more ? ", nor are others" : ""))
      .hint = "save the file as UTF-8";
}

}  // namespace morphbus::source
