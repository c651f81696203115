#include "compiler/m3l/format.h"

#include <algorithm>
#include <set>

#include "compiler/m3l/lexer.h"
#include "compiler/m3l/parser.h"
#include "compiler/source/format_frame.h"

namespace morphbus::m3l {
namespace {

using source::LayoutToken;

/// A header wider than this does not set the column of what follows it.
constexpr size_t kWidestHeader = 32;

/// Tokens of a text that parses, with what the layout needs to know of them.
class Formatter {
 public:
  Formatter(const source::SourceSet& sources, int file, const std::vector<Token>& tokens)
      : tokens_(tokens),
        count_(tokens.size() - 1),
        cut_(source::CutUp(sources.text(file), source::SpansOf(tokens), true)) {}

  std::string Run() {
    // Statement after statement, with the comment lines before each.
    Describe();
    source::LayoutWriter writer(std::move(cut_.tokens));
    for (size_t begin = 0; begin < count_;) {
      const size_t stop = StatementEnd(begin);
      writer.LinesBefore(cut_.gaps[begin], 0, true, true);
      WriteStatement(writer, begin, stop);
      writer.EndLine();
      begin = stop;
    }
    writer.LinesBefore(cut_.gaps[count_], 0, true, false);
    return writer.Take();
  }

 private:
  [[nodiscard]] std::string_view Text(size_t i) const { return tokens_[i].text; }
  [[nodiscard]] bool IsWord(size_t i) const {
    return i < count_ && tokens_[i].kind == TokenKind::kWord;
  }
  [[nodiscard]] bool IsSymbol(size_t i, std::string_view symbol) const {
    return i < count_ && tokens_[i].kind == TokenKind::kSymbol && Text(i) == symbol;
  }
  [[nodiscard]] bool IsOperatorAt(size_t i) const { return IsWord(i) && IsOperatorWord(Text(i)); }

  /// The colon of `point c1:`, `(axis:`, not that of `NAME:3`.
  [[nodiscard]] bool IsHeaderColon(size_t i) const {
    if (!IsSymbol(i, ":") || i == 0 || !IsWord(i - 1)) return false;
    return Text(i - 1) == "axis" || (i > 1 && IsWord(i - 2));
  }

  /// True if `+` or `-` at `i` has an operand before it.
  [[nodiscard]] bool IsBinary(size_t i) const {
    if (i == 0 || IsOperatorAt(i - 1)) return false;
    return tokens_[i - 1].kind != TokenKind::kSymbol || Text(i - 1) == ")" || Text(i - 1) == "]";
  }

  [[nodiscard]] bool IsComparison(size_t i) const {
    if (i >= count_ || tokens_[i].kind != TokenKind::kSymbol) return false;
    const std::string_view t = Text(i);
    return t == "==" || t == "!=" || t == "<" || t == "<=" || t == ">" || t == ">=";
  }

  /// The `+` before a part of a hull, or of what is seen of a link.
  [[nodiscard]] bool JoinsParts(size_t i) const {
    static const std::set<std::string_view> kShapes = {"convex", "box", "cylinder", "sphere",
                                                       "mesh"};
    return IsSymbol(i, "+") && i > 0 && IsSymbol(i - 1, ")") && IsWord(i + 1) &&
           kShapes.count(Text(i + 1)) > 0;
  }

  [[nodiscard]] bool IsSign(size_t i) const { return IsSymbol(i, "+") || IsSymbol(i, "-"); }

  /// Whether a space stands between tokens i - 1 and i on one line.
  [[nodiscard]] bool SpaceBefore(size_t i) const {
    if (i == 0) return false;
    // Punctuation decides first, then operators, then names.
    const auto is = [&](size_t at, std::string_view any) {
      return tokens_[at].kind == TokenKind::kSymbol && any.find(Text(at)) != std::string_view::npos;
    };
    if (is(i - 1, "([") || is(i, ")],:.") || is(i - 1, ".")) return false;
    if (is(i - 1, ",")) return true;
    if (IsSymbol(i - 1, ":")) return IsHeaderColon(i - 1);
    if (IsComparison(i) || IsComparison(i - 1)) return true;
    if (IsSymbol(i, "=") || IsSymbol(i - 1, "=")) return false;
    if (is(i, "*/") || is(i - 1, "*/")) return false;
    if (IsSign(i - 1)) return IsBinary(i - 1);
    if (IsSign(i)) return IsBinary(i) || IsOperatorAt(i - 1);
    if (is(i, "([")) return !IsWord(i - 1) || IsOperatorAt(i - 1);
    return true;
  }

  /// Spacing, possible breaks and comments of all tokens; where statements begin.
  void Describe() {
    int depth = 0;
    starts_.assign(count_ + 1, false);
    for (size_t i = 0; i < count_; ++i) {
      LayoutToken& token = cut_.tokens[i];
      token.space = SpaceBefore(i);
      token.opens = IsSymbol(i, "(") || IsSymbol(i, "[");
      token.closes = IsSymbol(i, ")") || IsSymbol(i, "]");
      // Lines may be broken before `and`, `or` and sub-points, and behind commas.
      const bool junction = IsWord(i) && (Text(i) == "and" || Text(i) == "or");
      const bool subpoint = token.opens && IsWord(i + 1) && Text(i + 1) == "point" && IsWord(i + 2);
      const bool after_subpoint =
          depth == 0 && i > 0 && IsSymbol(i - 1, ")") && IsWord(i) && !IsOperatorAt(i);
      starts_[i] = depth == 0 && StartsStatement(tokens_, i);
      // Parts of a link's shape have a line each, where they need more than one.
      const bool part = depth == 0 && JoinsParts(i);
      token.may_break =
          junction || subpoint || after_subpoint || part || (i > 0 && IsSymbol(i - 1, ","));
      token.separate = part || (after_subpoint && !starts_[i]);
      depth += token.opens ? 1 : token.closes ? -1 : 0;
    }
    starts_[count_] = true;
  }

  [[nodiscard]] size_t StatementEnd(size_t begin) const {
    size_t end = begin + 1;
    while (!starts_[end]) ++end;
    return end;
  }

  /// Sub-points that do not fit on one line are spread evenly: four become two and two.
  void BalanceSubpoints(source::LayoutWriter& writer, size_t begin, size_t end, size_t hang) const {
    std::vector<size_t> groups;
    size_t widest = 0;
    for (size_t i = begin; i < end && IsSymbol(i, "("); i = writer.AfterGroup(i)) {
      groups.push_back(i);
      widest = std::max(widest, writer.FlatWidth(i, writer.AfterGroup(i)));
    }
    // A sub-point that is wider than a line is broken up in any case.
    if (groups.empty() || widest + hang > source::kLayoutWidth) return;
    // As many as fit on a line give the number of lines, over which they are spread.
    const size_t fit = std::max<size_t>(1, (source::kLayoutWidth - hang + 1) / (widest + 1));
    const size_t lines = (groups.size() + fit - 1) / fit;
    const size_t each = (groups.size() + lines - 1) / lines;
    for (size_t i = each; i < groups.size(); i += each) writer.Separate(groups[i]);
  }

  /// Writes one statement: members of a module hang under their first attribute, definitions are
  /// indented by two columns and broken at every part.
  void WriteStatement(source::LayoutWriter& writer, size_t begin, size_t end) const {
    const std::string_view keyword = Text(begin);
    // An import or a constant has no parts that could hang anywhere.
    if (keyword == "import" || keyword == "const") {
      writer.Statement(begin, begin, end, 0, 2, false);
      return;
    }
    // Keyword, name and colon stay together.
    const size_t head = std::min(begin + 3, end);
    const bool member = keyword == "point" || keyword == "link" || keyword == "axis" ||
                        keyword == "joint" || keyword == "sensor";
    // Members are aligned behind `keyword name: `, unless that is too wide.
    const size_t width = keyword.size() + 1 + Text(begin + 1).size() + 2;
    const size_t hang = !member ? 2 : width > kWidestHeader ? 4 : width;
    if (member) BalanceSubpoints(writer, head, end, hang);
    writer.Statement(begin, head, end, 0, hang, !member);
  }

  const std::vector<Token>& tokens_;
  size_t count_;  ///< Tokens without kEnd.
  source::CutText cut_;
  std::vector<bool> starts_;
};

}  // namespace

std::optional<std::string> Format(const source::SourceSet& sources, int file,
                                  source::Diagnostics* diagnostics) {
  const int errors = diagnostics->error_count();
  const std::vector<Token> tokens = Tokenize(sources, file, kMaxTokens, diagnostics);
  // Only text that parses is laid out: in any other the spacing might change its meaning.
  Parse(tokens, diagnostics);
  if (diagnostics->error_count() > errors) return std::nullopt;
  std::string formatted = Formatter(sources, file, tokens).Run();
  const auto spans = [](const source::SourceSet& from, int at, source::Diagnostics* found) {
    return source::SpansOf(Tokenize(from, at, kMaxTokens, found));
  };
  return source::IfUnchanged(sources, file, {spans, true}, std::move(formatted), diagnostics);
}

}  // namespace morphbus::m3l
