#include "tools/lsp/navigation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <iterator>
#include <set>
#include <tuple>
#include <utility>

#include "compiler/dynarole/lexer.h"
#include "compiler/m3l/lexer.h"
#include "tools/lsp/program_hover.h"

namespace morphbus::tools {
namespace {

using source::NamedThing;
using source::NameKind;

/// An answer to a search of the workspace has no more symbols.
constexpr size_t kMostSymbols = 200;

bool IsModelPath(const std::string& path) { return path.ends_with(".m3l"); }

/// What an outline calls a thing (LSP 3.17, SymbolKind); 0 for what it leaves out.
int SymbolKindOf(NameKind kind) {
  switch (kind) {
    case NameKind::kModule:
    case NameKind::kRole:
      return 5;  // Class.
    case NameKind::kRobot:
      return 2;  // Module.
    case NameKind::kConnection:
      return 11;  // Interface.
    case NameKind::kLink:
      return 23;  // Struct.
    case NameKind::kJoint:
      return 9;  // Constructor, which editors draw as what acts.
    case NameKind::kPoint:
    case NameKind::kLabel:
      return 7;  // Property.
    case NameKind::kAxis:
    case NameKind::kField:
      return 8;  // Field.
    case NameKind::kSensor:
    case NameKind::kHandler:
      return 24;  // Event.
    case NameKind::kInstance:
      return 19;  // Object.
    case NameKind::kEnumeration:
      return 10;  // Enum.
    case NameKind::kConstant:
    case NameKind::kParameter:
      return 14;  // Constant.
    case NameKind::kStartup:
    case NameKind::kBehavior:
    case NameKind::kCommand:
      return 6;  // Method.
    case NameKind::kFunction:
      return 12;  // Function.
    default:
      return 0;
  }
}

bool IsName(const std::string& name) {
  const auto starts = [](char c) {
    return std::isalpha(static_cast<unsigned char>(c)) || c == '_';
  };
  return !name.empty() && name.size() < 1000 && starts(name[0]) &&
         std::all_of(name.begin(), name.end(), [](char c) {
           return std::isalnum(static_cast<unsigned char>(c)) || c == '_';
         });
}

bool IsReserved(const std::string& name, bool model) {
  if (model) {
    return m3l::IsKeyword(name) || m3l::IsOperatorWord(name) || name == "pi" || name == "true" ||
           name == "false" || name == "bool";
  }
  const std::vector<std::string_view> words = dynarole::ReservedWords();
  return std::find(words.begin(), words.end(), name) != words.end() || name == "Module";
}

/// In the order of files and places, each place once.
void SortByPlace(std::vector<Occurrence>* found) {
  const auto place = [](const Occurrence& one) {
    const Json& start = one.range["start"];
    return std::tuple(one.path, start["line"].get<int>(), start["character"].get<int>());
  };
  std::sort(found->begin(), found->end(),
            [&](const Occurrence& x, const Occurrence& y) { return place(x) < place(y); });
  found->erase(
      std::unique(found->begin(), found->end(),
                  [&](const Occurrence& x, const Occurrence& y) { return place(x) == place(y); }),
      found->end());
}

/// The first place of file 0 where a name of a text that was renamed means another thing than it
/// did, or no thing any more; nothing if both texts say the same.
std::optional<source::Span> FirstOtherMeaning(const source::NameTable& before,
                                              const source::NameTable& after) {
  const auto uses_of = [](const source::NameTable& table) {
    std::vector<source::NameUse> uses;
    std::copy_if(table.uses.begin(), table.uses.end(), std::back_inserter(uses),
                 [](const source::NameUse& use) { return use.span.file == 0; });
    return uses;
  };
  const std::vector<source::NameUse> olds = uses_of(before), news = uses_of(after);
  // The things of both tables in pairs, as they are met.
  std::map<int, int> new_of_old, old_of_new;
  for (size_t i = 0; i < std::min(olds.size(), news.size()); ++i) {
    const int is = news[i].thing, was = olds[i].thing;
    const bool same = new_of_old.try_emplace(was, is).first->second == is &&
                      old_of_new.try_emplace(is, was).first->second == was &&
                      olds[i].declares == news[i].declares;
    if (!same) return news[i].span;
  }
  if (olds.size() == news.size()) return std::nullopt;
  return news.empty() ? source::Span{0, 0, 0} : news.back().span;
}

std::string InSmallLetters(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

}  // namespace

Navigation::Names Navigation::NamesOf(const std::string& path) {
  if (IsModelPath(path)) {
    const ModelFile& model = workspace_.Model(path);
    return {&model.names, &model.compiled.sources};
  }
  const ProgramFile& program = workspace_.Program(path);
  return {&program.names, &program.compiled.sources};
}

Occurrence Navigation::OccurrenceOf(const Names& names, const source::NameUse& use) const {
  Occurrence one;
  one.path = CanonicalPath(names.sources->name(use.span.file));
  one.range = RangeJson(*names.sources, use.span, encoding_);
  one.text = names.sources->text(use.span);
  one.declares = use.declares;
  one.name = names.table->things[use.thing].name;
  return one;
}

Navigation::Declaration Navigation::DeclarationOf(const Names& names, int thing) {
  for (const source::NameUse& use : names.table->uses) {
    if (use.thing != thing || !use.declares) continue;
    return {CanonicalPath(names.sources->name(use.span.file)), use.span.begin};
  }
  return {};
}

void Navigation::Collect(const Names& names, int thing, std::vector<Occurrence>* found) const {
  for (const source::NameUse& use : names.table->uses) {
    if (use.thing == thing) found->push_back(OccurrenceOf(names, use));
  }
}

void Navigation::CollectFromFiles(const Declaration& declaration, std::string_view ending,
                                  std::vector<Occurrence>* found) {
  for (const std::string& path : workspace_.Files(ending)) {
    const Names names = NamesOf(path);
    // The declaring file has another number in each compilation; most do not read it at all.
    int file = 0;
    while (file < names.sources->size() &&
           CanonicalPath(names.sources->name(file)) != declaration.path) {
      ++file;
    }
    for (const source::NameUse& use : names.table->uses) {
      const bool here = use.span.file == file && use.span.begin == declaration.begin;
      if (here && use.declares) Collect(names, use.thing, found);
    }
  }
}

void Navigation::CollectFromModels(const Declaration& declaration, const std::string& keyword,
                                   std::vector<Occurrence>* found) {
  CollectFromFiles(declaration, ".m3l", found);
  if (keyword.empty()) return;
  for (const std::string& path : workspace_.Files(".dyn")) {
    const std::vector<std::string> models = workspace_.Program(path).models;
    bool known = false;
    for (const KeywordPart& part : PartsOfKeyword(&workspace_, models, keyword)) {
      known = known || DeclarationOf(NamesOf(part.model), part.thing) == declaration;
    }
    // A keyword of the same spelling may be that of another model's part.
    if (!known) continue;
    const Names names = NamesOf(path);
    const int thing = names.table->Find(NameKind::kKeyword, keyword);
    if (thing >= 0) Collect(names, thing, found);
  }
}

std::vector<Occurrence> Navigation::ImportedAt(const std::string& path, size_t offset) {
  const dynarole::CompileResult& program = workspace_.Program(path).compiled;
  for (const dynarole::ImportDecl& import : program.imports) {
    if (import.span.file != 0 || offset < import.span.begin || offset > import.span.end) continue;
    const Json begin = {{"line", 0}, {"character", 0}};
    return {{.path = PathOf(program, import),
             .range = {{"start", begin}, {"end", begin}},
             .text = "",
             .declares = true,
             .name = ""}};
  }
  return {};
}

std::vector<Occurrence> Navigation::Declarations(const std::string& path, size_t offset) {
  std::vector<Occurrence> found;
  const Names names = NamesOf(path);
  const source::NameUse* use = names.table->At(0, offset);
  if (use == nullptr) return IsModelPath(path) ? found : ImportedAt(path, offset);
  const NamedThing thing = names.table->things[use->thing];
  if (thing.kind == NameKind::kKeyword) {
    const std::vector<std::string> models = workspace_.Program(path).models;
    for (const KeywordPart& part : PartsOfKeyword(&workspace_, models, thing.name)) {
      Collect(NamesOf(part.model), part.thing, &found);
    }
  } else {
    Collect(names, use->thing, &found);
  }
  std::erase_if(found, [](const Occurrence& one) { return !one.declares; });
  SortByPlace(&found);
  return found;
}

std::vector<Occurrence> Navigation::Find(const std::string& path, size_t offset) {
  std::vector<Occurrence> found;
  const Names names = NamesOf(path);
  const source::NameUse* use = names.table->At(0, offset);
  if (use == nullptr) return found;
  const int index = use->thing;
  const NamedThing thing = names.table->things[index];
  if (IsModelPath(path)) {
    CollectFromModels(DeclarationOf(names, index), KeywordOfThing(thing), &found);
    // A file that is in no folder of the workspace is in no list of its files.
    Collect(NamesOf(path), index, &found);
  } else if (thing.kind == NameKind::kKeyword) {
    const std::vector<std::string> models = workspace_.Program(path).models;
    for (const KeywordPart& part : PartsOfKeyword(&workspace_, models, thing.name)) {
      CollectFromModels(DeclarationOf(NamesOf(part.model), part.thing), thing.name, &found);
    }
    Collect(NamesOf(path), index, &found);
  } else {
    Collect(names, index, &found);
    // What stands outside a routine may be known in other programs, too.
    const Declaration declaration = DeclarationOf(names, index);
    const bool everywhere = thing.kind != NameKind::kVariable && !declaration.path.empty();
    if (everywhere) CollectFromFiles(declaration, ".dyn", &found);
  }
  return found;
}

std::vector<Occurrence> Navigation::Everywhere(const std::string& path, size_t offset) {
  std::vector<Occurrence> found = Find(path, offset);
  SortByPlace(&found);
  return found;
}

std::vector<Occurrence> Navigation::InFile(const std::string& path, size_t offset) {
  std::vector<Occurrence> found;
  const Names names = NamesOf(path);
  const source::NameUse* use = names.table->At(0, offset);
  if (use == nullptr) return found;
  Collect(names, use->thing, &found);
  std::erase_if(found, [&](const Occurrence& one) { return one.path != path; });
  SortByPlace(&found);
  return found;
}

Result<Occurrence> Navigation::Renamable(const std::string& path, size_t offset) {
  const Names names = NamesOf(path);
  const source::NameUse* use = names.table->At(0, offset);
  if (use == nullptr) return Fail("there is no name here");
  const NamedThing& thing = names.table->things[use->thing];
  if (thing.kind == NameKind::kKeyword) {
    return Fail("this is the keyword of a part of a module: rename the part in its model");
  }
  if (thing.kind == NameKind::kBuiltin || thing.extent.file < 0) {
    return Fail("'" + thing.name + "' belongs to the language");
  }
  Occurrence one = OccurrenceOf(names, *use);
  // A sign before the name stays.
  const size_t sign = one.text.size() - std::min(one.text.size(), thing.name.size());
  const source::Span name{use->span.file, use->span.begin + sign, use->span.end};
  one.range = RangeJson(*names.sources, name, encoding_);
  one.text = names.sources->text(name);
  return one;
}

Result<Json> Navigation::Rename(const std::string& path, size_t offset, const std::string& name) {
  const Result<Occurrence> here = Renamable(path, offset);
  if (!here) return Fail(here.error().message);
  const bool model = IsModelPath(path);
  if (!IsName(name)) {
    return Fail("'" + name + "' is no name: letters, digits and _, not a digit first");
  }
  if (IsReserved(name, model)) return Fail("'" + name + "' is a word of the language");
  // In one place two things cannot have one name.
  const Names names = NamesOf(path);
  const NamedThing thing = names.table->things[names.table->At(0, offset)->thing];
  for (const NamedThing& other : names.table->things) {
    if (other.owner != thing.owner || other.name != name || other.extent.file < 0) continue;
    // Variables share a name where neither is seen by the other.
    if (thing.kind == NameKind::kVariable && other.kind == NameKind::kVariable) continue;
    return Fail("there is another '" + name + "'");
  }
  // What stands for the thing in programs follows from its new name.
  NamedThing renamed = thing;
  renamed.name = name;
  const std::string keyword = KeywordOfThing(renamed);
  std::map<std::string, Json> edits;
  for (const Occurrence& one : Everywhere(path, offset)) {
    // Programs have the keyword of a thing of a model; what stands before either stays.
    const std::string& text = IsModelPath(one.path) == model ? name : keyword;
    if (!one.text.ends_with(one.name)) continue;
    edits[one.path].push_back(
        {{"range", one.range},
         {"newText", one.text.substr(0, one.text.size() - one.name.size()) + text}});
  }
  if (const std::optional<std::string> why = WhyMeaningsChange(edits)) return Fail(*why);
  Json changes = Json::object();
  for (auto& [file, list] : edits) changes[workspace_.UriOf(file)] = std::move(list);
  return Json{{"changes", changes}};
}

std::optional<std::string> Navigation::WhyMeaningsChange(const std::map<std::string, Json>& edits) {
  std::map<std::string, std::string> texts;
  for (const auto& [path, list] : edits) {
    Document changed;
    changed.Set(std::string(NamesOf(path).sources->text(0)));
    // From the last to the first, the places before an edit stay.
    for (auto edit = list.rbegin(); edit != list.rend(); ++edit) {
      changed.Change({{"range", (*edit)["range"]}, {"text", (*edit)["newText"]}}, encoding_);
    }
    texts[path] = changed.text();
  }
  // All is compiled as it would be: no rule about scopes has to be known here.
  Workspace renamed = workspace_.WithTexts(texts);
  Navigation after(&renamed, encoding_);
  // Programs that import a text are asked, too.
  std::set<std::string> paths;
  for (const auto& [path, text] : texts) paths.insert(path);
  for (const std::string& path : workspace_.Files(".dyn")) {
    const source::SourceSet& sources = *NamesOf(path).sources;
    for (int file = 1; file < sources.size(); ++file) {
      if (texts.contains(CanonicalPath(sources.name(file)))) paths.insert(path);
    }
  }
  for (const std::string& path : paths) {
    const Names old_names = NamesOf(path), new_names = after.NamesOf(path);
    const std::optional<source::Span> place = FirstOtherMeaning(*old_names.table, *new_names.table);
    if (!place) continue;
    const source::SourceSet& sources = *new_names.sources;
    return fmt::format("{}:{}: '{}' would mean something else than now: choose another name",
                       std::filesystem::path(path).filename().string(),
                       sources.LineOf(0, place->begin), sources.text(*place));
  }
  return std::nullopt;
}

Json Navigation::Outline(const std::string& path) {
  const Names names = NamesOf(path);
  // Children are gathered under their owners, which stand before them in the table.
  std::vector<Json> symbols(names.table->things.size());
  std::vector<source::Span> places(names.table->things.size(), source::Span{-1, 0, 0});
  for (const source::NameUse& use : names.table->uses) {
    if (use.declares && use.span.file == 0 && places[use.thing].file < 0) {
      places[use.thing] = use.span;
    }
  }
  const auto included = [&](int i) {
    return places[i].file == 0 && SymbolKindOf(names.table->things[i].kind) > 0;
  };
  for (int i = 0; i < std::ssize(symbols); ++i) {
    if (!included(i)) continue;
    const NamedThing& thing = names.table->things[i];
    // The protocol wants the name within the whole.
    source::Span all = thing.extent.file == 0 ? thing.extent : places[i];
    all.begin = std::min(all.begin, places[i].begin);
    all.end = std::max(all.end, places[i].end);
    symbols[i] = {{"name", thing.name},
                  {"kind", SymbolKindOf(thing.kind)},
                  {"range", RangeJson(*names.sources, all, encoding_)},
                  {"selectionRange", RangeJson(*names.sources, places[i], encoding_)},
                  {"children", Json::array()}};
    if (!thing.summary.empty()) symbols[i]["detail"] = thing.summary;
  }
  // From the last to the first, each is whole when it goes into its owner.
  Json outline = Json::array();
  for (int i = static_cast<int>(std::ssize(symbols)) - 1; i >= 0; --i) {
    if (!included(i)) continue;
    const int owner = names.table->things[i].owner;
    Json& list = owner >= 0 && included(owner) ? symbols[owner]["children"] : outline;
    list.insert(list.begin(), std::move(symbols[i]));
  }
  return outline;
}

Json Navigation::Search(const std::string& query) {
  const std::string wanted = InSmallLetters(query);
  Json symbols = Json::array();
  for (const char* ending : {".m3l", ".dyn"}) {
    for (const std::string& path : workspace_.Files(ending)) {
      const Names names = NamesOf(path);
      for (const source::NameUse& use : names.table->uses) {
        const NamedThing& thing = names.table->things[use.thing];
        // What a file imports is found in the file that has it.
        if (!use.declares || use.span.file != 0 || SymbolKindOf(thing.kind) == 0) continue;
        if (InSmallLetters(thing.name).find(wanted) == std::string::npos) continue;
        if (symbols.size() == kMostSymbols) return symbols;
        Json symbol = {{"name", thing.name},
                       {"kind", SymbolKindOf(thing.kind)},
                       {"location",
                        {{"uri", workspace_.UriOf(path)},
                         {"range", RangeJson(*names.sources, use.span, encoding_)}}}};
        if (thing.owner >= 0) symbol["containerName"] = names.table->things[thing.owner].name;
        symbols.push_back(std::move(symbol));
      }
    }
  }
  return symbols;
}

}  // namespace morphbus::tools
