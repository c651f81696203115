#include "tools/lsp/language_server.h"

#include <unistd.h>

#include <optional>
#include <utility>

#include "compiler/base/version.h"
#include "tools/base/messages.h"
#include "tools/base/print.h"
#include "tools/lsp/completion.h"
#include "tools/lsp/edits.h"
#include "tools/lsp/message_stream.h"
#include "tools/lsp/model_hover.h"
#include "tools/lsp/preview.h"
#include "tools/lsp/program_hover.h"

namespace morphbus::tools {
namespace {

// Codes of errors (JSON-RPC 2.0, and LSP 3.17).
constexpr int kParseError = -32700;
constexpr int kInvalidRequest = -32600;
constexpr int kMethodNotFound = -32601;
constexpr int kInvalidParameters = -32602;
constexpr int kNotInitialized = -32002;
constexpr int kRequestFailed = -32803;

/// The text of a member; empty if there is none.
std::string TextOf(const Json& json, const char* key) {
  if (!json.is_object()) return "";
  const auto found = json.find(key);
  return found != json.end() && found->is_string() ? found->get<std::string>() : "";
}

/// A member that is an object or a list; null if there is none.
Json PartOf(const Json& json, const char* key) {
  if (!json.is_object()) return nullptr;
  const auto found = json.find(key);
  return found == json.end() ? Json() : *found;
}

const char* const kNoDocument = "the document is not open, or is neither .m3l nor .dyn";
const char* const kNoPosition = "the position is none";

}  // namespace

const std::map<std::string, LanguageServer::Handler>& LanguageServer::Handlers() {
  static const std::map<std::string, Handler> kHandlers = {
      {"initialize", &LanguageServer::Initialize},
      {"shutdown", &LanguageServer::Shutdown},
      {"textDocument/hover", &LanguageServer::Hover},
      {"textDocument/completion", &LanguageServer::Complete},
      {"textDocument/signatureHelp", &LanguageServer::Signature},
      {"textDocument/definition", &LanguageServer::Definition},
      {"textDocument/references", &LanguageServer::References},
      {"textDocument/documentHighlight", &LanguageServer::Highlight},
      {"textDocument/prepareRename", &LanguageServer::PrepareRename},
      {"textDocument/rename", &LanguageServer::Rename},
      {"textDocument/documentSymbol", &LanguageServer::Symbols},
      {"workspace/symbol", &LanguageServer::WorkspaceSymbols},
      {"textDocument/formatting", &LanguageServer::Format},
      {"textDocument/codeAction", &LanguageServer::Fixes},
      {"textDocument/inlayHint", &LanguageServer::InlayHints},
      {"morphbus/preview", &LanguageServer::Preview},
  };
  return kHandlers;
}

void LanguageServer::Take(const std::string& text) {
  // No exceptions: what does not parse is discarded.
  const Json message = Json::parse(text, nullptr, false);
  if (message.is_discarded()) return AnswerError(nullptr, kParseError, "the message is no JSON");
  if (!message.is_object()) {
    return AnswerError(nullptr, kInvalidRequest, "the message is no object");
  }
  const Json id = PartOf(message, "id");
  if (!id.is_null() && !id.is_number_integer() && !id.is_string()) {
    return AnswerError(nullptr, kInvalidRequest, "the id is neither a number nor a text");
  }
  const std::string method = TextOf(message, "method");
  const Json parameters = PartOf(message, "params");
  // An answer to a request of ours has no method; we send none that we wait for.
  if (method.empty()) {
    if (message.contains("result") || message.contains("error")) return;
    return AnswerError(id, kInvalidRequest, "the message has no method");
  }
  if (message.contains("id")) {
    Answer(id, method, parameters);
  } else {
    Note(method, parameters);
  }
}

void LanguageServer::Answer(const Json& id, const std::string& method, const Json& parameters) {
  if (!initialized_ && method != "initialize") {
    return AnswerError(id, kNotInitialized, "the first request is initialize");
  }
  if (shut_down_) return AnswerError(id, kInvalidRequest, "nothing follows shutdown but exit");
  const auto handler = Handlers().find(method);
  if (handler == Handlers().end()) {
    return AnswerError(id, kMethodNotFound, "there is no request " + method);
  }
  Result<Json> result = (this->*handler->second)(parameters);
  if (!result) {
    const bool wrong =
        result.error().message == kNoDocument || result.error().message == kNoPosition;
    return AnswerError(id, wrong ? kInvalidParameters : kRequestFailed, result.error().message);
  }
  send_({{"jsonrpc", "2.0"}, {"id", id}, {"result", std::move(*result)}});
}

void LanguageServer::AnswerError(const Json& id, int code, const std::string& message) {
  send_({{"jsonrpc", "2.0"}, {"id", id}, {"error", {{"code", code}, {"message", message}}}});
}

void LanguageServer::Note(const std::string& method, const Json& parameters) {
  if (method == "exit") {
    ended_ = true;
    // The protocol has status 1 for an editor that goes without shutdown.
    exit_status_ = shut_down_ ? kDone : kNo;
    return;
  }
  if (!initialized_ || shut_down_) return;
  if (method == "textDocument/didOpen") Open(parameters);
  if (method == "textDocument/didChange") Change(parameters);
  if (method == "textDocument/didClose") Close(parameters);
  if (method == "workspace/didChangeConfiguration") Configure(PartOf(parameters, "settings"));
  // Files that have changed on disk are noticed by their times; all other notes are for others.
}

Result<Json> LanguageServer::Initialize(const Json& parameters) {
  if (initialized_) return Fail("the session has begun already");
  initialized_ = true;
  // Bytes are what the compilers count in, and spare conversions where the editor knows them.
  const Json general = PartOf(PartOf(parameters, "capabilities"), "general");
  const Json encodings = PartOf(general, "positionEncodings");
  for (const Json& encoding : encodings.is_array() ? encodings : Json::array()) {
    if (encoding == "utf-8") encoding_ = PositionEncoding::kUtf8;
  }
  // Old editors name one folder by another key.
  std::vector<std::string> folders;
  const Json list = PartOf(parameters, "workspaceFolders");
  for (const Json& folder : list.is_array() ? list : Json::array()) {
    if (const auto path = PathOfUri(TextOf(folder, "uri"))) folders.push_back(CanonicalPath(*path));
  }
  const std::optional<std::string> root = PathOfUri(TextOf(parameters, "rootUri"));
  if (folders.empty() && root) folders.push_back(CanonicalPath(*root));
  workspace_.SetFolders(std::move(folders));
  Configure(PartOf(parameters, "initializationOptions"));
  const Json capabilities = {
      {"positionEncoding", encoding_ == PositionEncoding::kUtf8 ? "utf-8" : "utf-16"},
      {"textDocumentSync", {{"openClose", true}, {"change", 2}}},
      {"hoverProvider", true},
      {"completionProvider", {{"triggerCharacters", {".", "$", "(", ",", "=", "\"", ":"}}}},
      {"signatureHelpProvider", {{"triggerCharacters", {"(", ","}}}},
      {"definitionProvider", true},
      {"referencesProvider", true},
      {"documentHighlightProvider", true},
      {"documentSymbolProvider", true},
      {"workspaceSymbolProvider", true},
      {"documentFormattingProvider", true},
      {"renameProvider", {{"prepareProvider", true}}},
      {"codeActionProvider", {{"codeActionKinds", {"quickfix"}}}},
      {"inlayHintProvider", true},
  };
  return Json{{"capabilities", capabilities},
              {"serverInfo", {{"name", "morphbus"}, {"version", Version()}}}};
}

void LanguageServer::Configure(const Json& settings) {
  // {"models": [...]}, alone or under the name of the program, as editors differ.
  const Json own = PartOf(settings, "morphbus");
  const Json list = PartOf(own.is_object() ? own : settings, "models");
  if (!list.is_array()) return;
  std::vector<std::string> models;
  for (const Json& model : list) {
    if (model.is_string()) models.push_back(model.get<std::string>());
  }
  workspace_.SetModels(std::move(models));
  published_.clear();
}

Result<Json> LanguageServer::Shutdown(const Json&) {
  shut_down_ = true;
  return Json();
}

void LanguageServer::Open(const Json& parameters) {
  const Json document = PartOf(parameters, "textDocument");
  const std::string uri = TextOf(document, "uri");
  const Json version = PartOf(document, "version");
  if (uri.empty()) return;
  workspace_.Open(uri, TextOf(document, "languageId"),
                  version.is_number_integer() ? version.get<int>() : 0, TextOf(document, "text"));
}

void LanguageServer::Change(const Json& parameters) {
  Document* document = workspace_.Find(TextOf(PartOf(parameters, "textDocument"), "uri"));
  if (document == nullptr) return;
  const Json changes = PartOf(parameters, "contentChanges");
  // Each change counts in the text that those before it have left.
  for (const Json& change : changes.is_array() ? changes : Json::array()) {
    document->Change(change, encoding_);
  }
  const Json version = PartOf(PartOf(parameters, "textDocument"), "version");
  if (version.is_number_integer()) document->version = version.get<int>();
  workspace_.Changed(document);
}

void LanguageServer::Close(const Json& parameters) {
  const std::string uri = TextOf(PartOf(parameters, "textDocument"), "uri");
  const Document* document = workspace_.Find(uri);
  if (document == nullptr) return;
  fits_.erase(document->path);
  published_.erase(uri);
  workspace_.Close(uri);
  // What is not open has no marks.
  send_({{"jsonrpc", "2.0"},
         {"method", "textDocument/publishDiagnostics"},
         {"params", {{"uri", uri}, {"diagnostics", Json::array()}}}});
}

Document* LanguageServer::DocumentOf(const Json& parameters) {
  Document* document = workspace_.Find(TextOf(PartOf(parameters, "textDocument"), "uri"));
  const bool ours = document != nullptr && (document->is_model() || document->is_program());
  return ours ? document : nullptr;
}

Result<LanguageServer::Place> LanguageServer::PlaceIn(const Json& parameters) {
  const Document* document = DocumentOf(parameters);
  if (document == nullptr) return Fail(kNoDocument);
  const std::optional<Position> position = PositionOf(PartOf(parameters, "position"));
  if (!position) return Fail(kNoPosition);
  return Place{document, OffsetAt(document->sources, 0, *position, encoding_)};
}

std::optional<std::pair<size_t, size_t>> LanguageServer::RangeOf(const Document& document,
                                                                 const Json& parameters) const {
  const Json range = PartOf(parameters, "range");
  const std::optional<Position> from = PositionOf(PartOf(range, "start"));
  const std::optional<Position> to = PositionOf(PartOf(range, "end"));
  if (!from || !to) return std::nullopt;
  return std::pair(OffsetAt(document.sources, 0, *from, encoding_),
                   OffsetAt(document.sources, 0, *to, encoding_));
}

Json LanguageServer::LocationsOf(const std::vector<Occurrence>& found) const {
  Json locations = Json::array();
  for (const Occurrence& one : found) {
    locations.push_back({{"uri", workspace_.UriOf(one.path)}, {"range", one.range}});
  }
  return locations;
}

RoleFits& LanguageServer::FitsOf(const std::string& program) {
  RoleFits& fits = fits_[program];
  fits.Begin(&workspace_, program);
  return fits;
}

Result<Json> LanguageServer::Hover(const Json& parameters) {
  const Result<Place> at = PlaceIn(parameters);
  if (!at) return Fail(at.error().message);
  source::Span span{0, 0, 0};
  const std::string text = at->document->is_model()
                               ? ModelHover(workspace_.Model(at->document->path), at->offset, &span)
                               : ProgramHover(&workspace_, at->document->path,
                                              FitsOf(at->document->path), at->offset, &span);
  if (text.empty()) return Json();
  return Json{{"contents", {{"kind", "markdown"}, {"value", text}}},
              {"range", RangeJson(at->document->sources, span, encoding_)}};
}

Result<Json> LanguageServer::Complete(const Json& parameters) {
  const Result<Place> at = PlaceIn(parameters);
  if (!at) return Fail(at.error().message);
  return at->document->is_model() ? CompleteModel(&workspace_, at->document->path, at->offset)
                                  : CompleteProgram(&workspace_, at->document->path, at->offset);
}

Result<Json> LanguageServer::Signature(const Json& parameters) {
  const Result<Place> at = PlaceIn(parameters);
  if (!at) return Fail(at.error().message);
  return at->document->is_model()
             ? ModelSignature(workspace_.Model(at->document->path), at->offset)
             : ProgramSignature(workspace_.Program(at->document->path), at->offset);
}

Result<Json> LanguageServer::Definition(const Json& parameters) {
  const Result<Place> at = PlaceIn(parameters);
  if (!at) return Fail(at.error().message);
  return LocationsOf(Navigator().Declarations(at->document->path, at->offset));
}

Result<Json> LanguageServer::References(const Json& parameters) {
  const Result<Place> at = PlaceIn(parameters);
  if (!at) return Fail(at.error().message);
  std::vector<Occurrence> found = Navigator().Everywhere(at->document->path, at->offset);
  const Json with = PartOf(PartOf(parameters, "context"), "includeDeclaration");
  if (with == false) std::erase_if(found, [](const Occurrence& one) { return one.declares; });
  return LocationsOf(found);
}

Result<Json> LanguageServer::Highlight(const Json& parameters) {
  const Result<Place> at = PlaceIn(parameters);
  if (!at) return Fail(at.error().message);
  Json list = Json::array();
  for (const Occurrence& one : Navigator().InFile(at->document->path, at->offset)) {
    // 3 is writing, 2 reading.
    list.push_back({{"range", one.range}, {"kind", one.declares ? 3 : 2}});
  }
  return list;
}

Result<Json> LanguageServer::PrepareRename(const Json& parameters) {
  const Result<Place> at = PlaceIn(parameters);
  if (!at) return Fail(at.error().message);
  const Result<Occurrence> one = Navigator().Renamable(at->document->path, at->offset);
  if (!one) return Fail(one.error().message);
  return Json{{"range", one->range}, {"placeholder", one->text}};
}

Result<Json> LanguageServer::Rename(const Json& parameters) {
  const Result<Place> at = PlaceIn(parameters);
  if (!at) return Fail(at.error().message);
  return Navigator().Rename(at->document->path, at->offset, TextOf(parameters, "newName"));
}

Result<Json> LanguageServer::Symbols(const Json& parameters) {
  const Document* document = DocumentOf(parameters);
  if (document == nullptr) return Fail(kNoDocument);
  return Navigator().Outline(document->path);
}

Result<Json> LanguageServer::WorkspaceSymbols(const Json& parameters) {
  return Navigator().Search(TextOf(parameters, "query"));
}

Result<Json> LanguageServer::Format(const Json& parameters) {
  const Document* document = DocumentOf(parameters);
  if (document == nullptr) return Fail(kNoDocument);
  return FormattingOf(*document, encoding_);
}

Result<Json> LanguageServer::Fixes(const Json& parameters) {
  const Document* document = DocumentOf(parameters);
  if (document == nullptr) return Fail(kNoDocument);
  const auto range = RangeOf(*document, parameters);
  if (!range) return Fail(kNoPosition);
  return FixesOf(&workspace_, *document, range->first, range->second, encoding_);
}

Result<Json> LanguageServer::InlayHints(const Json& parameters) {
  const Document* document = DocumentOf(parameters);
  if (document == nullptr) return Fail(kNoDocument);
  const auto range = RangeOf(*document, parameters);
  if (!range) return Fail(kNoPosition);
  return InlayHintsOf(&workspace_, *document, range->first, range->second, encoding_);
}

Result<Json> LanguageServer::Preview(const Json& parameters) {
  const Document* document = DocumentOf(parameters);
  if (document == nullptr) return Fail(kNoDocument);
  // A model fits nothing, and has no answers to wait for.
  static const RoleFits kNone;
  const RoleFits& fits = document->is_model() ? kNone : FitsOf(document->path);
  return PreviewOf(&workspace_, *document, fits, TextOf(parameters, "robot"));
}

bool LanguageServer::WorkAhead() {
  if (!initialized_ || shut_down_) return false;
  // Marks come before all else, of one document a call: a message may have come meanwhile.
  for (const auto& [uri, document] : workspace_.documents()) {
    if (!document.is_model() && !document.is_program()) continue;
    std::vector<TextStamp>& published = published_[uri];
    const std::vector<TextStamp>& now = document.is_model()
                                            ? workspace_.Model(document.path).stamps
                                            : workspace_.Program(document.path).stamps;
    // A document has changed also when a model has that its program is for.
    if (published == now) continue;
    published = now;
    send_({{"jsonrpc", "2.0"},
           {"method", "textDocument/publishDiagnostics"},
           {"params",
            {{"uri", uri},
             {"version", document.version},
             {"diagnostics", DiagnosticsOf(&workspace_, document, encoding_)}}}});
    return true;
  }
  // Then the robots, one a call, as each is a small simulation.
  for (const auto& [uri, document] : workspace_.documents()) {
    if (!document.is_program()) continue;
    RoleFits& fits = FitsOf(document.path);
    if (!fits.Work(&workspace_)) continue;
    // Whoever shows a preview asks again.
    if (fits.complete()) {
      send_({{"jsonrpc", "2.0"},
             {"method", "morphbus/rolesKnown"},
             {"params", {{"uri", uri}, {"version", document.version}}}});
    }
    return true;
  }
  return false;
}

int ServeEditor() {
  // A person who tries the command would wait for something to happen.
  if (isatty(STDIN_FILENO) != 0) {
    Say("morphbus lsp waits for an editor, which starts it (docs/editor.md); Ctrl-D ends it\n");
  }
  MessageStream stream(STDIN_FILENO);
  bool heard = true;
  LanguageServer server(
      [&](const Json& message) { heard = MessageStream::Write(message) && heard; });
  bool busy = false;
  // A message that is there goes before work that nobody waits for.
  while (heard && !server.ended()) {
    std::string message;
    const Result<MessageStream::Input> input = stream.Read(!busy, &message);
    if (!input) return Unusable("lsp: " + input.error().message);
    // An editor that is gone without a word has ended all the same.
    if (*input == MessageStream::Input::kEnd) return kNo;
    if (*input == MessageStream::Input::kMessage) {
      server.Take(message);
      busy = true;
    } else {
      busy = server.WorkAhead();
    }
  }
  return heard ? server.exit_status() : kFailed;
}

}  // namespace morphbus::tools
