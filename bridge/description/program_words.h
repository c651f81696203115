#pragma once
// What programs report of themselves (faults, printed lines), in words.

#include <cstdint>
#include <map>
#include <memory>
#include <string>

#include "bridge/module/module_images.h"
#include "vm/image/fault_text.h"
#include "vm/module_api.h"

namespace morphbus::bridge {

/// A report in words, with the names that the images have; without an image there are numbers.
struct ReportWords {
  std::string text;
  std::string file;      ///< The program's source file; empty if unknown.
  std::string function;  ///< Of a fault: where it happened; empty if in none.
  std::string task;      ///< Of a fault: the function of the task that it has ended.
};

/// Words the reports of one run: those of the program with which it began, and of those that were
/// deployed while it ran. A copy knows what the original does.
class ProgramWords {
 public:
  /// `images` has the kinematics of the module types, and its program if `has_program`; it outlives
  /// this. `program_hash` and `file` are those of the description.
  ProgramWords(const ModuleImages* images, bool has_program, uint64_t program_hash,
               std::string file);

  /// Images that were deployed, by hash, as SENSORS handed them over. They are verified when
  /// they are first asked for.
  std::map<uint64_t, std::string>& deployed() { return deployed_; }
  /// A fault of a module of this type that ran the program with this hash.
  ReportWords Fault(uint64_t program_hash, const std::string& type, const vm::Fault& fault);
  /// A printed line, likewise; no text if the program is not known.
  ReportWords Print(uint64_t program_hash, const std::string& type, const vm::PrintReport& print);

 private:
  /// The program with this hash; null if it is not known. `file` is set to its source.
  const vm::VerifiedProgram* Find(uint64_t hash, std::string* file);

  const ModuleImages* images_;
  const vm::VerifiedProgram* program_;
  uint64_t program_hash_;
  std::string file_;
  std::map<uint64_t, std::string> deployed_;
  /// Those that were asked for; null where the verifier refused the image.
  std::map<uint64_t, std::shared_ptr<const ModuleImages>> verified_;
};

}  // namespace morphbus::bridge
