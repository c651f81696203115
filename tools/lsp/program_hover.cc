#include "tools/lsp/program_hover.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "compiler/base/text.h"
#include "tools/base/messages.h"
#include "tools/lsp/model_hover.h"
#include "tools/lsp/program_words.h"

namespace morphbus::tools {
namespace {

using source::NamedThing;
using source::NameKind;

/// How many modules of a robot are named.
constexpr size_t kMostModules = 8;

/// What a role asks for: the requirements of all roles above it, and its own.
std::string RequirementsOf(const ProgramFile& program, int role) {
  std::string text;
  for (int at = role; at >= 0; at = program.names.things[at].base) {
    const NamedThing& thing = program.names.things[at];
    std::string own;
    for (const std::string& condition : thing.requirements) {
      own += "require " + condition + ";" + (at == role ? "" : "  // " + thing.name) + "\n";
    }
    text = own + text;
  }
  return text.empty() ? "" : "```dyn\n" + text + "```";
}

/// Whether the role is `ancestor`, or extends it.
bool IsA(const ProgramFile& program, const std::string& role, int ancestor) {
  for (int at = program.names.Find(NameKind::kRole, role); at >= 0;
       at = program.names.things[at].base) {
    if (at == ancestor) return true;
  }
  return false;
}

/// Which modules of which robots take the role, or one that extends it.
std::string TakersOf(const ProgramFile& program, const RoleFits& fits, int role) {
  std::string text;
  for (const RobotFit& fit : fits.fits()) {
    std::vector<std::string> modules;
    for (const StaticRole& module : fit.roles.modules) {
      if (!IsA(program, module.role, role)) continue;
      // The role itself goes without saying.
      const bool itself = module.role == program.names.things[role].name;
      modules.push_back(module.module + (itself ? "" : " (" + module.role + ")"));
    }
    if (modules.empty()) continue;
    text += fmt::format("- {} of {}: {}\n", fit.robot,
                        std::filesystem::path(fit.model).filename().string(),
                        NameFirst(modules, kMostModules));
  }
  if (!text.empty()) text = "taken by\n\n" + text;
  if (!fits.complete()) return text + (text.empty() ? "" : "\n") + "(other robots are being asked)";
  if (!text.empty()) return text;
  return program.models.empty() ? "no model stands beside the program (setting `models`)"
                                : "no module of a robot beside it takes this role";
}

std::string KeywordText(Workspace* workspace, const ProgramFile& program, const std::string& name) {
  std::string text;
  std::set<std::string> said;
  for (const KeywordPart& part : PartsOfKeyword(workspace, program.models, name)) {
    const ModelFile& model = workspace->Model(part.model);
    const NamedThing& thing = model.names.things[part.thing];
    const std::string owner = thing.owner < 0 ? "" : model.names.things[thing.owner].name + ": ";
    const std::string line = owner + ThingLine(model, thing);
    // A module type that several models import is told once.
    if (said.insert(line).second) text += "- " + line + "\n";
  }
  return text;
}

}  // namespace

std::string CommentAbove(const source::SourceSet& sources, int file, size_t offset) {
  const std::string_view text = sources.text(file);
  size_t line = static_cast<size_t>(sources.LineAt(file, offset).data() - text.data());
  std::string comment;
  while (line > 0) {
    const std::string_view above = sources.LineAt(file, line - 1);
    const size_t mark = above.find_first_not_of(" \t");
    if (mark == std::string_view::npos || !above.substr(mark).starts_with("//")) break;
    std::string_view words = above.substr(mark + 2);
    words.remove_prefix(std::min(words.find_first_not_of(" "), words.size()));
    comment = std::string(words) + (comment.empty() ? "" : "\n") + comment;
    line = static_cast<size_t>(above.data() - text.data());
  }
  return comment;
}

std::string KeywordOfThing(const NamedThing& thing) {
  switch (thing.kind) {
    case NameKind::kLink:
    case NameKind::kJoint:
    case NameKind::kPoint:
    case NameKind::kSensor:
    case NameKind::kAttribute:
      return keywords::KeywordOf(thing.name, thing.kind == NameKind::kLink);
    default:
      return "";
  }
}

std::vector<KeywordPart> PartsOfKeyword(Workspace* workspace,
                                        const std::vector<std::string>& models,
                                        const std::string& keyword) {
  std::vector<KeywordPart> parts;
  for (const std::string& path : models) {
    const ModelFile& model = workspace->Model(path);
    for (size_t i = 0; i < model.names.things.size(); ++i) {
      if (KeywordOfThing(model.names.things[i]) != keyword) continue;
      parts.push_back({path, static_cast<int>(i)});
    }
  }
  return parts;
}

std::string ProgramHover(Workspace* workspace, const std::string& path, const RoleFits& fits,
                         size_t offset, source::Span* span) {
  const ProgramFile& program = workspace->Program(path);
  const source::NameUse* use = program.names.At(0, offset);
  if (use == nullptr) return "";
  *span = use->span;
  const NamedThing& thing = program.names.things[use->thing];
  const std::string summary = thing.summary.empty() ? thing.name : thing.summary;
  std::string text = "```dyn\n" + summary + "\n```";
  const auto add = [&](const std::string& paragraph) {
    if (!paragraph.empty()) text += "\n\n" + paragraph;
  };
  if (thing.kind == NameKind::kKeyword) {
    add(KeywordText(workspace, program, thing.name));
  } else if (thing.kind == NameKind::kBuiltin) {
    add(std::string(BuiltinMeaning(thing.name)));
  } else if (thing.extent.file >= 0) {
    add(CommentAbove(program.compiled.sources, thing.extent.file, thing.extent.begin));
  }
  if (thing.kind == NameKind::kRole && thing.extent.file >= 0) {
    add(RequirementsOf(program, use->thing));
    add(TakersOf(program, fits, use->thing));
  }
  return text;
}

}  // namespace morphbus::tools
