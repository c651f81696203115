#pragma once
// What an editor shows of the name under the pointer in a DynaRole program, as Markdown.

#include <string>

#include "tools/lsp/role_fits.h"
#include "tools/lsp/workspace.h"

namespace morphbus::tools {

/// The text for byte `offset` of the program, and the span that it is about; empty where there is
/// nothing to say.
/// @param fits  of this program, perhaps not complete yet.
std::string ProgramHover(Workspace* workspace, const std::string& program, const RoleFits& fits,
                         size_t offset, source::Span* span);

/// The comment lines that stand right above the line of a byte, without their marks; empty if there
/// are none.
std::string CommentAbove(const source::SourceSet& sources, int file, size_t offset);

/// A part of a module type that a keyword stands for.
struct KeywordPart {
  std::string model;  ///< Path of the model.
  int thing = -1;     ///< Index into the names of that model.
};
/// The parts of the program's models that a keyword stands for: one in each module type that has
/// it.
std::vector<KeywordPart> PartsOfKeyword(Workspace* workspace,
                                        const std::vector<std::string>& models,
                                        const std::string& keyword);
/// The keyword that programs write for a thing of a model; empty for what has none.
std::string KeywordOfThing(const source::NamedThing& thing);

}  // namespace morphbus::tools
