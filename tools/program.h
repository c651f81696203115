#pragma once
// DynaRole programs and images as the command line takes them.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "compiler/dynarole/keyword_table.h"
#include "compiler/emit/keywords.h"
#include "compiler/model/robot_model.h"
#include "tools/cli.h"
#include "vm/kinematics_image.h"
#include "vm/pose.h"
#include "vm/program.h"

namespace morphbus::tools {

/// What the DynaRole compiler must know of module types; the numbers in the table are indices into
/// `types`. Fails for over 64 types.
Result<dynarole::KeywordTable> KeywordTableOf(const std::vector<emit::ModuleKeywords>& types);
Result<dynarole::KeywordTable> KeywordTableOf(const model::Model& model);

struct CompiledProgram {
  std::string image;
  uint64_t hash = 0;
};

/// Compiles a program against the module types' keywords, or takes an image as it is (the two are
/// told apart by their first bytes). Prints what is wrong with it.
std::optional<CompiledProgram> CompileProgram(const std::string& path,
                                              const dynarole::KeywordTable& keywords);
std::optional<CompiledProgram> CompileProgram(const std::string& path, const model::Model& model);

/// The verified form; `image` must outlive it. The error says what is damaged and where.
Result<std::unique_ptr<vm::VerifiedProgram>> VerifyProgram(const std::string& image);
Result<std::unique_ptr<vm::VerifiedKinematics>> VerifyKinematicsImage(const std::string& image);
/// Hash in a kinematics image.
Result<uint64_t> KinematicsHash(const std::string& image);

/// A Text of an image as a string.
std::string ToString(const vm::Text& text);

/// A pose in the VM's single precision.
vm::PoseF ToVmPose(const model::Pose& X);

}  // namespace morphbus::tools
