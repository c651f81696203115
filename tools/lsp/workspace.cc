#include "tools/lsp/workspace.h"

#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <system_error>
#include <utility>

#include "compiler/dynarole/name_index.h"
#include "compiler/m3l/name_index.h"

namespace morphbus::tools {
namespace {

namespace fs = std::filesystem;

/// Folders below that of the workspace are looked into so deep.
constexpr int kMostDepth = 6;

/// Folders of which nobody edits the files.
bool IsSkipped(const std::string& name) {
  return name.starts_with(".") || name == "node_modules" || name == "build";
}

/// The files of one folder that end so, by name.
std::vector<std::string> FilesIn(const fs::path& folder, std::string_view ending) {
  std::vector<std::string> files;
  std::error_code error;
  for (auto entry = fs::directory_iterator(folder, error);
       !error && entry != fs::directory_iterator(); entry.increment(error)) {
    if (files.size() == Workspace::kMostFiles) break;
    if (entry->path().string().ends_with(ending)) files.push_back(CanonicalPath(entry->path()));
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// A module type that several models have counts once: a program has to know its words, and 64
/// types at most.
void AddTypes(const std::vector<keywords::ModuleKeywords>& types, std::set<std::string>* seen,
              std::vector<keywords::ModuleKeywords>* all) {
  for (const keywords::ModuleKeywords& type : types) {
    std::string key = type.type_name;
    for (const auto& joint : type.joints) key += " " + joint.keyword;
    for (const auto& connector : type.connectors) key += " " + connector.keyword;
    for (const auto& sensor : type.sensors) key += " " + sensor.keyword;
    if (seen->insert(key).second) all->push_back(type);
  }
}

}  // namespace

std::string CanonicalPath(const std::string& path) { return source::CanonicalPath(path).string(); }

Document& Workspace::Open(const std::string& uri, const std::string& language, int version,
                          std::string text) {
  Document& document = documents_[uri];
  document.uri = uri;
  document.path = CanonicalPath(PathOfUri(uri).value_or(uri));
  // A text that was never saved may have no ending yet.
  const bool known = document.is_model() || document.is_program();
  if (!known && language == "m3l") document.path += ".m3l";
  if (!known && language == "dynarole") document.path += ".dyn";
  document.version = version;
  document.Set(std::move(text));
  Changed(&document);
  return document;
}

void Workspace::Changed(Document* document) {
  document->revision = ++revision_;
  open_[document->path] = std::string(document->text());
}

void Workspace::Close(const std::string& uri) {
  const auto found = documents_.find(uri);
  if (found == documents_.end()) return;
  open_.erase(found->second.path);
  // Nothing is kept of a text that may never come back.
  model_files_.erase(found->second.path);
  program_files_.erase(found->second.path);
  documents_.erase(found);
}

Document* Workspace::Find(const std::string& uri) {
  const auto found = documents_.find(uri);
  return found == documents_.end() ? nullptr : &found->second;
}

Workspace Workspace::WithTexts(const std::map<std::string, std::string>& texts) const {
  Workspace other;
  other.SetFolders(folders_);
  other.SetModels(models_);
  for (const auto& [uri, document] : documents_) {
    if (!texts.contains(document.path)) {
      other.Open(uri, document.is_model() ? "m3l" : "dynarole", 1, std::string(document.text()));
    }
  }
  for (const auto& [path, text] : texts) {
    other.Open(UriOf(path), path.ends_with(".m3l") ? "m3l" : "dynarole", 1, text);
  }
  return other;
}

std::string Workspace::UriOf(const std::string& path) const {
  for (const auto& [uri, document] : documents_) {
    if (document.path == path) return uri;
  }
  return UriOfPath(path);
}

TextStamp Workspace::StampOf(const std::string& path) const {
  TextStamp stamp;
  stamp.path = path;
  for (const auto& [uri, document] : documents_) {
    if (document.path != path) continue;
    stamp.revision = document.revision;
    return stamp;
  }
  // A file that is not there has no size.
  struct stat status = {};
  if (stat(path.c_str(), &status) != 0) return stamp;
  stamp.modified_ns =
      static_cast<int64_t>(status.st_mtim.tv_sec) * 1'000'000'000 + status.st_mtim.tv_nsec;
  stamp.size = status.st_size;
  return stamp;
}

bool Workspace::IsCurrent(const std::vector<TextStamp>& stamps) const {
  return !stamps.empty() && std::all_of(stamps.begin(), stamps.end(), [&](const TextStamp& stamp) {
    return StampOf(stamp.path) == stamp;
  });
}

const ModelFile& Workspace::Model(const std::string& path) {
  ModelFile& model = model_files_[path];
  if (IsCurrent(model.stamps)) return model;
  model = ModelFile();
  model.path = path;
  model.compiled = m3l::CompileFiles({path}, m3l::Dump::kNone, &open_);
  // The file itself is the first text, also where it could not be read.
  if (model.compiled.sources.size() == 0) model.compiled.sources.AddText(path, "");
  model.names = m3l::IndexNames(model.compiled.files);
  for (const model::ModuleType& type : model.compiled.solved.module_types) {
    // A type whose words clash is an error for programs, and not for the model.
    if (Result<keywords::ModuleKeywords> words = keywords::KeywordsOf(type)) {
      model.keywords.push_back(std::move(*words));
    }
  }
  // The file itself counts also where it could not be read.
  model.stamps.push_back(StampOf(path));
  for (int file = 0; file < model.compiled.sources.size(); ++file) {
    const std::string used = CanonicalPath(model.compiled.sources.name(file));
    if (used != path) model.stamps.push_back(StampOf(used));
  }
  return model;
}

const ProgramFile& Workspace::Program(const std::string& path) {
  ProgramFile& program = program_files_[path];
  std::vector<std::string> models = ModelsFor(path);
  if (program.models == models && IsCurrent(program.stamps)) return program;
  program = ProgramFile();
  program.path = path;
  program.models = std::move(models);
  program.stamps.push_back(StampOf(path));
  std::set<std::string> seen;
  std::vector<keywords::ModuleKeywords> types;
  for (const std::string& name : program.models) {
    const ModelFile& model = Model(name);
    AddTypes(model.keywords, &seen, &types);
    program.stamps.insert(program.stamps.end(), model.stamps.begin(), model.stamps.end());
  }
  // More types than a program can know: the first ones.
  types.resize(std::min<size_t>(types.size(), 64));
  if (Result<keywords::KeywordTable> table = keywords::KeywordTable::Of(types)) {
    program.keywords = std::move(*table);
  }
  const auto open = open_.find(path);
  Result<std::string> text =
      open != open_.end() ? Result<std::string>(open->second) : source::ReadSourceFile(path);
  if (!text) {
    const int file = program.compiled.sources.AddText(path, "");
    program.compiled.diagnostics.Error({file, 0, 0}, text.error().message);
    return program;
  }
  program.compiled = dynarole::CompileProgram(path, *text, program.keywords, dynarole::Dump::kNone,
                                              &program.names, Reader());
  // A file that could not be read may come to be.
  std::set<std::string> used;
  for (int file = 1; file < program.compiled.sources.size(); ++file) {
    used.insert(CanonicalPath(program.compiled.sources.name(file)));
  }
  for (const dynarole::ImportDecl& import : program.compiled.imports) {
    used.insert(PathOf(program.compiled, import));
  }
  for (const std::string& file : used) program.stamps.push_back(StampOf(file));
  return program;
}

std::string PathOf(const dynarole::CompileResult& program, const dynarole::ImportDecl& import) {
  return CanonicalPath(fs::path(program.sources.name(import.span.file)).parent_path() /
                       import.path);
}

std::vector<std::string> Workspace::ModelsFor(const std::string& program) const {
  std::vector<std::string> chosen;
  for (const std::string& model : models_) {
    const fs::path base =
        folders_.empty() ? fs::path(program).parent_path() : fs::path(folders_[0]);
    chosen.push_back(CanonicalPath(base / model));
  }
  if (!chosen.empty()) return chosen;
  // Up to the folder of the workspace; without one, that of the program and the one above it.
  fs::path folder = fs::path(program).parent_path();
  for (int depth = 0; depth < kMostDepth && !folder.empty(); ++depth) {
    std::vector<std::string> found = FilesIn(folder, ".m3l");
    if (!found.empty()) return found;
    const bool is_top = std::find(folders_.begin(), folders_.end(), folder) != folders_.end();
    if (is_top || folder == folder.parent_path() || (folders_.empty() && depth == 1)) break;
    folder = folder.parent_path();
  }
  return {};
}

std::vector<std::string> Workspace::Files(std::string_view ending) const {
  std::set<std::string> files;
  for (const auto& [uri, document] : documents_) {
    if (document.path.ends_with(ending)) files.insert(document.path);
  }
  for (const std::string& folder : folders_) {
    std::error_code error;
    fs::recursive_directory_iterator entry(folder, fs::directory_options::skip_permission_denied,
                                           error);
    for (; !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
      if (files.size() >= kMostFiles) break;
      const std::string name = entry->path().filename();
      if (entry->is_directory(error) && (IsSkipped(name) || entry.depth() >= kMostDepth)) {
        entry.disable_recursion_pending();
      } else if (name.ends_with(ending)) {
        files.insert(CanonicalPath(entry->path()));
      }
    }
  }
  return {files.begin(), files.end()};
}

}  // namespace morphbus::tools
