// morphbus connections: the numbered ways in which two modules can be mated.

#include <fmt/format.h>

#include "compiler/base/columns.h"
#include "tools/base/print.h"
#include "tools/commands/commands.h"
#include "tools/commands/connector_pair.h"
#include "tools/commands/why.h"

namespace morphbus::tools {
namespace {

/// The options of `morphbus connections`.
struct ConnectionsOptions {
  std::string file;
  std::string connection;
  std::string pair;
  std::string why_pair;
  bool why = false;
  bool json = false;
};

/// "b.c3.extended": a state variable of a connector of member a or b.
std::string StateName(const model::Model& model, const model::ConnectionType& type,
                      const model::ConnectionOption& option, const model::StateRequirement& state) {
  const model::ModuleType& module = model.module_types[state.of_a ? type.type_a : type.type_b];
  const int connector = state.of_a ? option.connector_a : option.connector_b;
  return fmt::format("{}.{}.{}", state.of_a ? "a" : "b", module.connectors[connector].name,
                     state.variable);
}

/// A setting of the state variables of both members, by their full names.
Json SettingJson(const model::Model& model, const model::ConnectionType& type,
                 const model::ConnectionOption& option, const model::StateSetting& setting) {
  Json states = Json::object();
  for (const model::StateRequirement& s : setting) {
    states[StateName(model, type, option, s)] = AttributeJson(s.value);
  }
  return states;
}

/// The pair that `--why` or `--pair` names, if one does; an error if the two cannot be used
/// together. It also moves the file to its place in `options` where the option --why took it for
/// its value.
Result<std::optional<PairText>> Settle(ConnectionsOptions& options) {
  if (options.file.empty() && options.why_pair.find(',') == std::string::npos) {
    options.file.swap(options.why_pair);  // `--why FILE`: the option took the file for a pair.
  }
  // What is missing or said twice is named before any file is read.
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

/// The list as docs/cli.md has it; with `only_a` and `only_b`, only that pair of connectors.
Json ListJson(const model::Model& model, const model::ConnectionType& type, int only_a,
              int only_b) {
  const model::ModuleType& type_a = model.module_types[type.type_a];
  const model::ModuleType& type_b = model.module_types[type.type_b];
  Json list = Json::array();
  for (const model::ConnectionOption& option : type.options) {
    if (only_a >= 0 && (option.connector_a != only_a || option.connector_b != only_b)) continue;
    Json others = Json::array();
    for (const model::StateSetting& setting : option.other_states) {
      others.push_back(SettingJson(model, type, option, setting));
    }
    Json item = {{"number", option.number},
                 {"a", type_a.connectors[option.connector_a].name},
                 {"b", type_b.connectors[option.connector_b].name},
                 {"pose", PoseJson(option.X_AB)},
                 {"state", SettingJson(model, type, option, option.states)}};
    // Most options hold in one setting of their states; only those with more have the key.
    if (!others.empty()) item["other_states"] = others;
    list.push_back(std::move(item));
  }
  return list;
}

/// The same for people, a line a connection.
void PrintList(const Json& list) {
  std::vector<std::vector<std::string>> rows = {
      {"number", "a", "b", "b's origin in a (m)", "rotation (w x y z)", "in which states"}};
  for (const Json& c : list) {
    // The pose is X_AB: the position of b's origin in a, and the rotation w x y z.
    std::string states = c["state"].empty() ? "" : JsonText(c["state"]);
    for (const Json& other : c.value("other_states", Json::array())) {
      states += " or " + JsonText(other);
    }
    rows.push_back({fmt::format("{:>6}", c["number"].get<int>()), c["a"].get<std::string>(),
                    c["b"].get<std::string>(),
                    fmt::format("{:9.5f}", fmt::join(Numbers(c["pose"]["p"]), "")),
                    fmt::format("{:7.4f}", fmt::join(Numbers(c["pose"]["q"]), " ")), states});
  }
  PrintText(Columns(rows));
}

/// The names of the connections that have the pair, for a message.
std::string ConnectionNames(const model::Model& model, const std::vector<ConnectorPair>& pairs) {
  std::vector<std::string> names;
  for (const ConnectorPair& pair : pairs) {
    names.push_back(model.connection_types[pair.connection].name);
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

/// Explains the pair in each connection that has it; as JSON there must be one.
int Explain(const m3l::CompileOutput& compiled, std::vector<ConnectorPair> pairs, bool json) {
  // One JSON object holds one explanation.
  if (json && pairs.size() > 1) {
    return Unusable(
        fmt::format("several connections have this pair; choose one with --connection: {}",
                    ConnectionNames(compiled.solved, pairs)));
  }
  // A connection whose own text has errors was not solved: it cannot be explained.
  const std::string all = ConnectionNames(compiled.solved, pairs);
  std::erase_if(pairs, [&](const ConnectorPair& p) { return !compiled.explainable[p.connection]; });
  if (pairs.empty()) {
    return Unusable(fmt::format(
        "{} has errors in its conditions or its modules, which must be mended first", all));
  }
  // As text, several explanations follow each other.
  for (size_t i = 0; i < pairs.size(); ++i) {
    if (json) {
      PrintJson(WhyJson(compiled, pairs[i].connection, pairs[i].a, pairs[i].b));
    } else {
      if (i > 0) Print("\n");
      PrintWhy(compiled, pairs[i].connection, pairs[i].a, pairs[i].b);
    }
  }
  return compiled.model ? kDone : kUnusable;
}

/// Lists the options of a connection, or those of one pair of connectors.
void List(const model::Model& model, const model::ConnectionType& type, const ConnectorPair* pair,
          bool json) {
  // The pair, if there is one, filters the list; -1 stands for none.
  const Json list = ListJson(model, type, pair ? pair->a : -1, pair ? pair->b : -1);
  if (json) {
    PrintJson({{"connection", type.name},
               {"candidates", type.candidates},
               {"count", list.size()},
               {"connections", list}});
    return;
  }
  const model::ModuleType& type_a = model.module_types[type.type_a];
  const model::ModuleType& type_b = model.module_types[type.type_b];
  Print("connection {} ({} a, {} b): {} of {} candidates\n", type.name, type_a.name, type_b.name,
        type.options.size(), type.candidates);
  // An empty list for a pair is an answer that calls for the reason.
  if (!list.empty()) {
    PrintList(list);
  } else if (pair != nullptr) {
    const std::string& a = type_a.connectors[pair->a].name;
    const std::string& b = type_b.connectors[pair->b].name;
    Print("{} of a and {} of b cannot be mated; {}\n", a, b, solver::WhyHint(a, b));
  }
}

/// Lists all connections or those of one pair, or explains a pair.
int Connections(ConnectionsOptions options) {
  const Result<std::optional<PairText>> named = Settle(options);
  if (!named) return Unusable(named.error().message);
  // Not LoadModel: with --why a model may have errors elsewhere.
  const m3l::CompileOutput compiled = m3l::CompileFiles({options.file});
  PrintDiagnostics(compiled.diagnostics, compiled.sources);
  // Errors elsewhere, in robots say, are no reason not to explain a connection.
  if (!compiled.model && (!options.why || compiled.problems.empty())) return kUnusable;
  const model::Model& model = compiled.solved;
  // Without a pair one whole connection is listed.
  if (!*named) {
    const model::ConnectionType* type =
        PickByName(model.connection_types, options.connection, "connection");
    if (type == nullptr) return kUnusable;
    List(model, *type, nullptr, options.json);
    return kDone;
  }
  const Result<std::vector<ConnectorPair>> pairs = FindPairs(model, options.connection, **named);
  if (!pairs) {
    // What the errors above are about may be what is not found.
    const char* left_out = "; connections with errors in their members are left out";
    return Unusable(pairs.error().message + (compiled.model ? "" : left_out));
  }
  if (options.why) return Explain(compiled, *pairs, options.json);
  // A list is of one connection: its numbers mean nothing in another.
  if (pairs->size() > 1) {
    return Unusable(
        fmt::format("several connections have this pair; choose one with --connection: {}",
                    ConnectionNames(model, *pairs)));
  }
  const ConnectorPair& pair = pairs->front();
  List(model, model.connection_types[pair.connection], &pair, options.json);
  return kDone;
}

}  // namespace

void AddConnections(CommandLine* line) {
  Subcommand sub = line->Add("connections", "List the numbered ways of mating two modules");
  auto options = std::make_shared<ConnectionsOptions>();
  sub.Add("FILE.m3l", &options->file, "M3L file");
  sub.Add("--connection", &options->connection, "Which connection definition")
      .TypeName("CONNECTION");
  sub.Add("--pair", &options->pair, "Only this pair of connectors, e.g. c1,c4").TypeName("A,B");
  const Option why = sub.Add("--why", &options->why_pair,
                             "Explain a pair of connectors: every candidate, and what removed it")
                         .ValueOptional()
                         .TypeName("A,B");
  sub.Json(&options->json);
  sub.Footer(
      "Examples:\n  morphbus connections models/mtran.m3l\n"
      "  morphbus connections models/mtran.m3l --pair c6,c3 --json\n"
      "  morphbus connections models/mtran.m3l --why c6,c3");
  sub.Do([options, why] {
    // --why may stand without a value, with --pair beside it, so its presence counts.
    options->why = why.given();
    return Connections(*options);
  });
}

}  // namespace morphbus::tools
