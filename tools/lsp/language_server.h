#pragma once
// The Language Server Protocol (3.17) for M3L and DynaRole: which request is answered by what. It
// reads and writes no descriptor itself, so that tests and fuzzers drive it message by message.

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "tools/lsp/document.h"
#include "tools/lsp/navigation.h"
#include "tools/lsp/role_fits.h"
#include "tools/lsp/workspace.h"

namespace morphbus::tools {

/// A session with one editor.
class LanguageServer {
 public:
  /// `send` gets each message to the editor.
  explicit LanguageServer(std::function<void(const Json&)> send) : send_(std::move(send)) {}

  /// Takes one message. What is no message, or asks for what there is not, is answered with an
  /// error; nothing throws.
  void Take(const std::string& text);
  /// Does a piece of the work that nobody waits for: diagnostics of what has changed, then which
  /// robots fit the programs. False if nothing was left to do.
  bool WorkAhead();

  /// Whether the editor has said that nothing follows, and the exit status then.
  [[nodiscard]] bool ended() const { return ended_; }
  [[nodiscard]] int exit_status() const { return exit_status_; }

 private:
  /// Answers one request; the error has its text.
  using Handler = Result<Json> (LanguageServer::*)(const Json& parameters);
  static const std::map<std::string, Handler>& Handlers();

  void Answer(const Json& id, const std::string& method, const Json& parameters);
  void Note(const std::string& method, const Json& parameters);
  void AnswerError(const Json& id, int code, const std::string& message);

  // Requests, by what they ask for.
  Result<Json> Initialize(const Json& parameters);
  Result<Json> Shutdown(const Json& parameters);
  Result<Json> Hover(const Json& parameters);
  Result<Json> Complete(const Json& parameters);
  Result<Json> Signature(const Json& parameters);
  Result<Json> Definition(const Json& parameters);
  Result<Json> References(const Json& parameters);
  Result<Json> Highlight(const Json& parameters);
  Result<Json> PrepareRename(const Json& parameters);
  Result<Json> Rename(const Json& parameters);
  Result<Json> Symbols(const Json& parameters);
  Result<Json> WorkspaceSymbols(const Json& parameters);
  Result<Json> Format(const Json& parameters);
  Result<Json> Fixes(const Json& parameters);
  Result<Json> InlayHints(const Json& parameters);
  Result<Json> Preview(const Json& parameters);

  void Open(const Json& parameters);
  void Change(const Json& parameters);
  void Close(const Json& parameters);
  void Configure(const Json& settings);

  /// The document of "textDocument"; null if it is not open, or in no language of ours.
  Document* DocumentOf(const Json& parameters);
  /// What a request about one place asks about: a byte of a document.
  struct Place {
    const Document* document = nullptr;
    size_t offset = 0;
  };
  /// The place that "textDocument" and "position" name.
  Result<Place> PlaceIn(const Json& parameters);
  /// The bytes of "range".
  [[nodiscard]] std::optional<std::pair<size_t, size_t>> RangeOf(const Document& document,
                                                                 const Json& parameters) const;
  [[nodiscard]] Json LocationsOf(const std::vector<Occurrence>& found) const;
  Navigation Navigator() { return Navigation(&workspace_, encoding_); }
  /// Which robots fit a program; it is begun if it was not.
  RoleFits& FitsOf(const std::string& program);

  std::function<void(const Json&)> send_;
  Workspace workspace_;
  PositionEncoding encoding_ = PositionEncoding::kUtf16;
  bool initialized_ = false, shut_down_ = false, ended_ = false;
  int exit_status_ = 0;
  /// Of each document that is open, what its published diagnostics rest on.
  std::map<std::string, std::vector<TextStamp>> published_;
  /// By the paths of programs.
  std::map<std::string, RoleFits> fits_;
};

/// Serves an editor on standard input and output until it ends; returns the exit status.
int ServeEditor();

}  // namespace morphbus::tools
