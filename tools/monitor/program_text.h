#pragma once
// DynaRole programs for the monitor: the text of one that runs, and new ones that a viewer sends.

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "compiler/base/result.h"
#include "compiler/model/robot_model.h"
#include "tools/base/program.h"

namespace morphbus::tools {

/// Finds the text of programs by the hash of their images. A file is believed only if it still
/// compiles to that image, so a line of it is the line that ran. May be used by several threads.
class ProgramTexts {
 public:
  /// Programs are compiled for `model`, which outlives this.
  explicit ProgramTexts(const model::Model& model) : model_(model) {}

  /// The text of the program with this hash, from the file at `path` or as it was compiled here;
  /// empty if neither is that program.
  std::string Find(uint64_t hash, const std::string& path);

  /// Compiles a text that a viewer sent; `name` is what diagnostics call its file. Fails with the
  /// compiler's diagnostics, or with why the program does not fit the model.
  Result<CompiledProgram> Compile(const std::string& name, const std::string& text);

 private:
  const model::Model& model_;
  std::mutex mutex_;                          ///< Guards `compiled_`.
  std::map<uint64_t, std::string> compiled_;  ///< Texts by hash; 64 at most.
};

}  // namespace morphbus::tools
