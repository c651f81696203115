#include <morphbus/m3l/m3l.h>

#include <utility>

#include "compiler/m3l/compile.h"
#include "compiler/m3l/format.h"
#include "tools/libraries/diagnostics.h"
#include "tools/libraries/model_content.h"

namespace morphbus {
namespace {

/// The model that was compiled; throws TextError where there is none.
Model ToPublic(m3l::CompileOutput output, std::vector<Diagnostic>* warnings) {
  ThrowOnErrors(output.diagnostics, output.sources, warnings);
  return Model(std::make_shared<Model::Content>(std::move(*output.model)));
}

}  // namespace

Model CompileM3l(const std::string& path, std::vector<Diagnostic>* warnings) {
  return ToPublic(m3l::CompileFiles({path}), warnings);
}

Model CompileM3lText(const std::string& name, const std::string& text,
                     std::vector<Diagnostic>* warnings) {
  return ToPublic(m3l::CompileText(name, text), warnings);
}

std::string FormatM3l(const std::string& name, const std::string& text) {
  return FormatOrThrow(name, text, m3l::Format);
}

}  // namespace morphbus
