#pragma once
// Generated C, compiled as strictly as the back end promises and loaded into the test.

#include <filesystem>
#include <string>

#include "compiler/emit/exported.h"

namespace morphbus::test {

class CompiledC {
 public:
  /// Compiles `exported` as `stem`.c, with its companions beside it and more options if need be.
  /// Failures are failures of the test, with the compiler's words.
  CompiledC(const emit::Exported& exported, const std::string& stem,
            const std::string& options = "");
  ~CompiledC();
  CompiledC(const CompiledC&) = delete;
  CompiledC& operator=(const CompiledC&) = delete;

  /// Address of a function or object; nullptr, and a failure, if there is none.
  [[nodiscard]] void* Find(const std::string& symbol) const;

 private:
  std::filesystem::path folder_;
  void* library_ = nullptr;
};

}  // namespace morphbus::test
