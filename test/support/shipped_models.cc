#include "test/support/shipped_models.h"

#include <cstdio>
#include <filesystem>
#include <utility>

#include "compiler/base/check.h"
#include "compiler/m3l/compile.h"
#include "test/support/source_dir.h"

namespace morphbus::test {
namespace {

model::Model Directed(m3l::CompileOutput output) {
  if (!output.model) {
    std::fprintf(stderr, "%s", source::Render(output.diagnostics, output.sources, false).c_str());
  }
  MORPHBUS_CHECK(output.model.has_value());
  output.model->module_types = std::move(output.solved.module_types);
  return std::move(*output.model);
}

}  // namespace

model::Model DirectedModel(const std::string& path, const std::string& text) {
  return Directed(m3l::CompileText(path, text));
}

std::map<std::string, model::Model> ShippedModels() {
  std::map<std::string, model::Model> models;
  for (const auto& entry : std::filesystem::directory_iterator(SourcePath("models"))) {
    if (entry.path().extension() != ".m3l") continue;
    models[entry.path().filename().string()] = Directed(m3l::CompileFiles({entry.path().string()}));
  }
  return models;
}

}  // namespace morphbus::test
