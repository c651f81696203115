// morphbus connections: the numbered ways in which two modules can be mated.

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "tools/commands.h"
#include "tools/connector_pair.h"
#include "tools/json_text.h"
#include "tools/why.h"

namespace morphbus::tools {
namespace {

struct Options {
  std::string file;
  std::string connection;
  std::string pair;
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
    Unusable(fmt::format("the model has no connection '{}'{}; it has {}", name,
                         DidYouMean(name, names), fmt::join(names, ", ")));
  }
  return nullptr;
}

std::string StateName(const model::Model& model, const model::ConnectionType& type,
                      const model::ConnectionOption& option, const model::StateRequirement& state) {
  const model::ModuleType& module =
      model.module_types[static_cast<size_t>(state.of_a ? type.type_a : type.type_b)];
  const int connector = state.of_a ? option.connector_a : option.connector_b;
  return fmt::format("{}.{}.{}", state.of_a ? "a" : "b",
                     module.connectors[static_cast<size_t>(connector)].name, state.variable);
}

/// The pair that `--why` or `--pair` names, if one does; an error if they cannot be used.
Result<std::optional<PairText>> Settle(Options& options) {
  if (options.file.empty() && options.why_pair.find(',') == std::string::npos) {
    options.file.swap(options.why_pair);  // `--why FILE`: the option took the file for a pair.
  }
  if (options.file.empty()) return Fail("FILE is required; see connections --help");
  if (!options.why_pair.empty() && !options.pair.empty()) {
    return Fail("--pair and --why both name a pair of connectors: write it once");
  }
  if (options.why && options.why_pair.empty() && options.pair.empty()) {
    return Fail("--why explains a pair of connectors, such as --why c1,c4");
  }
  if (!options.why_pair.empty()) return ParsePair("--why", options.why_pair);
  if (!options.pair.empty()) return ParsePair("--pair", options.pair);
  return std::optional<PairText>();
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
             "rotation (w x y z)", "a state that will do");
  for (const Json& c : list) {
    const Json& p = c["pose"]["p"];
    const Json& q = c["pose"]["q"];
    fmt::print("{:>6}  {:<8} {:<8} {:9.5f}{:9.5f}{:9.5f}   {:7.4f} {:7.4f} {:7.4f} {:7.4f}   {}\n",
               c["number"].get<int>(), c["a"].get<std::string>(), c["b"].get<std::string>(),
               p[0].get<double>(), p[1].get<double>(), p[2].get<double>(), q[0].get<double>(),
               q[1].get<double>(), q[2].get<double>(), q[3].get<double>(),
               c["state"].empty() ? "" : JsonText(c["state"]));
  }
}

std::string NamesOf(const model::Model& model, const std::vector<ConnectorPair>& pairs) {
  std::vector<std::string> names;
  for (const ConnectorPair& pair : pairs) {
    names.push_back(model.connection_types[pair.connection].name);
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

/// Explains the pair in each connection that has it; as JSON there must be one.
int Explain(const m3l::CompileOutput& compiled, std::vector<ConnectorPair> pairs, bool json) {
  if (json && pairs.size() > 1) {
    return Unusable(
        fmt::format("several connections have this pair; choose one with --connection: {}",
                    NamesOf(compiled.solved, pairs)));
  }
  const std::string all = NamesOf(compiled.solved, pairs);
  std::erase_if(pairs, [&](const ConnectorPair& p) { return !compiled.explainable[p.connection]; });
  if (pairs.empty()) {
    return Unusable(fmt::format(
        "{} has errors in its conditions or its modules, which must be mended first", all));
  }
  for (size_t i = 0; i < pairs.size(); ++i) {
    if (json) {
      PrintJson(WhyJson(compiled, pairs[i].connection, pairs[i].a, pairs[i].b));
    } else {
      if (i > 0) fmt::print("\n");
      PrintWhy(compiled, pairs[i].connection, pairs[i].a, pairs[i].b);
    }
  }
  return compiled.model ? kDone : kUnusable;
}

/// Lists the options of a connection, or those of one pair of connectors.
void List(const model::Model& model, const model::ConnectionType& type, const ConnectorPair* pair,
          bool json) {
  const Json list = ListJson(model, type, pair ? pair->a : -1, pair ? pair->b : -1);
  if (json) {
    PrintJson({{"connection", type.name},
               {"candidates", type.candidates},
               {"count", list.size()},
               {"connections", list}});
    return;
  }
  const model::ModuleType& type_a = model.module_types[static_cast<size_t>(type.type_a)];
  const model::ModuleType& type_b = model.module_types[static_cast<size_t>(type.type_b)];
  fmt::print("connection {} ({} a, {} b): {} of {} candidates\n", type.name, type_a.name,
             type_b.name, type.options.size(), type.candidates);
  if (!list.empty()) {
    PrintList(list);
  } else if (pair != nullptr) {
    const std::string& a = type_a.connectors[static_cast<size_t>(pair->a)].name;
    const std::string& b = type_b.connectors[static_cast<size_t>(pair->b)].name;
    fmt::print("{} of a and {} of b cannot be mated; {}\n", a, b, solver::WhyHint(a, b));
  }
}

int Connections(Options options) {
  const Result<std::optional<PairText>> named = Settle(options);
  if (!named) return Unusable(named.error().message);
  const m3l::CompileOutput compiled = m3l::CompileFiles({options.file});
  PrintDiagnostics(compiled.diagnostics, compiled.sources);
  // Errors elsewhere, in robots say, are no reason not to explain a connection.
  if (!compiled.model && (!options.why || compiled.problems.empty())) return kUnusable;
  const model::Model& model = compiled.solved;
  if (!*named) {
    const model::ConnectionType* type = PickConnection(model, options.connection);
    if (type == nullptr) return kUnusable;
    List(model, *type, nullptr, options.json);
    return kDone;
  }
  const Result<std::vector<ConnectorPair>> pairs = FindPairs(model, options.connection, **named);
  if (!pairs) return Unusable(pairs.error().message);
  if (options.why) return Explain(compiled, *pairs, options.json);
  if (pairs->size() > 1) {
    return Unusable(
        fmt::format("several connections have this pair; choose one with --connection: {}",
                    NamesOf(model, *pairs)));
  }
  const ConnectorPair& pair = pairs->front();
  List(model, model.connection_types[pair.connection], &pair, options.json);
  return kDone;
}

}  // namespace

void AddConnections(CLI::App& app, Action* action) {
  CLI::App* sub = app.add_subcommand("connections", "List the numbered ways of mating two modules");
  auto options = std::make_shared<Options>();
  sub->add_option("FILE", options->file, "M3L file");
  sub->add_option("--connection", options->connection, "Which connection definition");
  sub->add_option("--pair", options->pair, "Only this pair of connectors, e.g. c1,c4")
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
