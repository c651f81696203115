#include "vm/roles.h"

#include "vm/bodies.h"
#include "vm/motion.h"
#include "vm/scheduler.h"
#include "vm/spatial.h"

namespace morphbus::vm {

namespace {

// Cost units that one requirement or label may use: ample for any sensible one.
constexpr int32_t kEvaluationBudget = 4000;

/// What hangs where, but for joint values: moving joints change nothing here.
uint64_t Structure(const Context& context) {
  Digest digest;
  for (int c = 0; c < context.kinematics.num_connectors(); ++c) {
    const MateRecord& mate = context.state.mates[c];
    digest.Add(mate.docked);
    if (!mate.docked) continue;
    digest.Add(int{mate.module});
    digest.Add(int{mate.mate_connector});
    digest.Add(int{mate.connection_type});
    digest.Add(int{mate.number});
    digest.Add(mate.has_place);
  }
  AddBodies(context, &digest);
  digest.Add(HasFreshPose(context));
  return digest.value();
}

uint64_t NeighbourRoles(const Context& context) {
  Digest digest;
  for (int c = 0; c < context.kinematics.num_connectors(); ++c) {
    digest.Add(int{context.state.mates[c].role});
  }
  return digest.value();
}

/// Follows both digests; true once they have been the same for long enough.
struct Settled {
  bool structure = false;
  bool roles = false;
};

Settled Observe(Context& context) {
  RoleState& role = context.state.role;
  const int64_t tick = context.state.tick;
  const uint64_t structure = Structure(context);
  const uint64_t roles = NeighbourRoles(context);
  if (structure != role.structure) {
    role.structure = structure;
    role.structure_since_tick = tick;
  }
  if (roles != role.neighbour_roles) {
    role.neighbour_roles = roles;
    role.roles_since_tick = tick;
  }
  const int64_t enough = context.program.settle_ticks();
  return {tick - role.structure_since_tick >= enough, tick - role.roles_since_tick >= enough};
}

void ReportEvaluation(Context& context, int role, const RunResult& result) {
  Fault fault;
  fault.code = result.fault;
  fault.role = static_cast<int16_t>(role);
  fault.function = static_cast<int16_t>(result.function);
  fault.line = static_cast<uint16_t>(context.program.LineOf(result.function, result.pc));
  Report(context, fault);
}

enum class Verdict : uint8_t { kFails, kFits, kUnknown };

struct Choice {
  int role = -1;
  int rival = -1;     ///< An unrelated role that fits as well.
  bool wait = false;  ///< A subrole of `role` may fit, once the neighbours' roles have settled.
  RoleCheck check;
};

/// Verdicts on all roles, and among those that fit the most derived. Of unrelated ones the one
/// held, else the first declared.
class Jury {
 public:
  Jury(Context* context, Host* host, const Settled& settled, bool new_structure)
      : context_(*context), host_(*host), settled_(settled), new_structure_(new_structure) {}

  Choice Choose() {
    const int held = context_.state.role.role;
    const VerifiedProgram& program = context_.program;
    if (held >= 0) Judge(held);
    // Only what rests on roles can speak against a role held, if nothing else has changed.
    const bool only_roles = held >= 0 && !new_structure_ && verdicts_[held] == Verdict::kFits;
    for (int role = 0; role < program.num_roles(); ++role) {
      if (role == held || program.role(role).abstract_role) continue;
      Judge(role);
      if (only_roles && !checks_[role].rests_on_roles) verdicts_[role] = Verdict::kFails;
    }
    return MostDerived();
  }

 private:
  void Judge(int role) {
    const bool held = role == context_.state.role.role;
    RoleCheck& check = checks_[role];
    check = CheckRole(context_, host_, role, new_structure_);
    verdicts_[role] = check.fits() ? Verdict::kFits : Verdict::kFails;
    const bool unknown = check.rests_on_roles && !settled_.roles;
    if (unknown) verdicts_[role] = Verdict::kUnknown;
    // Held, it stays until there is settled evidence against it.
    if (held && (unknown || (!new_structure_ && !check.rests_on_roles))) {
      verdicts_[role] = Verdict::kFits;
      for (int i = 0; i < kMaxLabels; ++i) check.labels[i] = context_.state.role.labels[i];
    }
  }

  bool HasSubrole(int role, Verdict verdict) const {
    for (int other = 0; other < context_.program.num_roles(); ++other) {
      if (other != role && verdicts_[other] == verdict && context_.program.IsA(other, role)) {
        return true;
      }
    }
    return false;
  }

  Choice MostDerived() const {
    Choice choice;
    for (int role = 0; role < context_.program.num_roles(); ++role) {
      if (verdicts_[role] != Verdict::kFits || HasSubrole(role, Verdict::kFits)) continue;
      if (choice.role < 0) {
        choice.role = role;
      } else if (choice.rival < 0) {
        choice.rival = role;
      }
      // A rival is no evidence against the role held.
      if (role == context_.state.role.role && choice.role != role) {
        choice.rival = choice.role;
        choice.role = role;
      }
    }
    if (choice.role < 0) return choice;
    choice.check = checks_[choice.role];
    choice.wait =
        choice.role != context_.state.role.role && HasSubrole(choice.role, Verdict::kUnknown);
    return choice;
  }

  Context& context_;
  Host& host_;
  const Settled settled_;
  const bool new_structure_;
  RoleCheck checks_[kMaxRoles];
  Verdict verdicts_[kMaxRoles] = {};
};

/// Notes one more change; false if there were too many, and the role is frozen now.
bool MayChange(Context& context) {
  RoleState& role = context.state.role;
  const int64_t now = context.state.sim_time_us;
  int kept = 0;
  for (int i = 0; i < role.num_changes; ++i) {
    if (now - role.change_us[i] < kRoleChangeWindowUs) role.change_us[kept++] = role.change_us[i];
  }
  role.num_changes = static_cast<uint8_t>(kept);
  if (kept == kMaxRoleChanges) {
    role.frozen = true;
    Report(context, FaultCode::kRoleFlicker);
    return false;
  }
  role.change_us[role.num_changes++] = now;
  return true;
}

void TakeRole(Context& context, int new_role, const RoleCheck& check) {
  RoleState& role = context.state.role;
  role.role = static_cast<int16_t>(new_role);
  const RoleInfo& info = context.program.role(new_role);
  for (int i = 0; i < info.num_labels; ++i) role.labels[i] = check.labels[i];
  for (int i = 0; i < info.num_fields; ++i) role.fields[i] = info.fields[i];
  StartRole(context);
}

bool SameLabels(const Context& context, const RoleCheck& check) {
  const RoleState& role = context.state.role;
  for (int i = 0; i < context.program.role(role.role).num_labels; ++i) {
    if (role.labels[i] != check.labels[i]) return false;
  }
  return true;
}

void ReportAmbiguity(Context& context, const Choice& choice) {
  Fault fault;
  fault.code = FaultCode::kAmbiguousRole;
  fault.role = static_cast<int16_t>(choice.role);
  // The rival, for want of a better place: a status names roles by index.
  fault.value = static_cast<float>(choice.rival);
  Report(context, fault);
}

}  // namespace

RoleCheck CheckRole(Context& context, Host& host, int role, bool report_faults) {
  const VerifiedProgram& program = context.program;
  const RoleInfo& info = program.role(role);
  RoleCheck check;
  for (int i = 0; i < kMaxLabels; ++i) check.labels[i] = -1;
  for (int i = 0; i < info.num_keywords; ++i) {
    if (host.Keyword(info.keywords[i]) < 0) {
      check.missing_keyword = info.keywords[i];
      return check;
    }
  }
  Cell fields[kMaxFields];
  for (int i = 0; i < info.num_fields; ++i) fields[i] = info.fields[i];
  const RoleContext as_role{role, fields, check.labels};
  const auto evaluate = [&](int function) {
    int32_t budget = kEvaluationBudget;
    const RunResult result = Evaluate(program, function, as_role, host, &budget);
    // That a label fits nothing, or several things, is an answer and not a fault.
    const bool fault =
        result.status == RunStatus::kFaulted && result.fault != FaultCode::kUnresolved;
    if (fault && report_faults) ReportEvaluation(context, role, result);
    return result;
  };
  host.TakeReadRoles();
  check.labels_resolve = true;
  for (int i = 0; i < info.num_labels; ++i) {
    const RunResult result = evaluate(info.labels[i].function);
    if (result.status == RunStatus::kFinished) {
      check.labels[i] = static_cast<int8_t>(result.value.AsInt());
    } else if (check.labels_resolve) {
      check.labels_resolve = false;
      check.failed_label = i;
    }
  }
  check.requirements_hold = true;
  for (int i = 0; i < info.num_requirements && check.requirements_hold; ++i) {
    const RunResult result = evaluate(info.requirements[i]);
    if (result.status == RunStatus::kFinished && result.value.AsBool()) continue;
    check.requirements_hold = false;
    check.failed_requirement = i;
  }
  check.rests_on_roles = host.TakeReadRoles();
  return check;
}

void UpdateRole(Context& context, Host& host) {
  RoleState& role = context.state.role;
  const Settled settled = Observe(context);
  if (!settled.structure || role.frozen) return;
  const bool new_structure = !role.evaluated || role.evaluated_structure != role.structure;
  const bool new_roles =
      settled.roles && (!role.evaluated_roles_too || role.evaluated_roles != role.neighbour_roles);
  // A role held is judged once by each state of its surroundings; joints moving within it are no
  // evidence. A module without one goes on looking, for which it must know where it is.
  if (role.role >= 0 && !new_structure && !new_roles) return;
  const bool fresh_pose = HasFreshPose(context);
  if (role.role < 0 && !fresh_pose) return;
  role.evaluated = true;
  role.evaluated_structure = role.structure;
  role.evaluated_roles_too = settled.roles;
  role.evaluated_roles = role.neighbour_roles;

  Choice choice;
  if (fresh_pose) {
    choice = Jury(&context, &host, settled, new_structure).Choose();
    if (choice.wait) {
      role.evaluated = false;
      return;
    }
    if (choice.rival >= 0 && (new_structure || new_roles)) ReportAmbiguity(context, choice);
  } else {
    // Without a fresh pose no role is taken; the one held is judged by the last pose known.
    choice.check = CheckRole(context, host, role.role, new_structure);
    choice.role = choice.check.fits() ? role.role : -1;
  }
  if (choice.role == role.role && (role.role < 0 || SameLabels(context, choice.check))) return;
  if (!MayChange(context)) return;
  LeaveRole(context);
  if (choice.role >= 0) TakeRole(context, choice.role, choice.check);
}

void LeaveRole(Context& context) {
  RoleState& role = context.state.role;
  role.role = -1;
  for (int i = 0; i < kMaxLabels; ++i) role.labels[i] = -1;
  for (int i = 0; i < kMaxFields; ++i) role.fields[i] = Cell{};
  EndTasks(context);
  DropConventions(context);
}

}  // namespace morphbus::vm
