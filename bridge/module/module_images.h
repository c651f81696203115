#pragma once
// What modules are made of: images of a program and of kinematics, which come as bytes.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "compiler/base/result.h"
#include "vm/image/kinematics_image.h"
#include "vm/image/program.h"

namespace morphbus::bridge {

/// The program image and the module types' kinematics images of one process, verified, each once.
/// Stays where it is: instances point into it.
class ModuleImages {
 public:
  ModuleImages() = default;
  ModuleImages(const ModuleImages&) = delete;
  ModuleImages& operator=(const ModuleImages&) = delete;

  /// Verifies the program image and keeps it, in place of an earlier one. `name` is what an error
  /// calls it; the error also says which byte of the image is wrong, and why.
  Result<void> AddProgram(const std::string& name, std::vector<uint8_t> bytes);
  /// Verifies a kinematics image and keeps it under `name`, which is also what an error calls it.
  Result<void> AddKinematics(const std::string& name, std::vector<uint8_t> bytes);

  /// The program of all modules of the process. Valid once AddProgram has succeeded.
  [[nodiscard]] const vm::VerifiedProgram& program() const { return program_; }
  /// Null if none was added under this name.
  [[nodiscard]] const vm::VerifiedKinematics* FindKinematics(const std::string& name) const;

 private:
  /// An image and what the verifier made of it, which points into the bytes.
  struct Kinematics {
    std::vector<uint8_t> bytes;
    vm::VerifiedKinematics verified;
  };
  // What is verified points into the bytes, so neither may move.
  std::vector<uint8_t> program_bytes_;
  vm::VerifiedProgram program_;
  std::map<std::string, Kinematics> kinematics_;
};

}  // namespace morphbus::bridge
