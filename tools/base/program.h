#pragma once
// DynaRole programs and images as the command line takes them.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "compiler/keywords/module_keywords.h"
#include "compiler/model/robot_model.h"
#include "vm/image/image_texts.h"
#include "vm/image/kinematics_image.h"
#include "vm/image/opcodes.h"
#include "vm/image/pose.h"
#include "vm/image/program.h"

namespace morphbus::tools {

/// A program image that the verifier has passed. It owns its bytes: what VerifyProgram makes of
/// them refers to them.
struct CompiledProgram {
  std::string image;
  /// The hash in the image's header, by which the simulator makes sure that all modules of a run
  /// have the same program.
  uint64_t hash = 0;
};

/// Loads the program at `path`: compiles its text against the keywords of these module types, at
/// most 64, or takes an image as it is (the two are told apart by their first bytes). Nothing,
/// after printing what is wrong, if it cannot be used.
std::optional<CompiledProgram> LoadProgram(
    const std::string& path, const Result<std::vector<keywords::ModuleKeywords>>& types);

/// The verified form of a program or a kinematics image, which alone the VM accepts; `image` must
/// outlive it. The error says what is damaged, and at which byte.
Result<std::unique_ptr<vm::VerifiedProgram>> VerifyProgram(const std::string& image);
Result<std::unique_ptr<vm::VerifiedKinematics>> VerifyKinematicsImage(const std::string& image);
/// Where a program has instructions that `wanted` is true of: lines as VerifiedProgram::LineOf
/// counts them (0 where the image holds none), and mnemonics, each once and in order.
struct InstructionPlaces {
  std::vector<int> lines;
  std::vector<std::string> mnemonics;
};
InstructionPlaces FindInstructions(const vm::VerifiedProgram& program,
                                   const std::function<bool(vm::Opcode)>& wanted);
/// The hash in the header of a verified program image.
uint64_t HashOfImage(const std::string& image);
/// The hash in a kinematics image. Fails for an image that is damaged.
Result<uint64_t> KinematicsHash(const std::string& image);

}  // namespace morphbus::tools
