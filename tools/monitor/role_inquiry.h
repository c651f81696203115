#pragma once
// Why modules have a role or none, for viewers: what `morphbus roles` says, of a robot as it
// stands.

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "bridge/outward/converter.h"
#include "compiler/base/result.h"
#include "tools/base/json.h"
#include "tools/plan/run_plan.h"
#include "tools/roles/static_robot.h"

namespace morphbus::tools {

/// A robot at one instant of its run.
struct RobotStanding {
  int64_t time_us = 0;  ///< Sim time.
  Situation situation;
  /// Modules without a role that the run has not lost.
  std::vector<std::string> without_role;
  /// The image that the first of these runs, else the first module, if it was deployed during the
  /// run; else empty.
  std::string program_image;
};

/// What somebody wants to know.
struct RoleQuestion {
  /// What a role asks for and what the module has of it. Empty: what modules without a role lack.
  std::string module, role;
};

/// Whether a service of a source is a question about roles: "missing_roles" or "explain_role".
bool IsRoleService(const std::string& service);
/// The question in a request: "module" and "role" of one to be explained, nothing otherwise.
RoleQuestion RoleQuestionIn(const nlohmann::json& request);

/// Where a run is that a converter has followed.
RobotStanding StandingOf(const bridge::Converter& now);

/// Answers one question after the other in a thread of its own: to let a large robot settle takes
/// seconds.
class RoleInquiry {
 public:
  /// Finds the instant that is asked for; called in the inquiry's thread.
  using Find = std::function<Result<RobotStanding>()>;
  /// Gets {"time_us","modules":{"m3":[{"text","line"}]}}, of one role {"time_us","module","role",
  /// "line","fits","lacks","parts":[{"label","line","holds","finding"}]}, or why there is no
  /// answer; called in the inquiry's thread.
  using Done = std::function<void(const Result<Json>&)>;

  /// `description` is the run's, serialized.
  explicit RoleInquiry(std::string description);
  /// Finishes the question that is under way, and drops those that wait.
  ~RoleInquiry();
  RoleInquiry(const RoleInquiry&) = delete;
  RoleInquiry& operator=(const RoleInquiry&) = delete;

  /// Puts a question behind those that wait. Refused at once if too many do.
  void Ask(RoleQuestion question, Find find, Done done);

 private:
  struct Waiting {
    RoleQuestion question;
    Find find;
    Done done;
  };
  void Work();
  [[nodiscard]] Result<Json> Answer(const RoleQuestion& question,
                                    const RobotStanding& standing) const;
  /// What the roles lack, by module.
  [[nodiscard]] static Result<Json> MissingRoles(const RunPlan& plan,
                                                 const RobotStanding& standing);
  /// What a role asks of a module, and what it finds there.
  [[nodiscard]] static Result<Json> OneRole(const RunPlan& plan, const RoleQuestion& question,
                                            const RobotStanding& standing);

  std::string description_;
  std::mutex mutex_;  ///< Guards the three below.
  std::condition_variable asked_;
  std::deque<Waiting> waiting_;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

}  // namespace morphbus::tools
