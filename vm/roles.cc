#include "vm/roles.h"

#include "vm/bodies.h"
#include "vm/motion.h"
#include "vm/scheduler.h"
#include "vm/spatial.h"

namespace morphbus::vm {

namespace {

// Cost units that one requirement or label may use: ample for any sensible one.
constexpr int32_t kEvaluationBudget = 4000;

/// All that requirements and labels rest on, but for joint values: moving joints change nothing
/// here.
uint64_t Surroundings(const Context& context) {
  Digest digest;
  for (int c = 0; c < context.kinematics.num_connectors(); ++c) {
    const MateRecord& mate = context.state.mates[c];
    digest.Add(mate.docked);
    if (!mate.docked) continue;
    digest.Add(int{mate.module});
    digest.Add(int{mate.mate_connector});
    digest.Add(int{mate.connection_type});
    digest.Add(int{mate.number});
    digest.Add(int{mate.role});
    digest.Add(mate.has_place);
  }
  AddBodies(context, &digest);
  digest.Add(HasFreshPose(context));
  return digest.value();
}

void ReportEvaluation(Context& context, int role, const RunResult& result) {
  Fault fault;
  fault.code = result.fault;
  fault.role = static_cast<int16_t>(role);
  fault.function = static_cast<int16_t>(result.function);
  fault.line = static_cast<uint16_t>(context.program.LineOf(result.function, result.pc));
  Report(context, fault);
}

struct Choice {
  int role = -1;
  int rival = -1;  ///< An unrelated role that fits as well.
  RoleCheck check;
};

/// The most derived role that fits. Of unrelated ones the one held, else the first declared.
Choice Choose(Context& context, ProgramHost& host, bool report_faults) {
  const VerifiedProgram& program = context.program;
  RoleCheck checks[kMaxRoles];
  const auto has_fitting_subrole = [&](int role) {
    for (int other = 0; other < program.num_roles(); ++other) {
      if (other != role && checks[other].fits() && program.IsA(other, role)) return true;
    }
    return false;
  };
  for (int role = 0; role < program.num_roles(); ++role) {
    if (program.role(role).abstract_role) continue;
    checks[role] = CheckRole(context, host, role, report_faults);
  }
  Choice choice;
  for (int role = 0; role < program.num_roles(); ++role) {
    if (!checks[role].fits() || has_fitting_subrole(role)) continue;
    if (choice.role < 0) {
      choice.role = role;
    } else if (choice.rival < 0) {
      choice.rival = role;
    }
    // A role once held stays until there is evidence against it; a rival is none.
    if (role == context.state.role.role && choice.role != role) {
      choice.rival = choice.role;
      choice.role = role;
    }
  }
  if (choice.role >= 0) choice.check = checks[choice.role];
  return choice;
}

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

RoleCheck CheckRole(Context& context, ProgramHost& host, int role, bool report_faults) {
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
  return check;
}

void UpdateRole(Context& context, ProgramHost& host) {
  RoleState& role = context.state.role;
  const uint64_t key = Surroundings(context);
  if (key != role.key) {
    role.key = key;
    role.key_since_tick = context.state.tick;
  }
  const bool settled = context.state.tick - role.key_since_tick >= context.program.settle_ticks();
  if (!settled || role.frozen) return;
  const bool new_key = !role.evaluated || role.evaluated_key != key;
  // A role held is judged once by each state of its surroundings; joints moving within it are no
  // evidence. A module without one goes on looking, for which it must know where it is.
  if (role.role >= 0 && !new_key) return;
  const bool fresh_pose = HasFreshPose(context);
  if (role.role < 0 && !fresh_pose) return;
  role.evaluated = true;
  role.evaluated_key = key;

  Choice choice;
  if (fresh_pose) {
    choice = Choose(context, host, new_key);
    if (choice.rival >= 0 && new_key) ReportAmbiguity(context, choice);
  } else {
    choice.check = CheckRole(context, host, role.role, new_key);
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
