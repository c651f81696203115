#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "compiler/m3l/check_robot.h"
#include "compiler/m3l/docking_turn.h"
#include "compiler/m3l/evaluate.h"

namespace morphbus::m3l::internal {
namespace {

/// `rot=` names a turn to this much (degrees).
constexpr double kTurnTolerance = 1e-3;
constexpr size_t kMaxListed = 16;

/// `m1.c2`: a module and one of its connectors.
struct End {
  int module = -1;
  int connector = -1;
  source::Span span;
};

/// Options of one connection for the two ends, in one of the two orders.
struct Choice {
  int connection = 0;
  bool swapped = false;  ///< The second end plays member a.
  const std::vector<int>* options = nullptr;
};

/// Checks one entry of `connections`: its two ends, and the option of a connection that it chooses.
class DockingChecker {
 public:
  DockingChecker(const Expr& entry, RobotScope& scope) : entry_(entry), scope_(scope) {}

  void Check() {
    // An entry is a pair of connectors and, as a third element, the choice of an option.
    const std::vector<Expr>& parts = entry_.children;
    if (entry_.kind != ExprKind::kTuple || parts.size() < 2 || parts.size() > 3) {
      scope_.diagnostics.Error(entry_.span, "expected a pair of connectors").hint =
          "write (m1.c1,m2.c4), or (m1.c1,m2.c4,3) for the connection with number 3";
      scope_.names_lost = true;
      return;
    }
    // Both ends are looked up. What they join is recorded even if the option is wrong, so that no
    // module is said to hang off nothing.
    const bool x = CheckEnd(parts[0], x_);
    const bool y = CheckEnd(parts[1], y_);
    if (x_.module >= 0 && y_.module >= 0) scope_.edges.emplace_back(x_.module, y_.module);
    if (x_.module < 0 || y_.module < 0) scope_.names_lost = true;
    if (!x || !y) return;
    if (x_.module == y_.module) {
      scope_.diagnostics.Error(entry_.span,
                               "module '" + scope_.NameOf(x_.module) + "' is connected to itself");
      return;
    }
    // A connector holds one neighbour only.
    const bool x_free = Use(x_);
    const bool y_free = Use(y_);
    if (x_free && y_free) Choose();
  }

 private:
  /// Reads `m1.c2` into `end`; false if the connector is not known, reported or not.
  bool CheckEnd(const Expr& expr, End& end) {
    end.span = expr.span;
    if (expr.kind != ExprKind::kPath || expr.path.size() != 2) {
      scope_.diagnostics.Error(expr.span, "expected a connector of a module, such as m1.c2");
      return false;
    }
    // The module, then the connector among those of its type.
    const std::optional<int> module = FindModule(expr.path[0], scope_);
    if (!module) return false;
    end.module = *module;
    const model::ModuleType& type = scope_.TypeOf(*module);
    const std::optional<int> connector = type.FindConnector(expr.path[1].text);
    if (connector) {
      end.connector = *connector;
      return true;
    }
    ReportNoMember(Checked(*module), "connector", expr.path[1], NamesOf(type.connectors),
                   "connectors are", scope_.diagnostics);
    return false;
  }

  /// The checked type of module number `module`.
  const CheckedModule& Checked(int module) const {
    const int type = scope_.robot.modules[module].type;
    return scope_.context.modules[type];
  }

  const model::Connector& ConnectorOf(const End& end) const {
    return scope_.TypeOf(end.module).connectors[end.connector];
  }

  std::string EndText(const End& end) const {
    return scope_.NameOf(end.module) + "." + ConnectorOf(end).name;
  }

  /// Notes that the connector is taken; false, after an error, if it is already.
  bool Use(const End& end) {
    const auto [it, fresh] = scope_.used.emplace(std::pair(end.module, end.connector), end.span);
    if (fresh) return true;
    scope_.diagnostics.Error(end.span, "connector '" + EndText(end) + "' is used twice")
        .Note(it->second, "first used here");
    return false;
  }

  const model::ConnectionType& Connection(int index) const {
    return scope_.context.model.connection_types[index];
  }

  /// Both orders in which connection `index` can join the ends.
  std::vector<Choice> ChoicesOf(int index) const {
    std::vector<Choice> choices;
    const auto& table = scope_.context.pairs[index];
    // Where both ends are of one type, the order as written goes first.
    for (const bool swapped : {false, true}) {
      if (!Joins(Connection(index), swapped)) continue;
      const auto found = table.find({A(swapped).connector, B(swapped).connector});
      if (found != table.end()) choices.push_back({index, swapped, &found->second});
    }
    return choices;
  }

  // The ends that play members a and b.
  const End& A(bool swapped) const { return swapped ? y_ : x_; }
  const End& B(bool swapped) const { return swapped ? x_ : y_; }
  /// Whether the ends are of the types of the connection's members, in this order.
  bool Joins(const model::ConnectionType& connection, bool swapped) const {
    return scope_.robot.modules[A(swapped).module].type == connection.type_a &&
           scope_.robot.modules[B(swapped).module].type == connection.type_b;
  }

  /// Finds the connection: the one that is named, or the first declared that can join the ends.
  void Choose() {
    const Expr* selector = entry_.children.size() == 3 ? &entry_.children[2] : nullptr;
    if (selector && selector->kind == ExprKind::kOption) return ChooseNamed(*selector);
    for (size_t i = 0; i < scope_.context.connections.size(); ++i) {
      const std::vector<Choice> choices = ChoicesOf(static_cast<int>(i));
      if (!choices.empty()) return Select(choices, selector);
    }
    ReportImpossible();
  }

  /// `NAME:number`.
  void ChooseNamed(const Expr& selector) {
    // Connections are looked up by name in the order of their declaration.
    const std::string name = PathText(selector.path);
    std::vector<std::string> names;
    for (size_t i = 0; i < scope_.context.connections.size(); ++i) {
      names.push_back(Connection(static_cast<int>(i)).name);
      if (names.back() != name) continue;
      const std::vector<Choice> choices = ChoicesOf(static_cast<int>(i));
      if (!choices.empty()) return Select(choices, &selector.children[0]);
      if (!scope_.context.connections[i].valid) return;
      return ReportNotJoined(static_cast<int>(i), selector);
    }
    scope_.diagnostics.Error(selector.span, "there is no connection '" + name + "'").hint =
        NameHint(name, names, "connections are");
  }

  /// Why a connection does not join the ends.
  struct Refusal {
    int connection = -1;
    size_t rejection = 0;
    bool swapped = false;
  };

  /// The rejection of the two ends by connection `index`, in either order.
  std::optional<Refusal> FindRefusal(int index) const {
    const model::ConnectionType& connection = Connection(index);
    for (size_t i = 0; i < connection.rejections.size(); ++i) {
      const model::PairRejection& r = connection.rejections[i];
      for (const bool swapped : {false, true}) {
        if (Joins(connection, swapped) && r.connector_a == A(swapped).connector &&
            r.connector_b == B(swapped).connector) {
          return Refusal{index, i, swapped};
        }
      }
    }
    return std::nullopt;
  }

  /// Adds to an error where the condition stands that refuses the ends, and how to see all of it.
  void Explain(const Refusal& refusal, source::Diagnostic& d) const {
    const CheckedConnection& connection = scope_.context.connections[refusal.connection];
    d.notes.push_back({connection.broken[refusal.rejection],
                       fmt::format("by connection '{}'", connection.problem.name)});
    d.hint =
        solver::WhyHint(ConnectorOf(A(refusal.swapped)).name, ConnectorOf(B(refusal.swapped)).name);
  }

  const std::string& ReasonOf(const Refusal& refusal) const {
    return Connection(refusal.connection).rejections[refusal.rejection].reason;
  }

  /// The named connection does not join the ends: because it is for other types, or for the reason
  /// that the solver found.
  void ReportNotJoined(int index, const Expr& selector) {
    const std::optional<Refusal> refusal = FindRefusal(index);
    std::string message = fmt::format("connection '{}' does not join {} and {}",
                                      Connection(index).name, EndText(x_), EndText(y_));
    // Without a rejection the connection is for other types of modules.
    if (!refusal) {
      scope_.diagnostics.Error(selector.span, std::move(message))
          .Note(scope_.context.connections[index].problem.span,
                fmt::format("it joins '{}' and '{}'", TypeName(Connection(index).type_a),
                            TypeName(Connection(index).type_b)));
      return;
    }
    Explain(*refusal, scope_.diagnostics.Error(selector.span, message + ": " + ReasonOf(*refusal)));
  }

  /// No connection joins the ends; the first refusal that there is says why.
  void ReportImpossible() {
    std::optional<Refusal> refusal;
    for (size_t i = 0; i < scope_.context.connections.size(); ++i) {
      // An unsound connection may be the one that would do.
      if (!scope_.context.connections[i].valid) return;
      if (!refusal) refusal = FindRefusal(static_cast<int>(i));
    }
    const std::string message =
        fmt::format("{} and {} cannot be connected: ", EndText(x_), EndText(y_));
    // The solver's reason is the best answer; without one, no connection is for these types.
    if (refusal) {
      Explain(*refusal, scope_.diagnostics.Error(entry_.span, message + ReasonOf(*refusal)));
      return;
    }
    scope_.diagnostics.Error(
        entry_.span,
        message + fmt::format("no connection is defined between '{}' and '{}'",
                              scope_.TypeOf(x_.module).name, scope_.TypeOf(y_.module).name));
  }

  const std::string& TypeName(int type) const {
    return scope_.context.model.module_types[type].name;
  }

  /// Takes the option that the selector asks for: the default, a number, or a turn.
  void Select(const std::vector<Choice>& choices, const Expr* selector) {
    // The default is the option with the lowest number, in the order as written.
    if (!selector) return Add(choices[0], choices[0].options->front());
    if (selector->kind == ExprKind::kAssign) return SelectTurn(choices, *selector);
    const std::optional<double> number = EvaluateNumber(*selector, &scope_.diagnostics);
    if (!number) return;
    for (const Choice& choice : choices) {
      for (const int option : *choice.options) {
        const auto& options = Connection(choice.connection).options;
        if (options[option].number == *number) return Add(choice, option);
      }
    }
    source::Diagnostic& d = scope_.diagnostics.Error(
        selector->span, fmt::format("connection number {} does not join {} and {}",
                                    NumberText(*number), EndText(x_), EndText(y_)));
    // The numbers that would do are told for both orders.
    d.hint = "valid are " + Listed(choices[0]);
    if (choices.size() > 1) d.hint += "; from the other module's side " + Listed(choices[1]);
  }

  /// `rot=degrees`: the option that is turned so much from the default.
  void SelectTurn(const std::vector<Choice>& choices, const Expr& selector) {
    if (PathText(selector.path) != "rot") {
      scope_.diagnostics.Error(selector.span, "expected a number, rot=..., or NAME:number");
      return;
    }
    std::optional<double> turn = EvaluateNumber(selector.children[0], &scope_.diagnostics);
    if (!turn) return;
    // A number alone counts degrees here; what has a unit is in radians, as everywhere.
    if (HasAngle(selector.children[0])) *turn *= 180.0 / std::numbers::pi;
    const Choice& choice = choices[0];
    // Turns are compared round the circle: 270 is -90.
    const auto is = [](double x, double y) {
      return std::abs(std::remainder(x - y, 360.0)) < kTurnTolerance;
    };
    // No turn is the default, whichever way the connector faces.
    if (is(*turn, 0.0)) return Add(choice, choice.options->front());
    // A turn other than 0 has a sign, so the outward normal must be known. Where only the line is
    // known, half turns still are unambiguous.
    const std::optional<model::FaceNormal> normal = NormalOfA(choice);
    if (!normal) return ReportNoNormal(choice, selector);
    for (const int option : *choice.options) {
      const std::optional<model::MatingTurn> other = Turn(choice, *normal, option);
      if (!other) continue;
      if (other->signed_ && is(other->degrees, *turn)) return Add(choice, option);
      // This option may be meant, but which of the two turns it is cannot be said.
      if (!other->signed_ && (is(other->degrees, *turn) || is(-other->degrees, *turn))) {
        return ReportNoNormal(choice, selector);
      }
    }
    scope_.diagnostics
        .Error(selector.span, fmt::format("{} and {} cannot be joined with a turn of {} degrees",
                                          EndText(x_), EndText(y_), NumberText(*turn)))
        .hint = "valid are " + Listed(choice);
  }

  /// `rot=` where nothing says which way the connector of member a faces.
  void ReportNoNormal(const Choice& choice, const Expr& selector) {
    const End& a = A(choice.swapped);
    const CheckedModule& module = Checked(a.module);
    const std::string& name = ConnectorOf(a).name;
    source::Diagnostic& d = scope_.diagnostics.Error(
        selector.span,
        fmt::format("which way 'rot' turns is not known: '{}' has no outward normal", EndText(a)));
    d.hint = fmt::format(
        "give '{}' of '{}' a normal=(x, y, z) that points out of the module, or choose by number: "
        "{}",
        name, module.type.name, Listed(choice));
    const auto at = module.connector_spans.find(name);
    if (at != module.connector_spans.end()) {
      d.notes.push_back({at->second, "the connector is declared here"});
    }
  }

  /// The module type that plays member a.
  const CheckedModule& MemberA(const Choice& choice) const {
    return scope_.context.modules[Connection(choice.connection).type_a];
  }

  /// The outward normal of member a's connector, about which turns are counted.
  std::optional<model::FaceNormal> NormalOfA(const Choice& choice) const {
    std::vector<const model::ConnectionOption*> options;
    for (const int option : *choice.options) {
      options.push_back(&Connection(choice.connection).options[option]);
    }
    return NormalOf(MemberA(choice), A(choice.swapped).connector, options);
  }

  /// The turn from the default to option number `option`.
  std::optional<model::MatingTurn> Turn(const Choice& choice, const model::FaceNormal& normal,
                                        int option) const {
    const auto& options = Connection(choice.connection).options;
    return model::TurnBetween(MemberA(choice).type, MemberA(choice).extent_m, normal,
                              options[choice.options->front()], options[option]);
  }

  /// "53 (the default), 54 (rot=-90), ..."
  std::string Listed(const Choice& choice) const {
    const std::optional<model::FaceNormal> normal = NormalOfA(choice);
    std::string list;
    for (size_t i = 0; i < choice.options->size(); ++i) {
      // Enough to choose from.
      if (i == kMaxListed) return list + ", ...";
      const int option = (*choice.options)[i];
      const auto& options = Connection(choice.connection).options;
      const std::optional<model::MatingTurn> turn =
          normal ? Turn(choice, *normal, option) : std::nullopt;
      list += fmt::format("{}{}", i ? ", " : "", options[option].number);
      if (i == 0) {
        list += " (the default)";
      } else if (turn && turn->signed_) {
        list += fmt::format(" (rot={})", NumberText(turn->degrees));
      }
    }
    return list;
  }

  /// Takes the docking over, member a first.
  void Add(const Choice& choice, int option) {
    const End& a = A(choice.swapped);
    const End& b = B(choice.swapped);
    scope_.robot.dockings.push_back(
        {a.module, a.connector, b.module, b.connector, choice.connection, option});
    scope_.docking_spans.push_back(entry_.span);
  }

  const Expr& entry_;
  RobotScope& scope_;
  End x_, y_;
};

}  // namespace

void CheckDocking(const Expr& entry, RobotScope& scope) { DockingChecker(entry, scope).Check(); }

}  // namespace morphbus::m3l::internal
