#pragma once
// What an editor marks, writes beside the text, or changes in it: diagnostics, inlay hints,
// formatting, and what the compiler's hints would put in place of an error.

#include <string>

#include "tools/lsp/workspace.h"

namespace morphbus::tools {

/// The diagnostics of a document, with notes as related information. What is wrong in an imported
/// file stands at the import that leads there.
Json DiagnosticsOf(Workspace* workspace, const Document& document, PositionEncoding encoding);

/// Which way a docking chooses, where it does not say it, and where types were found.
Json InlayHintsOf(Workspace* workspace, const Document& document, size_t begin, size_t end,
                  PositionEncoding encoding);

/// The one edit that lays the document out canonically; none if it is so, or does not parse.
Json FormattingOf(const Document& document, PositionEncoding encoding);

/// Quick fixes for the diagnostics within bytes `begin` to `end`: what the hint of each proposes.
Json FixesOf(Workspace* workspace, const Document& document, size_t begin, size_t end,
             PositionEncoding encoding);

}  // namespace morphbus::tools
