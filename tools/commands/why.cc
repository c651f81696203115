#include "tools/commands/why.h"

#include <fmt/format.h>
#include <unistd.h>

#include "compiler/base/text.h"
#include "compiler/solver/explain_pair.h"
#include "compiler/solver/motion_inference.h"
#include "tools/base/messages.h"
#include "tools/base/model_io.h"
#include "tools/base/print.h"

namespace morphbus::tools {
namespace {

/// What all parts of one explanation share: the connection, its two module types, and the
/// connectors of the pair. It refers to the compiled model, which outlives it.
struct Context {
  const m3l::CompileOutput& compiled;
  const model::ConnectionType& connection;
  const model::ModuleType& type_a;
  const model::ModuleType& type_b;
  const model::Connector& a;
  const model::Connector& b;
  // Motions that differ by less than this count as one (m; see MatingTolerance).
  double tolerance = 0.0;
  solver::PairExplanation explanation;
};

/// Solves the pair once more, this time keeping what removed each candidate.
Context Explain(const m3l::CompileOutput& compiled, size_t index, int connector_a,
                int connector_b) {
  const model::Model& model = compiled.solved;
  const model::ConnectionType& connection = model.connection_types[index];
  const auto& type_a = model.module_types[connection.type_a];
  const auto& type_b = model.module_types[connection.type_b];
  return {
      compiled,
      connection,
      type_a,
      type_b,
      type_a.connectors[connector_a],
      type_b.connectors[connector_b],
      solver::MatingTolerance(type_a, type_b),
      solver::ExplainPair(compiled.problems[index], model.module_types, connector_a, connector_b)};
}

/// The numbered option that a kept candidate is.
const model::ConnectionOption* OptionOf(const Context& context,
                                        const solver::ExplainedCandidate& candidate) {
  if (!candidate.kept()) return nullptr;
  // Candidates have no numbers: the same pair and the same motion make the option.
  for (const model::ConnectionOption& option : context.connection.options) {
    if (&context.type_a.connectors[option.connector_a] == &context.a &&
        &context.type_b.connectors[option.connector_b] == &context.b &&
        solver::SameMotion(option.X_AB, candidate.X_AB, context.tolerance)) {
      return &option;
    }
  }
  return nullptr;
}

/// X_AB in words, as `connections` prints poses.
std::string PoseText(const model::Pose& X) {
  const Json pose = PoseJson(X);
  return fmt::format("at ({:.6g}) m, turned ({:.4f})", fmt::join(Numbers(pose["p"]), ", "),
                     fmt::join(Numbers(pose["q"]), " "));
}

/// Which links penetrate each other, and how deep.
std::string OverlapText(const Context& context, const solver::Overlap& overlap) {
  return fmt::format("link {} of a lies {:.6g} m deep in link {} of b",
                     context.type_a.links[overlap.link_a].name, overlap.depth_m,
                     context.type_b.links[overlap.link_b].name);
}

/// A remark with the place in the source underlined, as diagnostics are; on stdout, as it is the
/// result.
void PrintNote(const Context& context, const source::Span& span, const std::string& text) {
  PrintText(
      source::RenderNote({span, text}, context.compiled.sources, IsFancyTerminal(STDOUT_FILENO)));
}

/// One rigid motion: its number if it was kept, else every condition that it breaks.
void PrintCandidate(const Context& context, size_t position,
                    const solver::ExplainedCandidate& candidate) {
  const std::string pose = PoseText(candidate.X_AB);
  // A kept candidate is an option of the connection, with its number in `connections`.
  if (candidate.kept()) {
    const model::ConnectionOption* option = OptionOf(context, candidate);
    Print("\ncandidate {}: b {}: kept{}\n", position, pose,
          option ? fmt::format(", number {}", option->number) : "");
    return;
  }
  // All conditions that fail are named, so that they can be mended together.
  Print("\ncandidate {}: b {}: removed\n", position, pose);
  for (const solver::Failure& failure : candidate.failures) {
    PrintNote(context, failure.span, "does not hold: " + failure.measured);
  }
  if (candidate.overlaps.empty()) return;
  // The deepest; the others follow from it, as a rule.
  const solver::Overlap& overlap = candidate.overlaps.front();
  // Both hulls are underlined, unless they are one: a link of the same module type.
  const auto hull = [&](int type, int link) { return context.compiled.hulls[type][link]; };
  PrintNote(context, hull(context.connection.type_a, overlap.link_a),
            OverlapText(context, overlap));
  const bool same =
      context.connection.type_a == context.connection.type_b && overlap.link_a == overlap.link_b;
  if (!same) PrintNote(context, hull(context.connection.type_b, overlap.link_b), "its hull");
}

/// A condition that does not hold, where it stands, and what was measured.
Json FailureJson(const Context& context, const solver::Failure& failure) {
  const source::SourceSet& sources = context.compiled.sources;
  const source::LineColumn at = sources.Locate(failure.span.file, failure.span.begin);
  return {{"file", sources.name(failure.span.file)},
          {"line", at.line},
          {"column", at.column},
          {"condition", sources.text(failure.span)},
          {"measured", failure.measured}};
}

}  // namespace

void PrintWhy(const m3l::CompileOutput& compiled, size_t connection, int connector_a,
              int connector_b) {
  const Context context = Explain(compiled, connection, connector_a, connector_b);
  const solver::PairExplanation& explanation = context.explanation;
  // `fit` counts the motions that satisfy the conditions; hulls in each other remove some of them.
  size_t kept = 0, fit = 0;
  for (const solver::ExplainedCandidate& candidate : explanation.candidates) {
    kept += candidate.kept() ? 1 : 0;
    fit += candidate.failures.empty() ? 1 : 0;
  }
  Print("connection {}, {} of a ({}) on {} of b ({}): ", context.connection.name, context.a.name,
        context.type_a.name, context.b.name, context.type_b.name);
  // Conditions on attributes hold for every motion or for none.
  if (!explanation.failures.empty()) {
    Print("never, whatever the pose\n");
    for (const solver::Failure& failure : explanation.failures) {
      PrintNote(context, failure.span, "does not hold: " + failure.measured);
    }
    return;
  }
  Print("{} tried, {} the conditions, {} of them kept\n",
        Counted(explanation.candidates.size(), "motion"),
        fmt::format("{} {}", fit, fit == 1 ? "satisfies" : "satisfy"), kept);
  // Conditions that leave a motion free give no finite list of candidates.
  if (explanation.free_motion) {
    PrintNote(
        context, compiled.problems[connection].span,
        fmt::format("the conditions fix no motion: {} is left free", *explanation.free_motion));
  }
  // Where no motion could be fixed, the condition that found no partner is shown with its
  // distances.
  if (explanation.dead_end) {
    PrintNote(context, explanation.dead_end->span, explanation.dead_end->measured);
  }
  for (size_t i = 0; i < explanation.candidates.size(); ++i) {
    PrintCandidate(context, i + 1, explanation.candidates[i]);
  }
  if (!explanation.complete) Print("\n... and more, which are not shown\n");
}

Json WhyJson(const m3l::CompileOutput& compiled, size_t connection, int connector_a,
             int connector_b) {
  const Context context = Explain(compiled, connection, connector_a, connector_b);
  // Conditions that fail for every motion come first: then there are no candidates.
  Json failures = Json::array();
  for (const solver::Failure& failure : context.explanation.failures) {
    failures.push_back(FailureJson(context, failure));
  }
  if (context.explanation.dead_end) {
    failures.push_back(FailureJson(context, *context.explanation.dead_end));
  }
  // Each candidate lists everything that removed it.
  Json candidates = Json::array();
  for (const solver::ExplainedCandidate& candidate : context.explanation.candidates) {
    // A candidate that was kept is an option of the connection, with a number by which robots name
    // it.
    const model::ConnectionOption* option = OptionOf(context, candidate);
    Json broken = Json::array();
    for (const solver::Failure& f : candidate.failures) broken.push_back(FailureJson(context, f));
    Json overlaps = Json::array();
    for (const solver::Overlap& overlap : candidate.overlaps) {
      overlaps.push_back({{"link_a", context.type_a.links[overlap.link_a].name},
                          {"link_b", context.type_b.links[overlap.link_b].name},
                          {"depth_m", overlap.depth_m}});
    }
    candidates.push_back({{"number", option ? Json(option->number) : Json(nullptr)},
                          {"pose", PoseJson(candidate.X_AB)},
                          {"kept", candidate.kept()},
                          {"failures", broken},
                          {"overlaps", overlaps}});
  }
  return {
      {"connection", context.connection.name},
      {"a", context.a.name},
      {"b", context.b.name},
      {"failures", failures},
      {"free", context.explanation.free_motion ? Json(*context.explanation.free_motion) : Json()},
      {"candidates", candidates}};
}

}  // namespace morphbus::tools
