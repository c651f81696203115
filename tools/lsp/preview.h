#pragma once
// A robot and the roles that its modules take, for the preview of an editor.

#include <string>

#include "tools/lsp/role_fits.h"
#include "tools/lsp/workspace.h"

namespace morphbus::tools {

/// What a preview of a document shows: "robots", the names among which may be chosen; "robot", the
/// one that is shown (`robot`, else the first); its "svg"; for a program "modules", each with its
/// "module", "role", and the "color" of the role, and whether all robots have been asked
/// ("complete"). Of a model without robots the picture is that of its first module type.
Json PreviewOf(Workspace* workspace, const Document& document, const RoleFits& fits,
               const std::string& robot);

}  // namespace morphbus::tools
