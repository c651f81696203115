#include "compiler/m3l/lexer.h"

#include <algorithm>
#include <charconv>
#include <cstdio>

#include "compiler/base/utf8.h"
#include "compiler/model/robot_model.h"

namespace morphbus::m3l {
namespace {

// Not <cctype>: its answers depend on the locale and are undefined for negative characters.
bool IsDigit(char c) { return c >= '0' && c <= '9'; }
bool IsWordStart(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool IsWord(char c) { return IsWordStart(c) || IsDigit(c); }
bool IsSpace(char c) {
  return c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == '\f' || c == '\v';
}

bool IsLineEnd(char c) { return c == '\n' || c == '\r'; }

// The UTF-8 forms of the quotation marks that word processors make of a plain one.
constexpr std::string_view kOpeningQuote = "\xE2\x80\x9C";
constexpr std::string_view kClosingQuote = "\xE2\x80\x9D";

/// What to write instead of a number with letters behind it: "45deg", "10cm".
std::string UnitHint(std::string_view text) {
  size_t end = text.size();
  // The letters at the end are what may be a unit.
  while (end > 0 && IsWordStart(text[end - 1])) --end;
  const std::string number(text.substr(0, end));
  const std::string_view unit = text.substr(end);
  // Angles and masses have one unit each, so the advice is fixed.
  if (unit == "degrees") return "write " + number + "deg";
  if (unit == "kg") return "masses are in kg: write " + number;
  if (unit == "g") return "masses are in kg: write " + number + "/1000";
  // Lengths can be converted at once, as a unit of metres is the default.
  const double per_metre = unit == "m" ? 1.0 : unit == "cm" ? 100.0 : unit == "mm" ? 1000.0 : 0.0;
  double value = 0.0;
  const auto [stop, error] = std::from_chars(number.data(), number.data() + number.size(), value);
  if (per_metre == 0.0 || error != std::errc() || stop != number.data() + number.size()) {
    return "a name starts with a letter or '_'; a product is written with '*'";
  }
  const std::string metres = model::NumberText(value / per_metre);
  return "lengths are in model units, metres unless 'unit=' says otherwise: " + std::string(text) +
         " are " + metres + " m";
}

/// Cuts one text into tokens; what is no token is reported and left out.
class Lexer {
 public:
  Lexer(const source::SourceSet& sources, int file, size_t max_tokens,
        source::Diagnostics* diagnostics)
      : text_(sources.text(file)), file_(file), max_(max_tokens), diagnostics_(*diagnostics) {
    source::CheckUtf8(sources, file, diagnostics);
  }

  std::vector<Token> Run() {
    if (text_.substr(0, 3) == "\xEF\xBB\xBF") at_ = 3;  // A byte order mark is no text.
    // Each turn passes over white space and reads one token behind it.
    while (SkipBlanks(), at_ < text_.size()) {
      // Both bounds end the file: text that is not M3L at all would go on for ever.
      if (errors_ >= kMaxSyntaxErrors) {
        diagnostics_.Error(SpanFrom(at_, 1), "too many errors, the rest of the file is not read");
        break;
      }
      if (tokens_.size() >= max_) {
        diagnostics_.Error(SpanFrom(at_, 1), "more than " + std::to_string(kMaxTokens) +
                                                 " tokens, the rest is not read");
        break;
      }
      Next();
    }
    // The mark at the end has an empty span behind the last character.
    tokens_.push_back({TokenKind::kEnd, {file_, text_.size(), text_.size()}, {}});
    return std::move(tokens_);
  }

 private:
  /// The character `ahead` of the current one, or a zero beyond the end of the text.
  char Peek(size_t ahead = 0) const {
    return at_ + ahead < text_.size() ? text_[at_ + ahead] : '\0';
  }
  /// The place of `length` bytes from `begin`, as far as they lie in the text.
  source::Span SpanFrom(size_t begin, size_t length) const {
    return {file_, begin, std::min(begin + length, text_.size())};
  }
  source::Diagnostic& Error(size_t begin, size_t length, std::string message) {
    ++errors_;
    return diagnostics_.Error(SpanFrom(begin, length), std::move(message));
  }
  /// Adds the token from `begin` to the current character.
  void Push(TokenKind kind, size_t begin) {
    tokens_.push_back({kind, {file_, begin, at_}, text_.substr(begin, at_ - begin)});
  }

  /// White space, comments, and a backslash at the end of a line.
  void SkipBlanks() {
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (IsSpace(c)) {
        ++at_;
      } else if (c == '#' || (c == '/' && Peek(1) == '/')) {
        at_ = LineEnd();
      } else if (c == '/' && Peek(1) == '*') {
        SkipBlockComment();
      } else if (c == '\\' && EndsLineAfterBackslash()) {
        at_ = LineEnd();
      } else {
        return;
      }
    }
  }

  /// A comment that is never closed swallows the rest of the file, which is reported once.
  void SkipBlockComment() {
    const size_t end = text_.find("*/", at_ + 2);
    if (end == std::string_view::npos) {
      Error(at_, 2, "comment is never closed").hint = "end it with */";
      at_ = text_.size();
    } else {
      at_ = end + 2;
    }
  }

  bool EndsLineAfterBackslash() const {
    // Blanks behind the backslash cannot be seen, so they do not matter.
    size_t i = at_ + 1;
    while (i < text_.size() && (text_[i] == ' ' || text_[i] == '\t')) ++i;
    return i == text_.size() || IsLineEnd(text_[i]);
  }

  size_t LineEnd() const { return std::min(text_.find_first_of("\r\n", at_), text_.size()); }

  /// Reads one token, which begins at the current character.
  void Next() {
    // The first character says what kind of token it is.
    const char c = Peek();
    if (IsWordStart(c)) {
      const size_t begin = at_;
      while (IsWord(Peek())) ++at_;
      Push(TokenKind::kWord, begin);
    } else if (IsDigit(c) || (c == '.' && IsDigit(Peek(1)))) {
      Number();
    } else if (c == '"') {
      String();
    } else if (text_.substr(at_, 3) == kOpeningQuote) {
      TypographicString();
    } else {
      Symbol();
    }
  }

  /// An unsigned decimal number; letters behind it are reported with it.
  void Number() {
    const size_t begin = at_;
    while (IsDigit(Peek())) ++at_;
    // A point belongs to the number unless a name or another point follows it.
    if (Peek() == '.' && !IsWordStart(Peek(1)) && Peek(1) != '.') {
      ++at_;
      while (IsDigit(Peek())) ++at_;
    }
    if (Peek() == 'e' || Peek() == 'E') {
      // The exponent belongs to the number only if a digit follows it.
      const size_t sign = Peek(1) == '+' || Peek(1) == '-' ? 1 : 0;
      if (IsDigit(Peek(1 + sign))) {
        at_ += 1 + sign;
        while (IsDigit(Peek())) ++at_;
      }
    }
    // Letters behind a number are most often a unit; those of angles are part of the language.
    const size_t unit = at_;
    while (IsWord(Peek())) ++at_;
    const std::string_view letters = text_.substr(unit, at_ - unit);
    if (!letters.empty() && letters != "deg" && letters != "rad") {
      Error(begin, at_ - begin, "'" + Shown(begin) + "' is neither a number nor a name").hint =
          UnitHint(text_.substr(begin, at_ - begin));
    }
    Push(TokenKind::kNumber, begin);
  }

  /// A string on one line; escapes are checked here and resolved by StringValue.
  void String() {
    const size_t begin = at_++;
    while (at_ < text_.size() && text_[at_] != '"' && !IsLineEnd(text_[at_])) {
      // A backslash takes the next character with it, so that an escaped quote does not end the
      // string.
      const bool escape =
          text_[at_] == '\\' && at_ + 1 < text_.size() && !IsLineEnd(text_[at_ + 1]);
      CheckPrintable();
      if (escape && std::string_view("\"\\nt").find(text_[at_ + 1]) == std::string_view::npos) {
        Error(at_, 2, "unknown escape in a string").hint = R"(use \" \\ \n or \t)";
      }
      at_ += escape ? 2 : 1;
    }
    // A string ends with its line: a missing quote must not swallow the rest of the file.
    if (Peek() == '"') {
      ++at_;
    } else {
      Error(begin, 1, "string is never closed").hint = "strings end with '\"' on the same line";
    }
    Push(TokenKind::kString, begin);
  }

  /// Control characters in a string would end up in names, files and on terminals.
  void CheckPrintable() {
    if (static_cast<unsigned char>(Peek()) >= 0x20 && Peek() != 0x7F) return;
    // Shown() tells the text up to at_, which is moved there for a moment.
    const size_t begin = at_++;
    const std::string shown = Shown(begin);
    at_ = begin;
    Error(begin, 1, "control character '" + shown + "' in a string").hint =
        Peek() == '\t' ? R"(write \t for a tab)" : "leave it out";
  }

  /// Quotes as word processors make them: reported, and read as the string that was meant.
  void TypographicString() {
    const size_t begin = at_;
    at_ += kOpeningQuote.size();
    // Up to the closing quote of its kind, or the end of the line.
    while (at_ < text_.size() && !IsLineEnd(text_[at_]) && text_.substr(at_, 3) != kClosingQuote) {
      ++at_;
    }
    if (at_ < text_.size() && !IsLineEnd(text_[at_])) at_ += kClosingQuote.size();
    Error(begin, at_ - begin, "typographic quotes").hint = "strings are written with '\"'";
    Push(TokenKind::kString, begin);
  }

  /// An operator or bracket; dots in a row are what a listing leaves out.
  void Symbol() {
    const size_t begin = at_;
    const char c = Peek();
    if (c == '.' && Peek(1) == '.') {
      while (Peek() == '.') ++at_;
      Error(begin, at_ - begin, "'" + Shown(begin) + "' stands for something left out").hint =
          "write the missing part";
      return;
    }
    // Two-character operators go before their first halves.
    if (std::string_view("=!<>").find(c) != std::string_view::npos && Peek(1) == '=') {
      at_ += 2;
      Push(TokenKind::kSymbol, begin);
    } else if (c != '\0' && std::string_view("()[],:.=<>+-*/").find(c) != std::string_view::npos) {
      ++at_;
      Push(TokenKind::kSymbol, begin);
    } else {
      Unexpected();
    }
  }

  /// Stands in for a sign of other languages that was reported, so that the rest makes sense.
  void PushInstead(size_t begin) {
    const char c = text_[begin];
    const std::string_view word = c == '&' ? "and" : c == '|' ? "or" : c == '!' ? "not" : "";
    if (!word.empty()) tokens_.push_back({TokenKind::kWord, {file_, begin, at_}, word});
  }

  /// One error for a whole run of bytes that start no token.
  void Unexpected() {
    const size_t begin = at_;
    const std::string_view others = "\"()[],:.=<>+-*/#\\!;{}&|'";
    ++at_;
    // Doubled signs of other languages, && and ||, are one sign.
    if ((text_[begin] == '&' || text_[begin] == '|') && Peek() == text_[begin]) ++at_;
    // Signs that have an explanation are reported one by one, others as one run.
    if (others.find(text_[begin]) == std::string_view::npos) {
      while (at_ < text_.size() && !IsWord(text_[at_]) && !IsSpace(text_[at_]) &&
             others.find(text_[at_]) == std::string_view::npos) {
        ++at_;
      }
    }
    // What is not UTF-8 was reported for the whole file.
    if (!IsUtf8(text_.substr(begin, at_ - begin))) return;
    // What other languages write there, and what M3L writes instead.
    const char c = text_[begin];
    source::Diagnostic& d = Error(begin, at_ - begin,
                                  "unexpected character" + std::string(at_ > begin + 1 ? "s" : "") +
                                      " '" + Shown(begin) + "'");
    if (c == ';') d.hint = "statements need no separator";
    if (c == '\'') d.hint = "strings are written with double quotes";
    if (c == '{' || c == '}') d.hint = "members need no braces, they follow the module's line";
    if (c == '&') d.hint = "write 'and'";
    if (c == '|') d.hint = "write 'or'";
    if (c == '!') d.hint = "write 'not'";
    if (c == '\\') d.hint = "a backslash may only end a line";
    // The sign's meaning is kept, so that the parser reports nothing that follows from it.
    PushInstead(begin);
  }

  /// Text since `begin` for a message: short, and no bytes that are not printable.
  std::string Shown(size_t begin) const {
    std::string shown;
    for (size_t i = begin; i < at_ && shown.size() < 32; ++i) {
      const auto byte = static_cast<unsigned char>(text_[i]);
      if (byte >= 0x20 && byte < 0x7F) {
        shown += text_[i];
      } else {
        char hex[8];
        std::snprintf(hex, sizeof hex, "\\x%02x", unsigned{byte});
        shown += hex;
      }
    }
    return shown;
  }

  std::string_view text_;
  int file_;
  size_t max_;
  source::Diagnostics& diagnostics_;
  size_t at_ = 0;
  int errors_ = 0;
  std::vector<Token> tokens_;
};

}  // namespace

std::vector<Token> Tokenize(const source::SourceSet& sources, int file, size_t max_tokens,
                            source::Diagnostics* diagnostics) {
  return Lexer(sources, file, max_tokens, diagnostics).Run();
}

std::string StringValue(std::string_view quoted) {
  // Typographic quotes were reported; what stands between them is taken as it is.
  if (quoted.substr(0, 3) == kOpeningQuote) {
    quoted.remove_prefix(kOpeningQuote.size());
    return std::string(quoted.substr(0, quoted.find(kClosingQuote)));
  }
  std::string value;
  for (size_t i = 1; i < quoted.size(); ++i) {
    // The first quote without a backslash ends the value; a string that is never closed has none.
    if (quoted[i] == '"') break;
    if (quoted[i] != '\\' || i + 1 == quoted.size()) {
      value += quoted[i];
      continue;
    }
    // The escapes \n and \t stand for white space, any other for the character behind the
    // backslash.
    ++i;
    value += quoted[i] == 'n' ? '\n' : quoted[i] == 't' ? '\t' : quoted[i];
  }
  return value;
}

const std::vector<std::string_view>& Keywords() {
  static const std::vector<std::string_view> kWords = {"module", "connection", "robot", "point",
                                                       "link",   "axis",       "joint", "sensor",
                                                       "const",  "import"};
  return kWords;
}

// These words cannot be names either, as they stand between operands.
const std::vector<std::string_view>& OperatorWords() {
  static const std::vector<std::string_view> kWords = {"and",        "or",       "not",
                                                       "coincident", "parallel", "antiparallel"};
  return kWords;
}

bool IsKeyword(std::string_view word) {
  return std::find(Keywords().begin(), Keywords().end(), word) != Keywords().end();
}

bool IsOperatorWord(std::string_view word) {
  return std::find(OperatorWords().begin(), OperatorWords().end(), word) != OperatorWords().end();
}

bool StartsStatement(const std::vector<Token>& tokens, size_t i) {
  // Looking ahead never goes beyond the mark at the end.
  const auto at = [&](size_t k) -> const Token& { return tokens[std::min(k, tokens.size() - 1)]; };
  const auto is = [&](size_t k, std::string_view symbol) {
    return at(k).kind == TokenKind::kSymbol && at(k).text == symbol;
  };
  if (at(i).kind != TokenKind::kWord) return false;
  // `(point x: ...)` is a part of a statement, and `a.point` a path.
  if (i > 0 && (is(i - 1, "(") || is(i - 1, "."))) return false;
  const std::string_view word = at(i).text;
  const bool word_next = at(i + 1).kind == TokenKind::kWord;
  // `word name:` can only be a statement whose keyword is misspelt.
  if (!IsKeyword(word)) return word_next && is(i + 2, ":") && !IsOperatorWord(word);
  // An attribute may be called `import`.
  if (word == "import") return !is(i + 1, "=");
  // A constant has no colon: `const name = ...`.
  if (word == "const") return word_next && is(i + 2, "=");
  return word_next || is(i + 1, ":");
}

}  // namespace morphbus::m3l
