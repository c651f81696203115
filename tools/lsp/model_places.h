#pragma once
// What stands at a place of an M3L file: the definition, its attribute, the docking.

#include <cstddef>
#include <optional>
#include <string>

#include "tools/lsp/workspace.h"

namespace morphbus::tools {

/// The attribute that a place is in, with what it belongs to. Pointers are into the file's trees.
struct AttributePlace {
  /// "module", "joint", ...; of an argument of a part of a hull that part, "box".
  std::string definition;
  const m3l::Declaration* declaration = nullptr;
  /// The module that it stands in; null in connections and robots.
  const m3l::ModuleDecl* module = nullptr;
  std::string name;
  source::Span name_span;
  /// The value, null for a flag.
  const m3l::Expr* value = nullptr;
};

/// The attribute at byte `offset` of the file itself; nothing outside of attributes.
std::optional<AttributePlace> AttributeAt(const ModelFile& file, size_t offset);

/// A docking of a robot of the model, by its indices.
struct DockingPlace {
  int robot = 0;
  int docking = 0;
};
/// The docking at a byte of the file itself; nothing where the model has errors.
std::optional<DockingPlace> DockingAt(const ModelFile& file, size_t offset);

/// Metres per model unit of a module type by its name, 1 if it is not known.
double UnitOf(const ModelFile& file, const std::string& module);

}  // namespace morphbus::tools
