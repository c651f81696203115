#include "test/fuzz/m3l_mutator.h"

#include <algorithm>
#include <random>
#include <vector>

#include "compiler/m3l/lexer.h"

namespace morphbus::test {
namespace {

using Tokens = std::vector<std::string>;

/// Values at the edges of what the checker accepts.
constexpr const char* kNumbers[] = {"0",    "1",   "2",     "-1",   "0.5",     ".5", "1e-7",
                                    "1e-6", "1e6", "1e300", "1e-9", "3.5",     "pi", "pi/2",
                                    "4",    "64",  "5000",  "1/0",  "sqrt(2)", "-0"};
/// Pieces that are rarely in a corpus together.
constexpr const char* kPieces[] = {"connector",
                                   "normal = ( 0 , 0 , 1 )",
                                   "extended = [ bool ]",
                                   "mode = [ \"a\" , \"b\" ]",
                                   "type = prismatic",
                                   "type = fixed",
                                   "type = continuous",
                                   "rot = 90",
                                   "joints = ( m1 . j = 1 )",
                                   "and not ( p . size > 1 )",
                                   "or p parallel q",
                                   "and a . x antiparallel b . y",
                                   "hull = convex ( l . point )",
                                   "mass = 0",
                                   "friction = 0.5",
                                   "mass_spread = 0.1",
                                   "backlash = 2deg",
                                   "delay = 0.02",
                                   "unit = 0.01",
                                   "grouping = ( c1 )",
                                   "( point _9 : coords = ( 0 , 0 , 0 ) )",
                                   ("frame = ( m1 . l . ( axis : origin = ( 0 , 0 , 0 ) , "
                                    "direction = ( 1 , 0 , 0 ) ) )")};

Tokens Split(std::string_view text) {
  source::SourceSet sources;
  source::Diagnostics diagnostics;
  const int file = sources.AddText("mutated", std::string(text));
  Tokens tokens;
  for (const m3l::Token& token : m3l::Tokenize(sources, file, 100'000, &diagnostics)) {
    if (token.kind != m3l::TokenKind::kEnd) tokens.emplace_back(token.text);
  }
  return tokens;
}

std::string Join(const Tokens& tokens, size_t max_size) {
  std::string text;
  for (size_t i = 0; i < tokens.size(); ++i) {
    const bool statement = i + 2 < tokens.size() && m3l::IsKeyword(tokens[i]) &&
                           tokens[i + 2] == ":" && tokens[i == 0 ? 0 : i - 1] != "(";
    if (text.size() + tokens[i].size() + 1 > max_size) break;
    if (!text.empty()) text += statement ? '\n' : ' ';
    text += tokens[i];
  }
  return text;
}

class Mutator {
 public:
  Mutator(Tokens tokens, uint32_t seed) : tokens_(std::move(tokens)), random_(seed) {}

  void Step() {
    if (tokens_.empty()) {
      Insert(0, Split(Pick(kPieces)));
      return;
    }
    // Most steps leave the text well-formed, so that the checker and the solver see something.
    const size_t choice = Below(32);
    if (choice == 0) return Erase({Below(tokens_.size()), 1});
    if (choice == 1) {
      return std::swap(tokens_[Below(tokens_.size())], tokens_[Below(tokens_.size())]);
    }
    if (choice < 5) return MoveStatement(false);
    if (choice < 9) return MoveStatement(true);
    if (choice < 12) return Erase(StatementAt(Below(tokens_.size())));
    if (choice < 16) return ReplaceGroup();
    if (choice < 19) return Repeat(GroupAt(Below(tokens_.size())));
    if (choice < 24) return ChangeNumber();
    if (choice < 28) return ChangeWord();
    InsertPiece();
  }

  void Insert(size_t at, const Tokens& piece) {
    tokens_.insert(tokens_.begin() + static_cast<std::ptrdiff_t>(at), piece.begin(), piece.end());
  }

  [[nodiscard]] const Tokens& tokens() const { return tokens_; }
  size_t Below(size_t limit) { return limit == 0 ? 0 : random_() % limit; }

  struct Range {
    size_t begin = 0;
    size_t size = 0;
  };
  /// The statement that token `i` belongs to.
  [[nodiscard]] Range StatementAt(size_t i) const {
    const auto starts = [&](size_t k) {
      return k + 1 < tokens_.size() && m3l::IsKeyword(tokens_[k]) &&
             (k == 0 || tokens_[k - 1] != "(");
    };
    size_t begin = i;
    while (begin > 0 && !starts(begin)) --begin;
    size_t end = i + 1;
    while (end < tokens_.size() && !starts(end)) ++end;
    return {begin, end - begin};
  }
  [[nodiscard]] Tokens Copy(const Range& range) const {
    const auto begin = tokens_.begin() + static_cast<std::ptrdiff_t>(range.begin);
    return {begin, begin + static_cast<std::ptrdiff_t>(range.size)};
  }

 private:
  template <size_t N>
  const char* Pick(const char* const (&list)[N]) {
    return list[Below(N)];
  }

  /// The group that the next opening parenthesis opens, or the token itself.
  [[nodiscard]] Range GroupAt(size_t i) const {
    while (i < tokens_.size() && tokens_[i] != "(") ++i;
    if (i == tokens_.size()) return {0, tokens_.empty() ? size_t{0} : size_t{1}};
    int depth = 0;
    size_t end = i;
    do {
      depth += tokens_[end] == "(" ? 1 : tokens_[end] == ")" ? -1 : 0;
      ++end;
    } while (end < tokens_.size() && depth > 0);
    return {i, end - i};
  }

  void Erase(const Range& range) {
    const auto begin = tokens_.begin() + static_cast<std::ptrdiff_t>(range.begin);
    tokens_.erase(begin, begin + static_cast<std::ptrdiff_t>(range.size));
  }

  /// A statement goes to where another begins.
  void MoveStatement(bool keep) {
    const Range range = StatementAt(Below(tokens_.size()));
    const Tokens piece = Copy(range);
    if (!keep) Erase(range);
    const size_t to = Below(tokens_.size() + 1);
    Insert(to < tokens_.size() ? StatementAt(to).begin : to, piece);
  }

  void ReplaceGroup() {
    const Tokens piece = Copy(GroupAt(Below(tokens_.size())));
    const Range place = GroupAt(Below(tokens_.size()));
    Erase(place);
    Insert(place.begin, piece);
  }

  /// One more element behind a comma, or one more operand before a closing parenthesis.
  void InsertPiece() {
    Tokens piece = Split(Pick(kPieces));
    size_t at = Below(tokens_.size());
    const bool operand = m3l::IsOperatorWord(piece[0]);
    while (at < tokens_.size() && tokens_[at] != (operand ? ")" : ",")) ++at;
    if (operand || at == tokens_.size()) return Insert(at, piece);
    piece.push_back(",");
    Insert(at + 1, piece);
  }

  /// A list grows: `(a)` becomes `(a), (a), (a)`.
  void Repeat(const Range& range) {
    const Tokens piece = Copy(range);
    const size_t count = 1 + Below(Below(8) == 0 ? 60 : 4);
    Tokens many;
    for (size_t i = 0; i < count; ++i) {
      many.push_back(",");
      many.insert(many.end(), piece.begin(), piece.end());
    }
    Insert(range.begin + range.size, many);
  }

  [[nodiscard]] std::vector<size_t> Where(bool numbers) const {
    std::vector<size_t> found;
    for (size_t i = 0; i < tokens_.size(); ++i) {
      const char c = tokens_[i][0];
      const bool number = (c >= '0' && c <= '9') || c == '.';
      const bool word = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || c == '"';
      const bool fixed = m3l::IsKeyword(tokens_[i]) || m3l::IsOperatorWord(tokens_[i]);
      if (numbers ? number && tokens_[i] != "." : word && !fixed) found.push_back(i);
    }
    return found;
  }

  void ChangeNumber() {
    const std::vector<size_t> numbers = Where(true);
    if (numbers.empty()) return;
    const size_t at = numbers[Below(numbers.size())];
    if (Below(2) == 0) {
      tokens_[at] = tokens_[numbers[Below(numbers.size())]];
      return;
    }
    Erase({at, 1});
    Insert(at, Split(Pick(kNumbers)));
  }

  void ChangeWord() {
    const std::vector<size_t> words = Where(false);
    if (words.empty()) return;
    const std::string word = tokens_[words[Below(words.size())]];
    tokens_[words[Below(words.size())]] = word;
  }

  Tokens tokens_;
  std::mt19937 random_;
};

}  // namespace

std::string MutateM3l(std::string_view text, uint32_t seed, size_t max_size) {
  Mutator mutator(Split(text), seed);
  const size_t steps = 1 + mutator.Below(3);
  for (size_t i = 0; i < steps; ++i) mutator.Step();
  return Join(mutator.tokens(), max_size);
}

std::string CrossM3l(std::string_view a, std::string_view b, uint32_t seed, size_t max_size) {
  Mutator into(Split(a), seed);
  Mutator from(Split(b), seed + 1);
  const size_t statements = 1 + into.Below(4);
  for (size_t i = 0; i < statements && !from.tokens().empty(); ++i) {
    const Tokens piece = from.Copy(from.StatementAt(from.Below(from.tokens().size())));
    const size_t to = into.Below(into.tokens().size() + 1);
    into.Insert(to < into.tokens().size() ? into.StatementAt(to).begin : to, piece);
  }
  return Join(into.tokens(), max_size);
}

}  // namespace morphbus::test
