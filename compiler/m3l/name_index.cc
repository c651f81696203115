#include "compiler/m3l/name_index.h"

#include <algorithm>
#include <map>
#include <string>

#include "compiler/m3l/evaluate.h"

namespace morphbus::m3l {
namespace {

using source::NameKind;
using source::NameTable;
using source::Span;

/// The span of two together, which are in one file.
Span Joined(const Span& x, const Span& y) {
  if (y.file != x.file) return x;
  return {x.file, std::min(x.begin, y.begin), std::max(x.end, y.end)};
}

/// Walks over all definitions: first all that can be named from elsewhere are declared, then the
/// names within each are looked up.
class Indexer {
 public:
  explicit Indexer(const std::vector<FileAst>& files) : files_(files) {}

  NameTable Index() {
    for (const FileAst& file : files_) {
      for (const ConstDecl& constant : file.constants) DeclareConstant(constant);
      for (const ModuleDecl& module : file.modules) DeclareModule(module);
      for (const ConnectionDecl& decl : file.connections) Declare(decl, NameKind::kConnection, -1);
      for (const RobotDecl& decl : file.robots) Declare(decl, NameKind::kRobot, -1);
    }
    for (const FileAst& file : files_) {
      for (const ConstDecl& constant : file.constants) {
        if (constant.value) UseConstants(*constant.value);
      }
      for (const ModuleDecl& module : file.modules) UseInModule(module);
      for (const ConnectionDecl& connection : file.connections) UseInConnection(connection);
      for (const RobotDecl& robot : file.robots) UseInRobot(robot);
    }
    table_.Sort();
    return std::move(table_);
  }

 private:
  /// What can be named of one module, by its index in the table.
  struct Module {
    std::map<std::string, int> points, links, axes, joints, sensors, subpoints, attributes;
    /// The points that belong to a link alone, by the link's name.
    std::map<std::string, std::map<std::string, int>> of_link;
  };
  using Names = std::map<std::string, int>;

  static int Lookup(const Names& names, const std::string& name) {
    const auto found = names.find(name);
    return found == names.end() ? -1 : found->second;
  }

  /// Declares what a definition or member names, with all of its text.
  int Declare(const Declaration& decl, NameKind kind, int owner) {
    if (decl.name.text.empty()) return -1;
    const int thing = table_.Declare(kind, decl.name.text, decl.name.span, owner);
    Span& extent = table_.things[thing].extent;
    for (const Attribute& attribute : decl.attributes) {
      extent = Joined(extent, attribute.value ? attribute.value->span : attribute.key.span);
    }
    // Definitions are found by name from everywhere, the first of a name.
    if (owner < 0) globals_[kind].emplace(decl.name.text, thing);
    return thing;
  }

  int Global(NameKind kind, const std::string& name) { return Lookup(globals_[kind], name); }

  void DeclareConstant(const ConstDecl& decl) {
    const int thing = table_.Declare(NameKind::kConstant, decl.name.text, decl.name.span);
    if (decl.value) {
      Span& extent = table_.things[thing].extent;
      extent = Joined(extent, decl.value->span);
    }
    globals_[NameKind::kConstant].emplace(decl.name.text, thing);
  }

  void DeclareModule(const ModuleDecl& decl) {
    const int thing = Declare(decl, NameKind::kModule, -1);
    if (thing < 0) return;
    Module& module = modules_[thing];
    const auto all = [&](const auto& members, NameKind kind, Names* names) {
      for (const auto& member : members) {
        const int index = Declare(member, kind, thing);
        if (index < 0) continue;
        names->emplace(member.name.text, index);
        Widen(thing, index);
      }
    };
    all(decl.points, NameKind::kPoint, &module.points);
    all(decl.links, NameKind::kLink, &module.links);
    all(decl.axes, NameKind::kAxis, &module.axes);
    all(decl.joints, NameKind::kJoint, &module.joints);
    all(decl.sensors, NameKind::kSensor, &module.sensors);
    for (const PointDecl& point : decl.points) DeclarePartsOf(point, thing, &module);
    for (const LinkDecl& link : decl.links) {
      const int owner = Lookup(module.links, link.name.text);
      for (const PointDecl& point : link.points) {
        const int index = Declare(point, NameKind::kPoint, owner);
        if (index >= 0) module.of_link[link.name.text].emplace(point.name.text, index);
        DeclarePartsOf(point, thing, &module);
      }
    }
  }

  /// The sub-points of a point, and the attributes of a connector.
  void DeclarePartsOf(const PointDecl& point, int owner, Module* module) {
    const auto add = [&](const Name& name, NameKind kind, Names* names) {
      if (name.text.empty()) return;
      const int known = Lookup(*names, name.text);
      if (known >= 0) return table_.Use(name.span, known, true);
      names->emplace(name.text, table_.Declare(kind, name.text, name.span, owner));
    };
    for (const PointDecl& sub : point.subpoints) {
      add(sub.name, NameKind::kSubpoint, &module->subpoints);
    }
    for (const Attribute& attribute : point.attributes) {
      const std::string& key = attribute.key.text;
      if (key == "coords" || key == "connector" || key == "normal") continue;
      add(attribute.key, NameKind::kAttribute, &module->attributes);
    }
  }

  /// Lets the text of `outer` reach to the end of that of `inner`.
  void Widen(int outer, int inner) {
    table_.things[outer].extent = Joined(table_.things[outer].extent, table_.things[inner].extent);
  }

  // --- Names within a definition

  /// Constants stand for numbers everywhere, also where nothing else has a name.
  void UseConstants(const Expr& expr) {
    if (expr.constant && expr.path.size() == 1) {
      table_.Use(expr.path[0].span, Global(NameKind::kConstant, expr.path[0].text));
    }
    for (const Expr& child : expr.children) UseConstants(child);
    if (expr.axis) UseConstants(*expr.axis);
  }
  void UseConstants(const std::vector<Attribute>& attributes) {
    for (const Attribute& attribute : attributes) {
      if (attribute.value) UseConstants(*attribute.value);
    }
  }

  void UseInModule(const ModuleDecl& decl) {
    UseConstants(decl.attributes);
    const auto found = modules_.find(Global(NameKind::kModule, decl.name.text));
    if (found == modules_.end()) return;
    const Module& module = found->second;
    for (const PointDecl& point : decl.points) UseInPoint(point);
    for (const LinkDecl& link : decl.links) UseInLink(link, module);
    for (const AxisDecl& axis : decl.axes) UseConstants(axis.attributes);
    for (const JointDecl& joint : decl.joints) UseInJoint(joint, module);
    for (const SensorDecl& sensor : decl.sensors) {
      UseConstants(sensor.attributes);
      const Attribute* link = sensor.Find("link");
      if (link != nullptr && link->value) UseName(*link->value, module.links);
    }
  }

  void UseInPoint(const PointDecl& point) {
    UseConstants(point.attributes);
    for (const PointDecl& sub : point.subpoints) UseConstants(sub.attributes);
  }

  /// A value that is one name, of the table `names`.
  void UseName(const Expr& value, const Names& names) {
    if (value.path.size() == 1) {
      table_.Use(value.path[0].span, Lookup(names, value.path[0].text));
    }
  }

  void UseInLink(const LinkDecl& link, const Module& module) {
    UseConstants(link.attributes);
    for (const PointDecl& point : link.points) UseInPoint(point);
    const auto found = module.of_link.find(link.name.text);
    const Names& own = found == module.of_link.end() ? none_ : found->second;
    if (const Attribute* grouping = link.Find("grouping"); grouping && grouping->value) {
      const Expr& value = *grouping->value;
      for (const Expr& name :
           value.kind == ExprKind::kTuple ? value.children : std::vector<Expr>{value}) {
        if (name.path.size() == 1) UsePoint(name.path[0], own, module);
      }
    }
    for (const char* shape : {"hull", "visual"}) {
      const Attribute* found_shape = link.Find(shape);
      if (found_shape && found_shape->value) UseInHull(*found_shape->value, own, module);
    }
  }

  /// A point of the link goes before one of the module.
  void UsePoint(const Name& name, const Names& own, const Module& module) {
    const int thing = Lookup(own, name.text);
    table_.Use(name.span, thing >= 0 ? thing : Lookup(module.points, name.text));
  }

  /// The points and axes that the parts of a hull name.
  void UseInHull(const Expr& expr, const Names& own, const Module& module) {
    if (expr.kind == ExprKind::kAssign && expr.path[0].text == "axis") {
      return UseName(expr.children[0], module.axes);
    }
    for (const Expr& child : expr.children) UseInHull(child, own, module);
    if (expr.kind != ExprKind::kPath || expr.constant || expr.path.empty()) return;
    // `c1`, `c1._2`, `link`, `link.p`, `link.p._1`, in the order in which the checker looks.
    const Name& first = expr.path[0];
    size_t at = 1;
    const auto link = module.of_link.find(first.text);
    if (!own.contains(first.text) && module.links.contains(first.text)) {
      table_.Use(first.span, Lookup(module.links, first.text));
      if (expr.path.size() < 2 || link == module.of_link.end()) return;
      table_.Use(expr.path[1].span, Lookup(link->second, expr.path[1].text));
      at = 2;
    } else {
      UsePoint(first, own, module);
    }
    if (expr.path.size() > at) {
      table_.Use(expr.path[at].span, Lookup(module.subpoints, expr.path[at].text));
    }
  }

  void UseInJoint(const JointDecl& joint, const Module& module) {
    UseConstants(joint.attributes);
    const Attribute* pair = joint.Find("pair");
    if (pair == nullptr || !pair->value) return;
    for (const Expr& half : pair->value->children) {
      if (half.children.size() != 2) continue;
      UseName(half.children[0], module.links);
      UseName(half.children[1], module.axes);
    }
  }

  /// A type and a name, `MTRAN m1`: declares the name, with its module.
  int DeclareTyped(const Expr& expr, NameKind kind, int owner) {
    if (expr.kind != ExprKind::kTyped || expr.path.size() != 1) return -1;
    const int module = Global(NameKind::kModule, expr.path[0].text);
    table_.Use(expr.path[0].span, module);
    const int thing = table_.Declare(kind, expr.bound.text, expr.bound.span, owner);
    table_.things[thing].extent = expr.span;
    table_.things[thing].base = module;
    return thing;
  }

  void UseInConnection(const ConnectionDecl& decl) {
    UseConstants(decl.attributes);
    const int owner = Global(NameKind::kConnection, decl.name.text);
    Names members, binders;
    if (const Attribute* list = decl.Find("members"); list && list->value) {
      for (const Expr& member : list->value->children) {
        const int thing = DeclareTyped(member, NameKind::kMember, owner);
        if (thing >= 0) members.emplace(member.bound.text, thing);
      }
    }
    const Attribute* conditions = decl.Find("conditions");
    if (conditions == nullptr || !conditions->value) return;
    // Conditions may use the name of a connector before it is given.
    Bind(*conditions->value, owner, members, &binders);
    UseInCondition(*conditions->value, members, binders);
  }

  /// Declares the names of connectors, `a.point p`.
  void Bind(const Expr& expr, int owner, const Names& members, Names* binders) {
    for (const Expr& child : expr.children) Bind(child, owner, members, binders);
    if (expr.kind != ExprKind::kTyped || expr.path.empty()) return;
    const int member = Lookup(members, expr.path[0].text);
    table_.Use(expr.path[0].span, member);
    if (member < 0) return;
    const int thing = table_.Declare(NameKind::kBinder, expr.bound.text, expr.bound.span, owner);
    table_.things[thing].extent = expr.span;
    table_.things[thing].base = table_.things[member].base;
    binders->emplace(expr.bound.text, thing);
  }

  void UseInCondition(const Expr& expr, const Names& members, const Names& binders) {
    for (const Expr& child : expr.children) UseInCondition(child, members, binders);
    if (expr.kind != ExprKind::kPath || expr.path.empty() || expr.constant) return;
    // A connector goes before a member of its name.
    const int binder = Lookup(binders, expr.path[0].text);
    const int first = binder >= 0 ? binder : Lookup(members, expr.path[0].text);
    table_.Use(expr.path[0].span, first);
    if (first < 0 || expr.path.size() < 2) return;
    const auto module = modules_.find(table_.things[first].base);
    if (module == modules_.end()) return;
    const Name* name = &expr.path[1];
    // Behind a member stands an axis or a connector, behind a connector a sub-point or an
    // attribute.
    if (binder < 0) {
      const int axis = Lookup(module->second.axes, name->text);
      table_.Use(name->span, axis >= 0 ? axis : ConnectorOf(module->second, name->text));
      if (expr.path.size() < 3) return;
      name = &expr.path[2];
    }
    const int sub = Lookup(module->second.subpoints, name->text);
    table_.Use(name->span, sub >= 0 ? sub : Lookup(module->second.attributes, name->text));
  }

  /// A point of the module or of one of its links.
  static int ConnectorOf(const Module& module, const std::string& name) {
    int connector = Lookup(module.points, name);
    for (const auto& [link, points] : module.of_link) {
      if (connector < 0) connector = Lookup(points, name);
    }
    return connector;
  }

  void UseInRobot(const RobotDecl& decl) {
    UseConstants(decl.attributes);
    const int owner = Global(NameKind::kRobot, decl.name.text);
    Names instances;
    if (const Attribute* list = decl.Find("modules"); list && list->value) {
      for (const Expr& entry : list->value->children) {
        const int thing = DeclareTyped(entry, NameKind::kInstance, owner);
        if (thing >= 0) instances.emplace(entry.bound.text, thing);
      }
    }
    for (const char* key : {"connections", "frame", "joints"}) {
      const Attribute* attribute = decl.Find(key);
      if (attribute != nullptr && attribute->value) UseInstances(*attribute->value, instances);
    }
  }

  /// Paths that begin with a module of the robot, and names of connections.
  void UseInstances(const Expr& expr, const Names& instances) {
    for (const Expr& child : expr.children) UseInstances(child, instances);
    if (expr.path.empty() || expr.constant) return;
    if (expr.kind == ExprKind::kOption) {
      return table_.Use(expr.path[0].span, Global(NameKind::kConnection, expr.path[0].text));
    }
    const int instance = Lookup(instances, expr.path[0].text);
    table_.Use(expr.path[0].span, instance);
    if (instance < 0 || expr.path.size() < 2) return;
    const auto found = modules_.find(table_.things[instance].base);
    if (found == modules_.end()) return;
    const Module& module = found->second;
    const std::string& name = expr.path[1].text;
    // m1.joint=0; m1.link.axis and m1.link.(axis: ...); else a connector.
    if (expr.kind == ExprKind::kAssign) {
      return table_.Use(expr.path[1].span, Lookup(module.joints, name));
    }
    if (expr.kind == ExprKind::kAxis || expr.path.size() > 2) {
      table_.Use(expr.path[1].span, Lookup(module.links, name));
      if (expr.path.size() > 2) {
        table_.Use(expr.path[2].span, Lookup(module.axes, expr.path[2].text));
      }
      return;
    }
    table_.Use(expr.path[1].span, ConnectorOf(module, name));
  }

  const std::vector<FileAst>& files_;
  NameTable table_;
  std::map<NameKind, Names> globals_;
  std::map<int, Module> modules_;
  const Names none_;
};

}  // namespace

source::NameTable IndexNames(const std::vector<FileAst>& files) { return Indexer(files).Index(); }

}  // namespace morphbus::m3l
