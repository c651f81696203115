// morphbus connections: the numbered ways in which two modules can be mated.

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "tools/commands.h"
#include "tools/why.h"

namespace morphbus::tools {
namespace {

struct Options {
  std::string file;
  std::string connection;
  std::vector<std::string> pair;
  std::string why_pair;
  bool why = false;
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

/// Sorts out what `--why` took, and reports what is missing; a status if it cannot be used.
std::optional<int> Settle(Options& options) {
  if (options.file.empty() && options.why_pair.find(',') == std::string::npos) {
    options.file.swap(options.why_pair);  // `--why FILE`: the option took the file for a pair.
  }
  if (options.file.empty()) return Unusable("FILE is required; see connections --help");
  if (!options.why_pair.empty()) {
    const size_t comma = options.why_pair.find(',');
    if (comma == std::string::npos) {
      return Unusable("--why: expected a pair of connectors, such as c1,c4");
    }
    options.pair = {options.why_pair.substr(0, comma), options.why_pair.substr(comma + 1)};
  }
  if (options.why && options.pair.empty()) {
    return Unusable("--why explains a pair of connectors, such as --why c1,c4");
  }
  return std::nullopt;
}

Json ListJson(const model::Model& model, const model::ConnectionType& type, int only_a,
              int only_b) {
  const model::ModuleType& type_a = model.module_types[static_cast<size_t>(type.type_a)];
  const model::ModuleType& type_b = model.module_types[static_cast<size_t>(type.type_b)];
  Json list = Json::array();
  for (const model::ConnectionOption& option : type.options) {
    if (only_a >= 0 && (option.connector_a != only_a || option.connector_b != only_b)) continue;
    Json state = Json::object();
    for (const model::StateRequirement& s : option.states) {
      state[StateName(model, type, option, s)] = AttributeJson(s.value);
    }
    list.push_back({{"number", option.number},
                    {"a", type_a.connectors[static_cast<size_t>(option.connector_a)].name},
                    {"b", type_b.connectors[static_cast<size_t>(option.connector_b)].name},
                    {"pose", PoseJson(option.X_AB)},
                    {"state", state}});
  }
  return list;
}

void PrintList(const Json& list) {
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
}

int Connections(Options options) {
  if (const std::optional<int> unusable = Settle(options)) return *unusable;
  const m3l::CompileOutput compiled = m3l::CompileFiles({options.file});
  PrintDiagnostics(compiled.diagnostics, compiled.sources);
  const std::optional<model::Model>& model = compiled.model;
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
  if (options.why) {
    const auto index = static_cast<size_t>(type - model->connection_types.data());
    if (options.json) {
      PrintJson(WhyJson(compiled, index, only_a, only_b));
    } else {
      PrintWhy(compiled, index, only_a, only_b);
    }
    return kDone;
  }
  const Json list = ListJson(*model, *type, only_a, only_b);
  if (options.json) {
    PrintJson({{"connection", type->name},
               {"candidates", type->candidates},
               {"count", list.size()},
               {"connections", list}});
  } else {
    fmt::print("connection {} ({} a, {} b): {} of {} candidates\n", type->name, type_a.name,
               type_b.name, type->options.size(), type->candidates);
    PrintList(list);
  }
  return kDone;
}

}  // namespace

void AddConnections(CLI::App& app, Action* action) {
  CLI::App* sub = app.add_subcommand("connections", "List the numbered ways of mating two modules");
  auto options = std::make_shared<Options>();
  sub->add_option("FILE", options->file, "M3L file");
  sub->add_option("--connection", options->connection, "Which connection definition");
  sub->add_option("--pair", options->pair, "Only this pair of connectors, e.g. c1,c4")
      ->delimiter(',')
      ->expected(2)
      ->type_name("A,B");
  auto* why = sub->add_option("--why", options->why_pair,
                              "Explain a pair of connectors: every candidate, and what removed it")
                  ->expected(0, 1)
                  ->type_name("A,B");
  sub->add_flag("--json", options->json, "One JSON object on stdout");
  sub->footer(
      "Examples:\n  morphbus connections models/mtran.m3l\n"
      "  morphbus connections models/mtran.m3l --pair c6,c3 --json\n"
      "  morphbus connections models/mtran.m3l --why c6,c3");
  sub->callback([options, why, action] {
    options->why = why->count() > 0;
    *action = [options] { return Connections(*options); };
  });
}

}  // namespace morphbus::tools
