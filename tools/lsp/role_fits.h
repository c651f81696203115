#pragma once
// Which modules of which robots take the roles of a program, worked out robot by robot while the
// editor waits for nothing.

#include <cstddef>
#include <string>
#include <vector>

#include "tools/lsp/workspace.h"
#include "tools/roles/static_roles.h"

namespace morphbus::tools {

/// What the modules of one robot settled on.
struct RobotFit {
  std::string model;  ///< The model's path.
  std::string robot;
  StaticRoles roles;
};

/// The robots of a program's models and what they make of the program.
class RoleFits {
 public:
  /// Begins anew if the program has changed since.
  void Begin(Workspace* workspace, const std::string& program);
  /// Works on one robot; false if nothing was left to do.
  bool Work(Workspace* workspace);
  /// Whether all robots have been asked.
  [[nodiscard]] bool complete() const { return next_ >= robots_.size(); }
  /// The robots of which some module takes a role, of those that have been asked.
  [[nodiscard]] const std::vector<RobotFit>& fits() const { return fits_; }

 private:
  /// A robot that is to be asked.
  struct Candidate {
    std::string model;
    std::string robot;
  };

  /// Adds the robots of a model that it declares itself (`own`), or that it imports.
  void AddRobots(const ModelFile& model, bool own);

  std::string program_;
  /// The states of the texts that the answers rest on.
  std::vector<TextStamp> stamps_;
  std::vector<Candidate> robots_;
  size_t next_ = 0;
  std::vector<RobotFit> fits_;
};

}  // namespace morphbus::tools
