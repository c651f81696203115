#include "compiler/dynarole/lexer.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include "compiler/base/utf8.h"

namespace morphbus::dynarole {

namespace {

using source::Span;

// How tokens are written, or, if not always in the same way, called; in the order of TokenKind.
struct Spelling {
  enum class Form { kOther, kWord, kSign } form;
  std::string_view text;
};
constexpr Spelling kSpellings[] = {
#define OTHER(kind, text) {Spelling::Form::kOther, text},
#define WORD(kind, text) {Spelling::Form::kWord, text},
#define SIGN(kind, text) {Spelling::Form::kSign, text},
#include "compiler/dynarole/tokens.def"
#undef OTHER
#undef WORD
#undef SIGN
};

// The one character that word processors make of three dots, in UTF-8.
constexpr std::string_view kEllipsis = "\xe2\x80\xa6";

bool IsDigit(char c) { return c >= '0' && c <= '9'; }
bool IsNameStart(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool IsNamePart(char c) { return IsNameStart(c) || IsDigit(c); }

// Goes over the text once, from token to token.
class Lexer {
 public:
  Lexer(std::string_view text, int file, source::Diagnostics* diagnostics)
      : text_(text), file_(file), diagnostics_(*diagnostics) {}

  /// Reads the whole text; called once.
  std::vector<Token> Run() {
    // A byte order mark is no text.
    if (text_.substr(0, 3) == "\xef\xbb\xbf") at_ = 3;
    // A file that is no text at all need not be read to its end.
    const size_t enough = diagnostics_.all().size() + 20;
    while (SkipSpace() && diagnostics_.all().size() < enough) Next();
    tokens_.push_back({TokenKind::kEnd, {file_, text_.size(), text_.size()}});
    return std::move(tokens_);
  }

 private:
  /// The character so many places ahead; 0 behind the end.
  [[nodiscard]] char Peek(size_t ahead = 0) const {
    return at_ + ahead < text_.size() ? text_[at_ + ahead] : '\0';
  }
  // No name or number that a person writes is longer; messages would be.
  void Add(TokenKind kind, size_t begin) {
    // A longer one is taken all the same, so that nothing else is said of it.
    if (at_ - begin > 100) diagnostics_.Error({file_, begin, at_}, "name or number is too long");
    tokens_.push_back({kind, {file_, begin, at_}});
  }

  // Skips spaces and comments; false at the end of the text.
  bool SkipSpace() {
    while (at_ < text_.size()) {
      // Spaces, `//` to the end of the line, and `/* */`, which does not nest.
      const char c = text_[at_];
      if (c == ' ' || c == '\t' || c == '\n' || c == '\r') {
        ++at_;
      } else if (text_.substr(at_, 2) == "//") {
        at_ = std::min(text_.find_first_of("\r\n", at_), text_.size());
      } else if (text_.substr(at_, 2) == "/*") {
        const size_t end = text_.find("*/", at_ + 2);
        if (end == std::string_view::npos) {
          diagnostics_.Error({file_, at_, at_ + 2}, "comment is not closed").hint =
              "end it with '*/'";
          at_ = text_.size();
        } else {
          at_ = end + 2;
        }
      } else {
        return true;
      }
    }
    return false;
  }

  /// Reads one token, which begins here.
  void Next() {
    // The first character decides what the token is.
    const size_t begin = at_;
    const char c = Peek();
    if (IsNameStart(c)) {
      while (IsNamePart(Peek())) ++at_;
      Add(WordOrName(text_.substr(begin, at_ - begin)), begin);
    } else if (c == '$') {
      ++at_;
      while (IsNamePart(Peek())) ++at_;
      if (at_ - begin == 1 || IsDigit(text_[begin + 1])) {
        diagnostics_.Error({file_, begin, at_}, "expected a name after '$'").hint =
            "directions, axes, roles and keywords begin with '$', such as $NORTH";
        return;
      }
      Add(TokenKind::kDollar, begin);
    } else if (IsDigit(c)) {
      Number(begin);
    } else if (c == '"') {
      Text(begin);
    } else {
      Sign(begin);
    }
  }

  // Words are names to the eye; the table tells them apart.
  static TokenKind WordOrName(std::string_view text) {
    for (int i = 0; i < std::ssize(kSpellings); ++i) {
      const Spelling& word = kSpellings[i];
      if (word.form == Spelling::Form::kWord && word.text == text) return static_cast<TokenKind>(i);
    }
    return TokenKind::kName;
  }

  /// Reads a number from its first digit on.
  void Number(size_t begin) {
    // Digits, then perhaps a fraction, then perhaps an exponent. A dot without a digit behind it is
    // a dot: `4.x` is no number.
    bool is_float = false;
    while (IsDigit(Peek())) ++at_;
    if (Peek() == '.' && IsDigit(Peek(1))) {
      is_float = true;
      ++at_;
      while (IsDigit(Peek())) ++at_;
    }
    if (Peek() == 'e' || Peek() == 'E') {
      const size_t sign = Peek(1) == '+' || Peek(1) == '-' ? 1 : 0;
      if (IsDigit(Peek(1 + sign))) {
        is_float = true;
        at_ += 1 + sign;
        while (IsDigit(Peek())) ++at_;
      }
    }
    // Letters right behind a number are a slip, such as a unit or a hexadecimal number.
    if (IsNamePart(Peek())) {
      while (IsNamePart(Peek())) ++at_;
      diagnostics_.Error({file_, begin, at_}, "number is followed by letters").hint =
          "write a decimal number, such as 45 or 22.5; names begin with a letter";
    }
    Add(is_float ? TokenKind::kFloat : TokenKind::kInt, begin);
  }

  /// Reads a text from its quote to the one that closes it, in the same line. `\"` and `\\` stand
  /// for the character behind the backslash (TextValue).
  void Text(size_t begin) {
    ++at_;
    while (Peek() != '"' && Peek() != '\n' && Peek() != '\r' && at_ < text_.size()) {
      // Control characters would reach terminals and logs.
      const auto c = static_cast<unsigned char>(Peek());
      if (c < 0x20 || c == 0x7f) {
        diagnostics_.Error({file_, at_, at_ + 1}, "control character in a text");
      }
      at_ += Peek() == '\\' && (Peek(1) == '"' || Peek(1) == '\\') ? 2 : 1;
    }
    if (Peek() != '"') {
      diagnostics_.Error({file_, begin, at_}, "text is not closed").hint =
          "end it with '\"' in the same line";
    } else {
      ++at_;
    }
    tokens_.push_back({TokenKind::kText, {file_, begin, at_}});
  }

  /// Reads a sign, or reports a character that begins no token.
  void Sign(size_t begin) {
    // Programs in print leave parts out; M3L has the same words for it.
    if (text_.substr(at_, 2) == ".." || text_.substr(at_, kEllipsis.size()) == kEllipsis) {
      while (Peek() == '.') ++at_;
      if (at_ == begin) at_ += kEllipsis.size();
      diagnostics_
          .Error({file_, begin, at_}, "'" + std::string(text_.substr(begin, at_ - begin)) +
                                          "' stands for something left out")
          .hint = "write the missing part";
      return;
    }
    // A sum has no sign before its terms, so that this can only be C's.
    if (text_.substr(at_).starts_with("++")) {
      at_ += 2;
      diagnostics_.Error({file_, begin, at_}, "there is no '++'").hint = "write: NAME += 1;";
      return;
    }
    // Signs have one or two characters.
    for (int i = 0; i < std::ssize(kSpellings); ++i) {
      const Spelling& sign = kSpellings[i];
      if (sign.form != Spelling::Form::kSign || !text_.substr(at_).starts_with(sign.text)) continue;
      at_ += sign.text.size();
      return Add(static_cast<TokenKind>(i), begin);
    }
    ++at_;
    // A whole UTF-8 sequence is one character to the reader.
    while (ContinuesCharacter(Peek())) ++at_;
    const std::string_view sequence = text_.substr(begin, at_ - begin);
    if (!IsUtf8(sequence)) return;  // Reported for the whole file.
    // Control characters are not shown, as they could do harm to a terminal.
    const auto first = static_cast<unsigned char>(sequence[0]);
    const bool printable = first >= 0x20 && first != 0x7f;
    source::Diagnostic& error = diagnostics_.Error(
        {file_, begin, at_}, printable ? "unexpected character '" + std::string(sequence) + "'"
                                       : std::string("unexpected control character"));
    if (sequence == "&") error.hint = "logical and is '&&'";
    if (sequence == "|") error.hint = "logical or is '||'";
    if (sequence == "'") error.hint = "texts stand between double quotes: \"...\"";
  }

  std::string_view text_;
  int file_;
  source::Diagnostics& diagnostics_;
  size_t at_ = 0;
  std::vector<Token> tokens_;
};

}  // namespace

std::vector<std::string_view> ReservedWords() {
  std::vector<std::string_view> words;
  for (const Spelling& spelling : kSpellings) {
    if (spelling.form == Spelling::Form::kWord) words.push_back(spelling.text);
  }
  return words;
}

std::string Describe(TokenKind kind) {
  const auto& [form, text] = kSpellings[static_cast<int>(kind)];
  return form == Spelling::Form::kOther ? std::string(text) : "'" + std::string(text) + "'";
}

std::string TextValue(const std::string& token) {
  std::string value;
  for (size_t i = 1; i + 1 < token.size(); ++i) {
    const bool escapes =
        token[i] == '\\' && i + 2 < token.size() && (token[i + 1] == '"' || token[i + 1] == '\\');
    if (escapes) ++i;
    value += token[i];
  }
  return value;
}

std::vector<Token> Tokenize(const source::SourceSet& sources, int file,
                            source::Diagnostics* diagnostics) {
  // Bytes that are not UTF-8 are reported once for the whole file, not at each token.
  source::CheckUtf8(sources, file, diagnostics);
  return Lexer(sources.text(file), file, diagnostics).Run();
}

}  // namespace morphbus::dynarole
