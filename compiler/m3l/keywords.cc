#include "compiler/m3l/keywords.h"

#include <algorithm>

namespace morphbus::m3l {

const std::vector<std::string_view>& Keywords() {
  static const std::vector<std::string_view> kWords = {"module", "connection", "robot", "point",
                                                       "link",   "axis",       "joint", "import"};
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
  return word_next || is(i + 1, ":");
}

}  // namespace morphbus::m3l
