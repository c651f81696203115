// morphbus connections: the numbered ways in which two modules can be mated.

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "tools/commands.h"

namespace morphbus::tools {
namespace {

struct Options {
  std::string file;
  std::string connection;
  std::vector<std::string> pair;
  bool json = false;
};

const model::ConnectionType* PickConnection(const model::Model& model, const std::string& name) {
  std::vector<std::string> names;
  for (const model::ConnectionType& type : model.connection_types) {
    if (type.name == name || (name.empty() && model.connection_types.size() == 1)) return &type;
    names.push_back(type.name);
  }
  if (names.empty()) {
    Unusable("the model defines no connection");
  } else if (name.empty()) {
    Unusable(fmt::format("the model has several connections; choose one with --connection: {}",
                         fmt::join(names, ", ")));
  } else {
    const std::string nearest = source::NearestName(name, names);
    Unusable(fmt::format("the model has no connection '{}'{}; it has {}", name,
                         nearest.empty() ? "" : fmt::format(" (did you mean '{}'?)", nearest),
                         fmt::join(names, ", ")));
  }
  return nullptr;
}

/// Index of a connector by name, or -1 after saying which names there are.
int PickConnector(const model::ModuleType& type, const std::string& name) {
  if (const std::optional<int> index = type.FindConnector(name)) return *index;
  std::vector<std::string> names;
  for (const model::Connector& connector : type.connectors) names.push_back(connector.name);
  Unusable(fmt::format("--pair: module {} has no connector '{}'; it has {}", type.name, name,
                       fmt::join(names, ", ")));
  return -1;
}

std::string StateName(const model::Model& model, const model::ConnectionType& type,
                      const model::ConnectionOption& option, const model::StateRequirement& state) {
  const model::ModuleType& module =
      model.module_types[static_cast<size_t>(state.of_a ? type.type_a : type.type_b)];
  const int connector = state.of_a ? option.connector_a : option.connector_b;
  return fmt::format("{}.{}.{}", state.of_a ? "a" : "b",
                     module.connectors[static_cast<size_t>(connector)].name, state.variable);
}

int Connections(const Options& options) {
  const std::optional<model::Model> model = LoadModel({options.file});
  if (!model) return kUnusable;
  const model::ConnectionType* type = PickConnection(*model, options.connection);
  if (type == nullptr) return kUnusable;
  const model::ModuleType& type_a = model->module_types[static_cast<size_t>(type->type_a)];
  const model::ModuleType& type_b = model->module_types[static_cast<size_t>(type->type_b)];
  int only_a = -1;
  int only_b = -1;
  if (!options.pair.empty()) {
    only_a = PickConnector(type_a, options.pair[0]);
    if (only_a < 0) return kUnusable;
    only_b = PickConnector(type_b, options.pair[1]);
    if (only_b < 0) return kUnusable;
  }
  Json list = Json::array();
  for (const model::ConnectionOption& option : type->options) {
    if (only_a >= 0 && (option.connector_a != only_a || option.connector_b != only_b)) continue;
    Json state = Json::object();
    for (const model::StateRequirement& s : option.states) {
      state[StateName(*model, *type, option, s)] = AttributeJson(s.value);
    }
    list.push_back({{"number", option.number},
                    {"a", type_a.connectors[static_cast<size_t>(option.connector_a)].name},
                    {"b", type_b.connectors[static_cast<size_t>(option.connector_b)].name},
                    {"pose", PoseJson(option.X_AB)},
                    {"state", state}});
  }
  if (options.json) {
    PrintJson({{"connection", type->name},
               {"candidates", type->candidates},
               {"count", list.size()},
               {"connections", list}});
    return kDone;
  }
  fmt::print("connection {} ({} a, {} b): {} of {} candidates\n", type->name, type_a.name,
             type_b.name, type->options.size(), type->candidates);
  fmt::print("{:>6}  {:<8} {:<8} {:>27}   {:<33} {}\n", "number", "a", "b", "b's origin in a (m)",
             "rotation (w x y z)", "state");
  for (const Json& c : list) {
    const Json& p = c["pose"]["p"];
    const Json& q = c["pose"]["q"];
    fmt::print("{:>6}  {:<8} {:<8} {:9.5f}{:9.5f}{:9.5f}   {:7.4f} {:7.4f} {:7.4f} {:7.4f}   {}\n",
               c["number"].get<int>(), c["a"].get<std::string>(), c["b"].get<std::string>(),
               p[0].get<double>(), p[1].get<double>(), p[2].get<double>(), q[0].get<double>(),
               q[1].get<double>(), q[2].get<double>(), q[3].get<double>(),
               c["state"].empty() ? "" : c["state"].dump());
  }
  return kDone;
}

}  // namespace

void AddConnections(CLI::App& app, Action* action) {
  CLI::App* sub = app.add_subcommand("connections", "List the numbered ways of mating two modules");
  auto options = std::make_shared<Options>();
  sub->add_option("FILE", options->file, "M3L file")->required();
  sub->add_option("--connection", options->connection, "Which connection definition");
  sub->add_option("--pair", options->pair, "Only this pair of connectors, e.g. c1,c4")
      ->delimiter(',')
      ->expected(2)
      ->type_name("A,B");
  sub->add_flag("--json", options->json, "One JSON object on stdout");
  sub->footer(
      "Examples:\n  morphbus connections models/mtran.m3l\n"
      "  morphbus connections models/mtran.m3l --pair c6,c3 --json");
  sub->callback([options, action] { *action = [options] { return Connections(*options); }; });
}

}  // namespace morphbus::tools
