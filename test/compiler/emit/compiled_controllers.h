#pragma once
// The controllers that belong to an exported Webots world, compiled and loaded into the test.

#include <filesystem>
#include <functional>
#include <vector>

#include "compiler/emit/exported.h"

namespace morphbus::test {

/// The controller of a robot whose modules are all of one type. Webots' functions are those of the
/// test program.
class CompiledControllers {
 public:
  /// Compiles the companions of `world` as their Makefile says, once, and loads them as often as
  /// there are modules, each with variables of its own. Failures are failures of the test.
  CompiledControllers(const emit::Exported& world, size_t num_modules);
  ~CompiledControllers();
  CompiledControllers(const CompiledControllers&) = delete;
  CompiledControllers& operator=(const CompiledControllers&) = delete;

  /// The main function of each module.
  [[nodiscard]] const std::vector<std::function<void()>>& mains() const { return mains_; }

 private:
  /// Loads a copy of the library.
  void Load(const std::filesystem::path& library, size_t module);

  std::filesystem::path folder_;
  std::vector<void*> libraries_;
  std::vector<std::function<void()>> mains_;
};

}  // namespace morphbus::test
