#pragma once
// What programs report of themselves (faults, printed lines), in words.

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "bridge/description/run_model.h"
#include "vm/image/fault_text.h"
#include "vm/image/source_places.h"
#include "vm/module_api.h"

namespace morphbus::bridge {

/// A report in words, with the names that the images have; without an image there are numbers.
struct ReportWords {
  std::string text;
  vm::SourcePlace place;  ///< Where the report comes from; without a file if that is unknown.
  std::string program;    ///< The program's own file, likewise.
  std::string function;   ///< Of a fault: where it happened; empty if in none.
  std::string task;       ///< Of a fault: the function of the task that it has ended.
};

/// The value of a field that a program traces.
struct TracedValue {
  std::string field;  ///< Its name; empty if the program is not known.
  double value = 0;   ///< An int, a float, or 0 and 1 for a bool.
};

/// Whether a program is the one that a run began with, or has only other values of parameters.
bool IsOwnProgram(const RunModel& run, const vm::VerifiedProgram& program);

/// Words the reports of one run: those of the program with which it began, and of those that were
/// deployed while it ran. A copy knows what the original does.
class ProgramWords {
 public:
  /// Of the run that this describes; null: without a description there are numbers for names.
  explicit ProgramWords(std::shared_ptr<const RunModel> run) : run_(std::move(run)) {}

  /// Images that were deployed, by hash, as SENSORS handed them over. They are verified when
  /// they are first asked for.
  std::map<uint64_t, std::string>& deployed() { return deployed_; }
  [[nodiscard]] const std::map<uint64_t, std::string>& deployed() const { return deployed_; }
  /// A fault of a module of this type that ran the program with this hash.
  ReportWords Fault(uint64_t program_hash, const std::string& type, const vm::Fault& fault);
  /// The hash of the image that the source of a program compiles to: its own, unless a run has set
  /// parameters.
  uint64_t SourceHash(uint64_t program_hash);
  /// A printed line, likewise; no text if the program is not known.
  ReportWords Print(uint64_t program_hash, const std::string& type, const vm::PrintReport& print);
  /// Where a line stands that a module says of such a program.
  vm::SourcePlace Place(uint64_t program_hash, int line);
  /// The value of a field that a module with this role traces.
  TracedValue Trace(uint64_t program_hash, int role, const vm::TraceReport& trace);

 private:
  /// The program with this hash; null if it is not known. `file` is set to its own file.
  const vm::VerifiedProgram* Find(uint64_t hash, std::string* file);

  /// What the type has; null if it is not known.
  [[nodiscard]] const vm::VerifiedKinematics* FindKinematics(const std::string& type) const {
    return run_ == nullptr ? nullptr : run_->images.FindKinematics(type);
  }

  std::shared_ptr<const RunModel> run_;
  std::map<uint64_t, std::string> deployed_;
  /// Those that were asked for; null where the verifier refused the image.
  std::map<uint64_t, std::shared_ptr<const ModuleImages>> verified_;
};

}  // namespace morphbus::bridge
