#pragma once
// DynaRole programs for the monitor: the text of one that runs, and new ones that a viewer sends.

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "bridge/outward/converter.h"
#include "compiler/base/result.h"
#include "compiler/model/robot_model.h"
#include "compiler/source/import_reader.h"
#include "tools/base/program.h"

namespace morphbus::tools {

/// Finds the text of programs by the hash of their images. A file is believed only if it still
/// compiles to that image, so a line of it is the line that ran. May be used by several threads.
class ProgramTexts {
 public:
  /// Programs are compiled for `model`, which outlives this. `program_file` is the path of the
  /// run's program.
  ProgramTexts(const model::Model& model, std::string program_file)
      : model_(model), program_file_(std::move(program_file)) {}

  /// The texts of the program with this hash, from the file at `path` and what it imports, or as it
  /// was compiled here; none if neither is that program.
  bridge::SourceTexts Find(uint64_t hash, const std::string& path);

  /// Compiles a text that a viewer sent; `name` is what diagnostics call its file. It may import
  /// what the run's program does and nothing else, as diagnostics quote what they read. Fails with
  /// the compiler's diagnostics, or with why the program does not fit the model.
  Result<CompiledProgram> Compile(const std::string& name, const std::string& text);

 private:
  Result<CompiledProgram> Compile(const std::string& name, const std::string& text,
                                  const source::TextReader& read);
  /// A file that the run's program imports; `path` may be relative to the folder of that.
  [[nodiscard]] Result<std::string> ReadImported(const std::string& path) const;

  const model::Model& model_;
  std::string program_file_;
  std::mutex mutex_;                                  ///< Guards `compiled_`.
  std::map<uint64_t, bridge::SourceTexts> compiled_;  ///< By hash; 64 at most.
};

}  // namespace morphbus::tools
