#include "compiler/dynarole/expression_checker.h"

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "compiler/dynarole/builtins.h"
#include "compiler/dynarole/print_call.h"

namespace morphbus::dynarole {

using source::Diagnostic;

namespace {

/// The image has the length of a text in one byte.
constexpr size_t kLongestPrint = 255;

}  // namespace

ExpressionChecker::ExpressionChecker(const keywords::KeywordTable& keywords, ProgramModel* model,
                                     Scope* scope, CheckPass* pass)
    : model_(*model),
      scope_(*scope),
      pass_(*pass),
      conversions_(scope, pass),
      arrays_(model, scope, &conversions_, pass),
      operators_(scope, &conversions_, pass),
      parts_(keywords, model, scope, &conversions_, pass),
      builtins_(keywords, *model, scope, &parts_, &conversions_, pass),
      calls_(model, scope, &conversions_, pass),
      constants_(model, scope, pass, [this](Expr* expr) { return Infer(expr); }),
      names_(keywords, model, scope, &parts_, &constants_, pass) {}

Type ExpressionChecker::Infer(Expr* expr) {
  // An earlier pass may have known less, so nothing of it is kept.
  expr->wanted = Type::kUnknown;
  expr->meaning = Meaning::kNone;
  // The type is that of the value itself; what the surroundings want is asked for afterwards, by
  // them.
  expr->type = InferUnconverted(expr);
  return expr->type;
}

void ExpressionChecker::InferAs(Expr* expr, Type wanted, const std::string& what) {
  Infer(expr);
  conversions_.Want(expr, wanted, what);
}

Type ExpressionChecker::InferUnconverted(Expr* expr) {
  switch (expr->kind) {
    case ExprKind::kInt:
      // The parser lets 2147483648 through for the sake of its negative.
      if (expr->integer > 2147483647) {
        return pass_.Wrong(expr->span, "number does not fit an int",
                           "ints reach from -2147483648 to 2147483647");
      }
      return Type::kInt;
    case ExprKind::kFloat:
      return Type::kFloat;
    case ExprKind::kBool:
      return Type::kBool;
    case ExprKind::kDollar:
      return names_.InferDollar(expr);
    case ExprKind::kName:
      if (const std::optional<Array> array = arrays_.Find(expr->name)) {
        return arrays_.AsValue(expr->span, expr->name, *array);
      }
      return names_.InferName(expr);
    case ExprKind::kIndex:
      return InferElement(expr);
    case ExprKind::kUnary:
      return InferUnary(expr);
    case ExprKind::kBinary:
      // Both sides are looked at first, so that each is checked whatever the other is.
      for (ExprPtr& operand : expr->operands) Infer(operand.get());
      return operators_.InferBinary(expr);
    case ExprKind::kChoice:
      for (ExprPtr& operand : expr->operands) Infer(operand.get());
      return operators_.InferChoice(expr);
    case ExprKind::kMember:
      return InferMember(expr, nullptr);
    case ExprKind::kCall:
      return InferCall(expr);
    case ExprKind::kSuper:
      // These three are no values; each has its place, which the hint shows.
      return pass_.Wrong(expr->span, "'super' cannot stand alone",
                         "it calls what this member replaces, for example super.start()");
    case ExprKind::kText:
      return pass_.Wrong(expr->span, "a text can only be printed",
                         "for example: print(\"knee at\", x);");
    case ExprKind::kArray:
      return pass_.Wrong(expr->span, "an array can only be what a variable or field begins with",
                         "for example: var a = [0.0, 0.0];");
    case ExprKind::kSelf:
      return pass_.Wrong(expr->span, "'self' cannot stand alone",
                         "ask it something, for example self.connected");
    case ExprKind::kError:
      break;
  }
  return Type::kError;
}

Type ExpressionChecker::InferElement(Expr* element) {
  Infer(element->operands[1].get());
  const Type type = arrays_.InferElement(element);
  if (element->meaning != Meaning::kNone) return type;
  // The name means something else, or nothing, which is said as of any name.
  Expr* named = element->operands[0].get();
  return arrays_.NoArray(named->span, named->name, Infer(named));
}

Type ExpressionChecker::InferUnary(Expr* expr) {
  Expr* operand = expr->operands[0].get();
  // The sign of the smallest int belongs to its number.
  if (expr->op == Operator::kNegate && operand->kind == ExprKind::kInt) {
    operand->type = Type::kInt;
    operand->wanted = Type::kUnknown;
    return Type::kInt;
  }
  Infer(operand);
  return operators_.InferUnary(expr);
}

// Something of self, what the member replaces, a command of a role, or something of a joint,
// connector or set.
Type ExpressionChecker::InferMember(Expr* member, Expr* call) {
  const Expr& base = *member->operands[0];
  // Neither self nor super is a value with a type, so that they come before everything else.
  if (base.kind == ExprKind::kSelf) return InferSelf(member, call);
  if (base.kind == ExprKind::kSuper) return calls_.InferSuper(member, call);
  // Variables and labels hide roles of their name.
  if (call != nullptr && base.kind == ExprKind::kName && scope_.FindLocal(base.name) == nullptr) {
    const int role = model_.FindRole(base.name);
    if (role >= 0 && FindSlot(scope_.role().labels, base.name) < 0) {
      return calls_.InferInvoke(member, call, role);
    }
  }
  // `Phase.LIFT`, where nothing else has the enumeration's name.
  if (call == nullptr && base.kind == ExprKind::kName) {
    const int value = names_.ValueOfEnumeration(base.name, member->name);
    if (value >= 0) return constants_.Infer(member, value);
    if (names_.IsEnumeration(base.name)) return names_.UnknownValue(*member);
  }
  // All else before a dot is a value.
  return InferPart(member, call);
}

Type ExpressionChecker::InferCall(Expr* call) {
  // Arguments have types of their own, whatever is called; operand 0 is what stands before the
  // parenthesis.
  Expr* callee = call->operands[0].get();
  if (callee->kind == ExprKind::kName && callee->name == "print" &&
      FindSlot(scope_.role().methods, "print") < 0) {
    return InferPrint(call);
  }
  if (callee->kind == ExprKind::kName && callee->name == "sizeof" && arrays_.InferSize(call)) {
    return Type::kInt;
  }
  // Texts among the arguments of print have no type; those of all other calls are values.
  for (size_t i = 1; i < call->operands.size(); ++i) Infer(call->operands[i].get());
  return callee->kind == ExprKind::kMember ? InferMember(callee, call) : InferFunction(call);
}

Type ExpressionChecker::InferFunction(Expr* call) {
  Expr* callee = call->operands[0].get();
  if (callee->name == "sizeof") return InferSizeof(call);
  // Functions of the language stand behind those of the role, so that a program may have its own.
  const RoleModel& owner = scope_.role();
  const int slot = FindSlot(owner.methods, callee->name);
  if (slot >= 0) return calls_.InferMethod(call, callee->name, callee->span, slot);
  if (CallChecker::IsOverNeighbours(*call)) return calls_.InferOverNeighbours(call);
  if (!UsagesOf(FunctionBuiltins(), callee->name).empty()) {
    return builtins_.Infer(FunctionBuiltins(), "", callee, call);
  }
  if (callee->name == "int" || callee->name == "float") {
    return InferConversion(call, callee->name == "int" ? Type::kInt : Type::kFloat);
  }
  // The function may be one that is inherited from a role which does not exist.
  if (owner.broken) return Type::kError;
  if (FindSlot(owner.commands, callee->name) >= 0) {
    return calls_.CommandAsFunction(callee->name, callee->span);
  }
  return UnknownFunction(*callee);
}

// The hint names what may have been meant: something of self, the nearest name, or else all there
// is.
Type ExpressionChecker::UnknownFunction(const Expr& callee) {
  Diagnostic& error = pass_.Error(callee.span, "unknown function '" + callee.name + "'");
  if (const std::string usages = UsagesOf(SelfBuiltins(), callee.name); !usages.empty()) {
    error.hint = "did you mean '" + usages + "'?";
    return Type::kError;
  }
  if (callee.name == "not") {
    error.hint = "logical not is '!'";
    return Type::kError;
  }
  // Then a slip in a name of the language or of the role.
  std::vector<std::string> names = {"sizeof", "print", "int", "float"};
  for (const std::string& name : NamesOf(NeighbourBuiltins())) names.push_back(name);
  for (const std::string& name : NamesOf(FunctionBuiltins())) {
    if (std::ranges::count(names, name) == 0) names.push_back(name);
  }
  for (const NamedSlot& method : scope_.role().methods) names.push_back(method.name);
  pass_.Suggest(&error, callee.name, names);
  if (const std::string usages = UsagesBeginning(SelfBuiltins(), callee.name);
      error.hint.empty() && !usages.empty()) {
    error.hint = "did you mean '" + usages + "'?";
  }
  if (error.hint.empty()) {
    std::string known;
    for (const std::string& name : names) known += name + ", ";
    pass_.Suggest(
        &error, callee.name, NamesOf(SelfBuiltins()), "self.",
        "functions are " + known + "and behind 'self.': " + Listed(NamesOf(SelfBuiltins())));
  }
  return Type::kError;
}

Type ExpressionChecker::InferSizeof(Expr* call) {
  if (call->operands.size() != 2) {
    pass_.Error(call->span,
                "'sizeof' takes 1 argument, not " + std::to_string(call->operands.size() - 1));
    return Type::kInt;
  }
  // What is counted: neighbours, joints or links.
  const Expr& set = *call->operands[1];
  if (!IsSet(set.type) && set.type != Type::kError && set.type != Type::kUnknown) {
    pass_.Error(set.span, "'sizeof' needs a set, but this is " + NameOf(set.type)).hint =
        "sets are what self.connected, self.joints and self.links yield";
  }
  // Also where its operand is wrong: what is made of the number needs no second message.
  call->meaning = Meaning::kCount;
  return Type::kInt;
}

Type ExpressionChecker::InferConversion(Expr* call, Type to) {
  const std::string name = WordOf(to);
  call->meaning = Meaning::kConvert;
  if (call->operands.size() != 2) {
    pass_.Error(call->span, "'" + name + "' takes 1 argument, not " +
                                std::to_string(call->operands.size() - 1));
    return to;
  }
  // A parameter that nothing else is known of is a float, which both ways lead from.
  Expr* value = call->operands[1].get();
  if (value->type == Type::kUnknown && pass_.phase() == Phase::kDefaults) {
    conversions_.Hint(value, Type::kFloat);
  }
  if (IsSet(value->type)) value->wanted = Type::kInt;
  if (!IsNumber(value->type) && !IsSet(value->type) && value->type != Type::kUnknown &&
      value->type != Type::kError) {
    pass_.Error(value->span, "'" + name + "' needs a number, but this is " + NameOf(value->type));
  }
  return to;
}

Type ExpressionChecker::InferPrint(Expr* call) {
  // Texts and values may come in any order; texts have no type, so that only values are inferred.
  call->meaning = Meaning::kBuiltin;
  call->opcode = vm::Opcode::kPrint;
  scope_.Uses(call->opcode, call->name_span, "print");
  int values = 0;
  if (call->operands.size() == 1) pass_.Error(call->span, "'print' has nothing to print");
  for (size_t i = 1; i < call->operands.size(); ++i) {
    Expr* value = call->operands[i].get();
    if (value->kind == ExprKind::kText) continue;
    ++values;
    const Type type = Infer(value);
    // A set is told by its size, as in comparisons.
    if (IsSet(type)) value->wanted = Type::kInt;
    if (type == Type::kAny) value->wanted = Type::kDirection;
    if (type == Type::kVoid) pass_.Error(value->span, "this has no value to print");
  }
  if (values > vm::kMaxPrintValues) {
    pass_.Error(call->span, "'print' has " + std::to_string(values) + " values").hint =
        "at most " + std::to_string(vm::kMaxPrintValues) + " in one line";
  }
  // The places of values in the image take three characters each.
  if (PrintTextOf(*call).size() > kLongestPrint) {
    pass_.Error(call->span, "the text to print is too long").hint =
        "at most " + std::to_string(kLongestPrint) + " characters in one line";
  }
  return Type::kVoid;
}

Type ExpressionChecker::InferSelf(Expr* member, Expr* call) {
  // What is built in comes first; no program can replace it.
  for (const Builtin& builtin : SelfBuiltins()) {
    if (member->name == builtin.name) return builtins_.Infer(SelfBuiltins(), "self.", member, call);
  }
  // A call of a function of the role may have self before it.
  const RoleModel& owner = scope_.role();
  if (call != nullptr) {
    const int slot = FindSlot(owner.methods, member->name);
    if (slot >= 0) return calls_.InferMethod(call, member->name, member->name_span, slot);
    if (FindSlot(owner.commands, member->name) >= 0) {
      return calls_.CommandAsFunction(member->name, member->name_span);
    }
  }
  // What is left are the parts of the module, which have their names from the module types.
  return parts_.InferOfSelf(member, call);
}

Type ExpressionChecker::InferPart(Expr* member, Expr* call) {
  Expr* base = member->operands[0].get();
  // A sensor is no value either, but is read by its name.
  const int sensor = parts_.FindSensor(*base);
  if (sensor >= 0) return parts_.InferSensor(member, call, sensor);
  const Type type = Infer(base);
  // Of what has been reported, or is not known yet, nothing can be said.
  if (type == Type::kError || type == Type::kUnknown) return Type::kError;
  if (type == Type::kConnector) {
    // Whether something is docked is no state variable, and every connector knows it.
    return member->name == "CONNECTED" && call == nullptr
               ? builtins_.Infer(ConnectorBuiltins(), "CONNECTOR.", member, call)
               : parts_.InferConnectorState(member, call);
  }
  if (type == Type::kSet) return calls_.InferNeighbours(member, call);
  if (type == Type::kJoint || type == Type::kJointSet) {
    // A set of joints stands for its only member.
    conversions_.Want(base, Type::kJoint, "what stands before the dot");
    return builtins_.Infer(JointBuiltins(), "JOINT.", member, call);
  }
  return pass_.Wrong(member->name_span, NameOf(type) + " has no '" + member->name + "'",
                     "only self, roles, neighbours, joints and connectors have members");
}

}  // namespace morphbus::dynarole
