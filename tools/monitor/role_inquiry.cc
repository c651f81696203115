#include "tools/monitor/role_inquiry.h"

#include <algorithm>
#include <utility>

#include "tools/roles/role_explanation.h"
#include "tools/roles/static_roles.h"

namespace morphbus::tools {
namespace {

/// Questions that wait at most; a page asks one after the other.
constexpr size_t kMostWaiting = 16;

}  // namespace

bool IsRoleService(const std::string& service) {
  return service == "missing_roles" || service == "explain_role";
}

RoleQuestion RoleQuestionIn(const nlohmann::json& request) {
  const auto text = [&](const char* name) {
    const auto found = request.find(name);
    return found != request.end() && found->is_string() ? found->get<std::string>() : "";
  };
  return {text("module"), text("role")};
}

RobotStanding StandingOf(const bridge::Converter& now) {
  RobotStanding standing;
  standing.time_us = now.time_us();
  const auto& modules = now.run().robot->modules;
  for (size_t m = 0; m < modules.size(); ++m) {
    const std::string& name = modules[m].name;
    const morphbus::ModuleState& state = now.states()[m];
    standing.situation.docked[name] = now.dockings()[m];
    if (!now.positions()[m].empty()) standing.situation.positions[name] = now.positions()[m];
    if (state.lost()) {
      standing.situation.silent.insert(name);
    } else if (state.role().empty()) {
      if (standing.without_role.empty()) {
        standing.program_image = now.DeployedImage(state.program_hash());
      }
      standing.without_role.push_back(name);
    }
  }
  if (standing.without_role.empty() && !modules.empty()) {
    standing.program_image = now.DeployedImage(now.states()[0].program_hash());
  }
  return standing;
}

RoleInquiry::RoleInquiry(std::string description)
    : description_(std::move(description)), thread_([this] { Work(); }) {}

RoleInquiry::~RoleInquiry() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  asked_.notify_one();
  thread_.join();
}

void RoleInquiry::Ask(RoleQuestion question, Find find, Done done) {
  {
    const std::lock_guard lock(mutex_);
    if (waiting_.size() < kMostWaiting) {
      waiting_.push_back({std::move(question), std::move(find), std::move(done)});
      return asked_.notify_one();
    }
  }
  done(Fail("too many questions about roles wait; ask again later"));
}

void RoleInquiry::Work() {
  std::unique_lock lock(mutex_);
  while (true) {
    asked_.wait(lock, [this] { return stop_ || !waiting_.empty(); });
    if (stop_) return;
    const Waiting next = std::move(waiting_.front());
    waiting_.pop_front();
    // Others may ask while this one is answered.
    lock.unlock();
    Result<RobotStanding> standing = next.find();
    // The end of the monitor does not wait for a large robot to settle.
    if (standing) standing->situation.stop = &stop_;
    next.done(standing ? Answer(next.question, *standing) : Fail(standing.error().message));
    lock.lock();
  }
}

Result<Json> RoleInquiry::Answer(const RoleQuestion& question,
                                 const RobotStanding& standing) const {
  Result<RunPlan> plan = PlanFromDescription(description_);
  if (!plan) return Fail(plan.error().message);
  if (!standing.program_image.empty()) {
    plan->description.set_program_image(standing.program_image);
  }
  Result<Json> answer =
      question.module.empty() ? MissingRoles(*plan, standing) : OneRole(*plan, question, standing);
  if (answer) (*answer)["time_us"] = standing.time_us;
  return answer;
}

Result<Json> RoleInquiry::MissingRoles(const RunPlan& plan, const RobotStanding& standing) {
  Json modules = Json::object();
  // Mostly all have one, and then nothing needs to settle.
  if (standing.without_role.empty()) return Json{{"modules", modules}};
  const Result<StaticRoles> roles = SettleRoles(plan, &standing.situation);
  if (!roles) return Fail(roles.error().message);
  for (const StaticRole& module : roles->modules) {
    if (std::ranges::find(standing.without_role, module.module) == standing.without_role.end()) {
      continue;
    }
    Json& lines = modules[module.module] = Json::array();
    // It may not have had the time to take it, or have lost it by how it moved.
    if (!module.role.empty()) {
      lines.push_back(
          {{"text", "where it stands it fits " + module.role}, {"file", ""}, {"line", 0}});
    }
    for (const RoleProblem& problem : module.problems) {
      lines.push_back(
          {{"text", problem.brief}, {"file", problem.place.file}, {"line", problem.place.line}});
    }
  }
  return Json{{"modules", modules}};
}

Result<Json> RoleInquiry::OneRole(const RunPlan& plan, const RoleQuestion& question,
                                  const RobotStanding& standing) {
  const auto all = ExplainRoles(plan, question.module, question.role, &standing.situation);
  if (!all) return Fail(all.error().message);
  const RoleExplanation& role = all->front();
  Json parts = Json::array();
  for (const ExplainedPart& part : role.parts) {
    parts.push_back({{"label", part.label},
                     {"file", part.place.file},
                     {"line", part.place.line},
                     {"holds", part.holds},
                     {"finding", part.finding}});
  }
  return Json{{"module", role.module},   {"role", role.role}, {"file", role.place.file},
              {"line", role.place.line}, {"fits", role.fits}, {"lacks", role.lacks},
              {"parts", parts}};
}

}  // namespace morphbus::tools
