#pragma once
// What the words of a command line are about, while it is still being typed.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "compiler/model/robot_model.h"
#include "tools/shell/completion.h"
#include "vm/image/program.h"

namespace morphbus::tools {

/// A model with its robots, and a program: those of the files on the line. Where it names no M3L
/// file they are those of the log on it, else those of the run that goes on here. What cannot be
/// used is as good as not there; stderr says why.
class LineSubject {
 public:
  explicit LineSubject(const TypedLine& line);

  /// Null without one. It lives as long as the subject.
  [[nodiscard]] const model::Model* model() const { return model_ ? &*model_ : nullptr; }
  /// The robots of the model that are meant: that of --robot or of the run, else all.
  [[nodiscard]] std::vector<const model::Robot*> Robots() const;
  /// The program, verified; null without one. It refers to the subject.
  [[nodiscard]] std::unique_ptr<vm::VerifiedProgram> Program() const;
  /// The name of the run or of the log's run; empty without one.
  [[nodiscard]] const std::string& run() const { return run_; }

 private:
  /// Takes model, robot and program from the description of one of these files, else of a run.
  void TakeDescription(const std::vector<std::string>& files, const std::string& run);

  std::optional<model::Model> model_;
  std::string robot_, run_;
  std::string image_;  ///< The program's.
};

}  // namespace morphbus::tools
