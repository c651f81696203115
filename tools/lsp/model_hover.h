#pragma once
// What an editor shows of the name, attribute or docking under the pointer in an M3L file, as
// Markdown.

#include <string>

#include "tools/lsp/workspace.h"

namespace morphbus::tools {

/// The text for byte `offset` of the file itself, and the span that it is about; empty where there
/// is nothing to say.
std::string ModelHover(const ModelFile& file, size_t offset, source::Span* span);

/// What is known of a thing that M3L files name, in one line: "joint joint_1: revolute, -90 to 90
/// degrees, ...". Also for completion, and for programs whose keywords stand for it.
std::string ThingLine(const ModelFile& file, const source::NamedThing& thing);

/// "connection SNAP:3, c1 of HINGE on c4 of HINGE" and where b then is.
std::string ConnectionLines(const model::Model& model, int connection, int option);

}  // namespace morphbus::tools
