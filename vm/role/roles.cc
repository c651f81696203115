#include "vm/role/roles.h"

#include "vm/role/motion.h"
#include "vm/role/scheduler.h"
#include "vm/space/bodies.h"
#include "vm/space/spatial.h"

namespace morphbus::vm {

namespace {

// Cost units that one requirement or label may use: ample for any sensible one.
constexpr int32_t kEvaluationBudget = 4000;

/// What hangs where, but for joint values: moving joints change nothing here.
uint64_t Structure(const Context& context) {
  Digest digest;
  for (int c = 0; c < context.kinematics.num_connectors(); ++c) {
    const NeighbourRecord& neighbour = context.state.neighbours[c];
    const ConnectorReading& sensor = neighbour.sensor;
    digest.Add(sensor.docked);
    if (!sensor.docked) continue;
    digest.Add(sensor.mate_module, sensor.mate_connector, sensor.connection_type, sensor.number,
               neighbour.has_place);
  }
  AddBodies(context, &digest);
  digest.Add(HasFreshPose(context));
  return digest.value();
}

/// Which roles the neighbours play; the other half of what requirements may rest on.
uint64_t NeighbourRoles(const Context& context) {
  Digest digest;
  for (int c = 0; c < context.kinematics.num_connectors(); ++c) {
    digest.Add(context.state.neighbours[c].role);
  }
  return digest.value();
}

/// Whether each of the two digests has been the same for long enough.
struct Settled {
  bool structure = false;
  bool roles = false;
};

/// Follows both digests from tick to tick.
Settled Observe(Context& context) {
  RoleState& role = context.state.role;
  const int64_t tick = context.state.tick;
  // Each half has its own clock: roles still spread when the structure has long settled.
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

/// The fields as the role begins with them.
struct FirstFields {
  explicit FirstFields(const RoleInfo& info) {
    for (int i = 0; i < info.num_fields; ++i) values[i] = info.fields[i];
  }
  Cell values[kMaxFields];
};

/// Reports a requirement or label of a role whose evaluation ended with a fault.
void ReportEvaluation(Context& context, int role, const RunResult& result) {
  Fault fault = FaultOf(context.program, result);
  fault.role = static_cast<int16_t>(role);
  if (fault.code == FaultCode::kBudget) fault.limit = kEvaluationBudget;
  Report(context, fault);
}

/// What is known of a role: kUnknown while it rests on neighbours' roles that have not settled.
enum class Verdict : uint8_t { kFails, kFits, kUnknown };

/// The role that the module should play, -1 if none fits.
struct Choice {
  int role = -1;
  int rival = -1;     ///< An unrelated role that fits as well.
  bool wait = false;  ///< A subrole of `role` may fit, once the neighbours' roles have settled.
  RoleCheck check;
};

/// Finds the role to play. It has a verdict on each role and takes the most derived of those that
/// fit. If two that fit are unrelated, the role held wins, or else the one declared first.
class RoleSelector {
 public:
  RoleSelector(Context* context, ModuleServices* services, const Settled& settled,
               bool new_structure)
      : context_(*context),
        services_(*services),
        settled_(settled),
        new_structure_(new_structure) {}

  Choice Choose() {
    const int held = context_.state.role.role;
    const VerifiedProgram& program = context_.program;
    if (held >= 0) Evaluate(held);
    // Only what rests on roles can speak against a role held, if nothing else has changed.
    const bool only_roles = held >= 0 && !new_structure_ && verdicts_[held] == Verdict::kFits;
    for (int role = 0; role < program.num_roles(); ++role) {
      if (role == held || program.role(role).abstract_role) continue;
      Evaluate(role);
      if (only_roles && !checks_[role].rests_on_roles) verdicts_[role] = Verdict::kFails;
    }
    return MostDerived();
  }

 private:
  void Evaluate(int role) {
    const bool held = role == context_.state.role.role;
    RoleCheck& check = checks_[role];
    check = CheckRole(context_, services_, role, new_structure_);
    verdicts_[role] = check.fits() ? Verdict::kFits : Verdict::kFails;
    const bool unknown = check.rests_on_roles && !settled_.roles;
    if (unknown) verdicts_[role] = Verdict::kUnknown;
    // Held, it stays until there is settled evidence against it.
    if (held && (unknown || (!new_structure_ && !check.rests_on_roles))) {
      verdicts_[role] = Verdict::kFits;
      for (int i = 0; i < kMaxLabels; ++i) check.labels[i] = context_.state.role.labels[i];
    }
  }

  /// True if a role that extends `role` has this verdict.
  bool HasSubrole(int role, Verdict verdict) const {
    for (int other = 0; other < context_.program.num_roles(); ++other) {
      if (other != role && verdicts_[other] == verdict && context_.program.IsA(other, role)) {
        return true;
      }
    }
    return false;
  }

  Choice MostDerived() const {
    // Of those that fit, only those count that no other one extends.
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
    // A role not held yet is not taken while a subrole of it may still turn out to fit.
    choice.check = checks_[choice.role];
    choice.wait =
        choice.role != context_.state.role.role && HasSubrole(choice.role, Verdict::kUnknown);
    return choice;
  }

  Context& context_;
  ModuleServices& services_;
  const Settled settled_;
  const bool new_structure_;
  RoleCheck checks_[kMaxRoles];
  Verdict verdicts_[kMaxRoles] = {};
};

/// Notes one more change; false if there were too many, and the role is frozen now.
bool MayChange(Context& context) {
  RoleState& role = context.state.role;
  const int64_t now = context.state.sim_time_us;
  // Changes that lie further back than the window no longer count.
  int kept = 0;
  for (int i = 0; i < role.num_changes; ++i) {
    if (now - role.change_us[i] < kRoleChangeWindowUs) role.change_us[kept++] = role.change_us[i];
  }
  role.num_changes = static_cast<uint8_t>(kept);
  if (kept == kMaxRoleChanges) {
    role.frozen = true;
    Report(context, {.code = FaultCode::kRoleFlicker,
                     .line = static_cast<uint16_t>(context.program.LineOfRole(role.role)),
                     .measured = static_cast<float>(kRoleChangeWindowUs) * 1e-6f,
                     .limit = kMaxRoleChanges});
    return false;
  }
  role.change_us[role.num_changes++] = now;
  return true;
}

/// No role is held; labels, fields and tasks are gone.
void EndRole(Context& context) {
  RoleState& role = context.state.role;
  role.role = -1;
  for (int i = 0; i < kMaxLabels; ++i) role.labels[i] = -1;
  for (int i = 0; i < kMaxFields; ++i) role.fields[i] = Cell{};
  EndTasks(context);
}

/// Which kept field a field of a role is, whatever program it stands in.
uint64_t NameOfKept(const VerifiedProgram& program, const RoleInfo& role, int field) {
  const Text name = program.text(role.fields.name_constant(field));
  Digest digest;
  for (int i = 0; i < name.size; ++i) digest.Add(name.data[i]);
  return digest.value() | 1;
}

/// The place of a kept field in the memory; kMaxKeptFields if it has none.
int FindKept(const VmState& state, uint64_t name, ValueType type) {
  int i = 0;
  while (i < kMaxKeptFields && (state.kept[i].name != name || state.kept[i].type != type)) ++i;
  return i;
}

/// Labels and fields get their first values and the startups begin.
void TakeRole(Context& context, int new_role, const RoleCheck& check) {
  RoleState& role = context.state.role;
  role.role = static_cast<int16_t>(new_role);
  const RoleInfo info = context.program.role(new_role);
  for (int i = 0; i < info.num_labels; ++i) role.labels[i] = check.labels[i];
  for (int i = 0; i < info.num_fields; ++i) {
    role.fields[i] = info.fields[i];
    if (!kHoldsAllInstructions || !info.fields.kept(i)) continue;
    const uint64_t name = NameOfKept(context.program, info, i);
    const int kept = FindKept(context.state, name, info.fields.type(i));
    if (kept < kMaxKeptFields) role.fields[i] = context.state.kept[kept].value;
  }
  StartRole(context);
}

/// Goes on in a role that the old program had as well, if its labels resolve. Its requirements are
/// looked at as those of any role that is held: once what they rest on has settled.
void TakeCarried(Context& context, ModuleServices& services) {
  RoleState& role = context.state.role;
  const int carried = role.carried;
  role.carried = -1;
  const RoleCheck check = CheckRole(context, services, carried, true);
  if (check.labels_resolve && check.missing_keyword < 0) {
    TakeRole(context, carried, check);
  } else {
    DropConventions(context);
  }
}

/// The concrete role of that name; -1 if the program has none.
int8_t FindRole(const VerifiedProgram& program, const Text& name) {
  for (int r = 0; r < program.num_roles(); ++r) {
    const RoleInfo info = program.role(r);
    if (info.abstract_role || info.name.size != name.size) continue;
    int same = 0;
    while (same < name.size && info.name.data[same] == name.data[same]) ++same;
    if (same == name.size) return static_cast<int8_t>(r);
  }
  return -1;
}

/// True if the labels of the role held resolve to what they did.
bool SameLabels(const Context& context, const RoleCheck& check) {
  const RoleState& role = context.state.role;
  for (int i = 0; i < context.program.role(role.role).num_labels; ++i) {
    if (role.labels[i] != check.labels[i]) return false;
  }
  return true;
}

/// Two unrelated roles fit: a fault of the program, with both and a place in the one taken.
void ReportAmbiguity(Context& context, const Choice& choice) {
  Report(context, {.code = FaultCode::kAmbiguousRole,
                   .role = static_cast<int16_t>(choice.role),
                   .rival_role = static_cast<int16_t>(choice.rival),
                   .line = static_cast<uint16_t>(context.program.LineOfRole(choice.role))});
}

/// What a neighbour shares under another program, until it tells.
void CarryShared(const VerifiedProgram& old, const VerifiedProgram& next,
                 NeighbourRecord* neighbour) {
  // It goes over as well, with the new program's first values, but for what is kept.
  const int was_role = neighbour->shared_role;
  neighbour->shared_role = neighbour->role;
  if (neighbour->role < 0) return;
  Cell told[kMaxSharedFields];
  const RoleInfo its_role = next.role(neighbour->role);
  int place = 0;
  for (int i = 0; i < its_role.num_fields; ++i) {
    if (!its_role.fields.shared(i)) continue;
    told[place] = its_role.fields[i];
    if (kHoldsAllInstructions && was_role >= 0 && its_role.fields.kept(i)) {
      const RoleInfo was = old.role(was_role);
      for (int k = 0, before = 0; k < was.num_fields; ++k) {
        if (!was.fields.shared(k)) continue;
        const bool same = was.fields.kept(k) && was.fields.type(k) == its_role.fields.type(i) &&
                          NameOfKept(old, was, k) == NameOfKept(next, its_role, i);
        if (same) told[place] = neighbour->shared[before];
        ++before;
      }
    }
    ++place;
  }
  for (int i = 0; i < place; ++i) neighbour->shared[i] = told[i];
}

}  // namespace

void RememberKept(Context& context) {
  if (!kHoldsAllInstructions || context.state.role.role < 0) return;
  const RoleInfo role = context.program.role(context.state.role.role);
  for (int i = 0; i < role.num_fields; ++i) {
    if (!role.fields.kept(i)) continue;
    const uint64_t name = NameOfKept(context.program, role, i);
    const ValueType type = role.fields.type(i);
    // Where there is no room, the one that was told longest ago is forgotten.
    int place = FindKept(context.state, name, type);
    if (place == kMaxKeptFields) --place;
    for (; place > 0; --place) context.state.kept[place] = context.state.kept[place - 1];
    context.state.kept[0] = {name, type, context.state.role.fields[i]};
  }
}

RoleCheck CheckRole(Context& context, ModuleServices& services, int role, bool report_faults) {
  const VerifiedProgram& program = context.program;
  const RoleInfo info = program.role(role);
  // A role that needs what the module's type lacks cannot be taken by it.
  RoleCheck check;
  for (int i = 0; i < kMaxLabels; ++i) check.labels[i] = -1;
  for (int i = 0; i < program.num_keywords(); ++i) {
    if ((program.keywords_of_role(role) >> i & 1) != 0 && services.Keyword(i) < 0) {
      check.missing_keyword = i;
      return check;
    }
  }
  // Requirements and labels see the first values of the fields, not those of a role held or kept.
  FirstFields fields(info);
  const RoleContext as_role{role, fields.values, check.labels};
  const auto evaluate = [&](int function) {
    int32_t budget = kEvaluationBudget;
    const RunResult result = Evaluate(program, function, as_role, services, &budget);
    // That a label fits nothing, or several things, is an answer and not a fault.
    const bool fault =
        result.status == RunStatus::kFaulted && result.fault != FaultCode::kUnresolved;
    if (fault && report_faults) ReportEvaluation(context, role, result);
    return result;
  };
  services.TakeReadRoles();
  // All labels are evaluated, because requirements may use each of them.
  check.labels_resolve = true;
  for (int i = 0; i < info.num_labels; ++i) {
    const RunResult result = evaluate(info.labels[i]);
    if (result.status == RunStatus::kFinished) {
      check.labels[i] = static_cast<int8_t>(result.value.AsInt());
    } else if (check.labels_resolve) {
      check.labels_resolve = false;
      check.failed_label = i;
    }
  }
  // The first requirement that fails is the reason that people are told.
  check.requirements_hold = true;
  for (int i = 0; i < info.num_requirements && check.requirements_hold; ++i) {
    const RunResult result = evaluate(info.requirements[i]);
    if (result.status == RunStatus::kFinished && result.value.AsBool()) continue;
    check.requirements_hold = false;
    check.failed_requirement = i;
    // Outside of ticks it is a person who asks.
    if (context.output != nullptr || kSmallProfile) continue;
    check.measured =
        TraceComparisons(program, info.requirements[i], as_role, services, kEvaluationBudget)
            .Last();
  }
  check.rests_on_roles = services.TakeReadRoles();
  return check;
}

Evaluation EvaluateAs(Context& context, ModuleServices& services, int role, int function) {
  const VerifiedProgram& program = context.program;
  // The same fields and labels as when a role is chosen.
  const RoleCheck check = CheckRole(context, services, role, false);
  FirstFields fields(program.role(role));
  const RoleContext as_role{role, fields.values, check.labels};
  Evaluation evaluation;
  int32_t budget = kEvaluationBudget;
  evaluation.result = Evaluate(program, function, as_role, services, &budget);
  evaluation.compared = TraceComparisons(program, function, as_role, services, kEvaluationBudget);
  return evaluation;
}

void CarryOver(Context& context, const VerifiedProgram& next) {
  const VerifiedProgram& old = context.program;
  uint64_t* const former = context.state.former_values.hashes;
  // Where parameters alone have changed everything goes on, tasks in the middle of their code
  // included. The role held is not judged for that: only its surroundings are evidence against it.
  if (old.SameButForParameters(next)) {
    for (int i = kMaxFormerValues - 1; i > 0; --i) former[i] = former[i - 1];
    former[0] = old.hash();
    return;
  }
  for (int i = 0; i < kMaxFormerValues; ++i) former[i] = 0;
  ProgramSwitch& change = context.state.program_switch;
  change.previous_hash = old.hash();
  change.tick = context.state.tick;
  for (int r = 0; r < kMaxRoles; ++r) {
    change.renamed[r] = r < old.num_roles() ? FindRole(next, old.role(r).name) : int8_t{-1};
  }
  // The role ends under the program that it belongs to. If the new one has it, too, its conventions
  // stay, so that the module never is without them.
  RoleState& role = context.state.role;
  const int16_t carried = role.role < 0 ? int16_t{-1} : int16_t{change.renamed[role.role]};
  EndRole(context);
  carried < 0 ? DropConventions(context) : ForgetCalls(context);
  // What hangs where is no matter of programs, and is as settled as it was. What roles the
  // neighbours play under the new one they have yet to say.
  RoleState next_role;
  for (int8_t& label : next_role.labels) label = -1;
  next_role.carried = carried;
  next_role.structure = role.structure;
  next_role.structure_since_tick = role.structure_since_tick;
  next_role.roles_since_tick = context.state.tick;
  role = next_role;
  for (NeighbourRecord& neighbour : context.state.neighbours) {
    if (neighbour.role >= 0) neighbour.role = change.renamed[neighbour.role];
    CarryShared(old, next, &neighbour);
  }
}

void UpdateRole(Context& context, ModuleServices& services) {
  RoleState& role = context.state.role;
  const Settled settled = Observe(context);
  if (role.carried >= 0) TakeCarried(context, services);
  if (!settled.structure || role.frozen) return;
  const bool new_structure = !role.evaluated || role.evaluated_structure != role.structure;
  const bool new_roles =
      settled.roles && (!role.evaluated_roles_too || role.evaluated_roles != role.neighbour_roles);
  // A role held is judged once by each state of its surroundings; joints moving within it are no
  // evidence. A module without one goes on looking, for which it must know where it is.
  if (role.role >= 0 && !new_structure && !new_roles) return;
  // A part that has just been cut off has a fresh pose for about as long as its surroundings take
  // to settle: while news of the root is overdue no new role is taken.
  const bool fresh_pose = HasFreshPose(context);
  const bool may_take = fresh_pose && !MayBeCutOff(context);
  if (role.role < 0 && !may_take) return;
  // If the news still comes, a role held that fits is judged then.
  const bool waits = fresh_pose && !may_take;
  if (waits && CheckRole(context, services, role.role, false).fits()) return;
  // From here on the module decides, on the evidence that it notes now.
  role.evaluated = true;
  role.evaluated_structure = role.structure;
  role.evaluated_roles_too = settled.roles;
  role.evaluated_roles = role.neighbour_roles;

  Choice choice;
  if (may_take) {
    choice = RoleSelector(&context, &services, settled, new_structure).Choose();
    if (choice.wait) {
      role.evaluated = false;
      return;
    }
    if (choice.rival >= 0 && (new_structure || new_roles)) ReportAmbiguity(context, choice);
  } else {
    // Without a fresh pose no role is taken; the one held is judged by the last pose known.
    choice.check = CheckRole(context, services, role.role, new_structure);
    choice.role = choice.check.fits() ? role.role : -1;
  }
  // Nothing changes if the same role fits with the same labels.
  if (choice.role == role.role && (role.role < 0 || SameLabels(context, choice.check))) return;
  if (!MayChange(context)) return;
  LeaveRole(context);
  if (choice.role >= 0) TakeRole(context, choice.role, choice.check);
}

void LeaveRole(Context& context) {
  EndRole(context);
  DropConventions(context);
}

}  // namespace morphbus::vm
