#include "tools/spy/lcm_parser.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdlib>
#include <limits>
#include <optional>
#include <set>

#include "compiler/base/text.h"

namespace morphbus::tools {
namespace {

// No person writes so many in a text, and in a struct; a folder that is none of types does not fill
// the memory.
constexpr int kMostMembers = 100'000;
constexpr size_t kMostInStruct = 4096;

/// A word, a number or a single character.
struct LcmToken {
  std::string text;  ///< Empty at the end.
  int line = 1;
};

/// Words may hold points (package.type) and minus signs (-1); comments and space are left out.
std::vector<LcmToken> TokenizeLcm(std::string_view text) {
  std::vector<LcmToken> tokens;
  int line = 1;
  for (size_t i = 0; i < text.size();) {
    const char c = text[i];
    // Lines are counted for the messages of errors.
    if (c == '\n') ++line;
    if (std::isspace(static_cast<unsigned char>(c)) != 0) {
      ++i;
    } else if (text.substr(i, 2) == "//") {
      i = std::min(text.find('\n', i), text.size());
    } else if (text.substr(i, 2) == "/*") {
      const size_t end = std::min(text.find("*/", i + 2), text.size());
      line += static_cast<int>(std::count(text.begin() + static_cast<ptrdiff_t>(i),
                                          text.begin() + static_cast<ptrdiff_t>(end), '\n'));
      i = std::min(end + 2, text.size());
    } else {
      // A character of punctuation is a token of its own.
      const auto in_word = [](char w) {
        return std::isalnum(static_cast<unsigned char>(w)) != 0 || w == '_' || w == '.' ||
               w == '-' || w == '+';
      };
      size_t end = i + 1;
      while (in_word(c) && end < text.size() && in_word(text[end])) ++end;
      tokens.push_back({std::string(text.substr(i, end - i)), line});
      i = end;
    }
  }
  // The end is a token, too, so that the parser can always look at the next one.
  tokens.push_back({"", line});
  return tokens;
}

/// A whole number as C writes it (10, 0x1f, 017, -3); nothing if the text is none or too large.
std::optional<int64_t> ReadInteger(const std::string& text) {
  errno = 0;
  char* end = nullptr;
  const int64_t value = std::strtoll(text.c_str(), &end, 0);
  if (text.empty() || *end != '\0' || errno == ERANGE) return std::nullopt;
  return value;
}

/// True if the text can name a type or member: lcm-gen looks at the first character only.
bool IsLcmName(const std::string& text) {
  return !text.empty() &&
         (std::isalpha(static_cast<unsigned char>(text[0])) != 0 || text[0] == '_');
}

/// The integer types, which sizes of arrays have.
bool IsInteger(const std::string& type) {
  static const std::set<std::string> names = {"int8_t", "int16_t", "int32_t", "int64_t"};
  return names.contains(type);
}

/// Recursive descent over the tokens; stops at the first error.
class LcmParser {
 public:
  explicit LcmParser(std::string_view text) : tokens_(TokenizeLcm(text)) {}

  Result<std::vector<LcmType>> Parse() {
    while (!Peek().empty() && error_.empty()) {
      // A package holds for the types behind it, up to the next one.
      if (Accept("package")) {
        package_ = Name("a package");
        Expect(";");
      } else if (Accept("struct")) {
        Struct();
      } else if (Accept("enum")) {
        Enum();
      } else {
        Error("expected 'package', 'struct' or 'enum'");
      }
    }
    if (!error_.empty()) return Fail(error_);
    return std::move(types_);
  }

 private:
  /// The next token; Next takes it. The last token, the empty one, is never passed.
  [[nodiscard]] const std::string& Peek() const { return tokens_[at_].text; }
  std::string Next() {
    const std::string text = tokens_[at_].text;
    if (at_ + 1 < tokens_.size()) ++at_;
    return text;
  }
  /// Takes the next token if it is `text`.
  bool Accept(const char* text) {
    if (Peek() != text) return false;
    Next();
    return true;
  }
  /// Takes the token `text`, which must come here.
  void Expect(const char* text) {
    if (!Accept(text)) Error(fmt::format("expected '{}'", text));
  }
  /// Takes a name, which must come here.
  std::string Name(const char* what) {
    if (!IsLcmName(Peek())) {
      Error(fmt::format("expected the name of {}", what));
      return {};
    }
    return Next();
  }
  /// Notes the first error, with its line; parsing stops at it.
  void Error(const std::string& what) {
    constexpr size_t kMostShown = 40;
    if (!error_.empty()) return;
    const std::string found = EscapeControl(Peek().substr(0, kMostShown));
    error_ = fmt::format("line {}: {}, found '{}'", tokens_[at_].line, what, found);
  }
  /// A name without a package is one of the file's package.
  [[nodiscard]] std::string Qualified(const std::string& name) const {
    const bool whole = IsLcmPrimitive(name) || name.find('.') != std::string::npos;
    return whole || package_.empty() ? name : package_ + "." + name;
  }

  /// struct NAME { constants and members }
  void Struct() {
    LcmType type;
    type.name = Qualified(Name("a struct"));
    Expect("{");
    while (error_.empty() && !Accept("}")) {
      if (Peek().empty()) return Error("expected '}'");
      if (Accept("const")) {
        Constants(&type);
      } else {
        Members(&type);
      }
    }
    types_.push_back(std::move(type));
  }

  /// enum NAME { VALUE = 1, VALUE, VALUE; }: commas and semicolons may be left out, as in lcm-gen.
  void Enum() {
    LcmType type;
    type.is_enum = true;
    type.name = Qualified(Name("an enumeration"));
    Expect("{");
    while (error_.empty() && !Accept("}")) {
      const std::string name = Name("a value");
      // A value that is not given is one more than the largest before it, and 1 at least.
      int64_t value = 1;
      if (!type.values.empty()) value = std::max<int64_t>(0, type.values.rbegin()->first) + 1;
      if (Accept("=")) value = Integer();
      if (value < std::numeric_limits<int32_t>::min() ||
          value > std::numeric_limits<int32_t>::max()) {
        Error("the value does not fit 32 bits");
      } else if (!type.values.emplace(static_cast<int32_t>(value), name).second) {
        Error(fmt::format("two values are {}", value));
      }
      if (++members_ > kMostMembers) Error("too many values");
      Accept(",");
      Accept(";");
    }
    types_.push_back(std::move(type));
  }

  /// Takes a whole number, which must come here.
  int64_t Integer() {
    const std::optional<int64_t> value = ReadInteger(Peek());
    if (!value) {
      Error("expected a whole number");
      return 0;
    }
    Next();
    return *value;
  }

  /// Whether a struct has a member or constant of this name already.
  [[nodiscard]] static bool Has(const LcmType& type, const std::string& name) {
    return type.constants.contains(name) || MemberOf(type, name) >= 0;
  }
  /// The index of the member of this name; -1 if there is none.
  [[nodiscard]] static int MemberOf(const LcmType& type, const std::string& name) {
    const auto found = std::ranges::find(type.members, name, &LcmMember::name);
    return found == type.members.end() ? -1 : static_cast<int>(found - type.members.begin());
  }

  /// const TYPE NAME = VALUE, NAME = VALUE;
  void Constants(LcmType* type) {
    const std::string kind = Next();
    if (!IsInteger(kind) && kind != "float" && kind != "double") {
      return Error("a constant is a whole number, a float or a double");
    }
    do {
      const std::string name = Name("a constant");
      if (Has(*type, name)) return Error(fmt::format("there are two '{}'", name));
      Expect("=");
      // Only whole numbers can be the sizes of arrays; the others are kept as they stand.
      if (IsInteger(kind) && !ReadInteger(Peek())) return Error("expected a whole number");
      type->constants[name] = Next();
      if (++members_ > kMostMembers) Error("too many constants");
    } while (error_.empty() && Accept(","));
    Expect(";");
  }

  /// TYPE NAME[SIZE]..., NAME;
  void Members(LcmType* type) {
    const std::string kind = Qualified(Name("a type"));
    do {
      LcmMember member;
      member.line = tokens_[at_].line;
      member.type = kind;
      member.name = Name("a member");
      // Two members of one name could not be told apart in what is shown.
      if (Has(*type, member.name)) return Error(fmt::format("there are two '{}'", member.name));
      while (error_.empty() && Accept("[")) Dimension(*type, &member);
      type->members.push_back(std::move(member));
      if (++members_ > kMostMembers || type->members.size() > kMostInStruct) {
        Error("too many members");
      }
    } while (error_.empty() && Accept(","));
    Expect(";");
  }

  /// SIZE] of a member; the bracket before it is taken.
  void Dimension(const LcmType& type, LcmMember* member) {
    constexpr size_t kMostDimensions = 16;
    if (member->dimensions.size() >= kMostDimensions) return Error("too many dimensions");
    LcmDimension dimension;
    dimension.size = Next();
    // A constant as a size counts by its value, in the fingerprint too.
    const auto constant = type.constants.find(dimension.size);
    if (constant != type.constants.end()) dimension.size = constant->second;
    if (!IsLcmName(dimension.size)) {
      const std::optional<int64_t> size = ReadInteger(dimension.size);
      if (!size || *size <= 0) return Error("the size of an array is a whole number above 0");
      dimension.fixed = *size;
    } else {
      // The receiver must know the size when it comes to the array.
      dimension.variable = true;
      dimension.member = MemberOf(type, dimension.size);
      if (dimension.member < 0) {
        return Error(fmt::format("the size '{}' must be a member before the array",
                                 EscapeControl(dimension.size)));
      }
      const LcmMember& length = type.members[dimension.member];
      if (!IsInteger(length.type) || !length.dimensions.empty()) {
        return Error(fmt::format("the size '{}' must be a whole number", length.name));
      }
    }
    member->dimensions.push_back(std::move(dimension));
    Expect("]");
  }

  std::vector<LcmToken> tokens_;
  size_t at_ = 0;
  std::string package_;
  std::string error_;
  int members_ = 0;  ///< Of all types, with constants and values.
  std::vector<LcmType> types_;
};

}  // namespace

bool IsLcmPrimitive(const std::string& type) {
  static const std::set<std::string> names = {"int8_t", "int16_t", "int32_t", "int64_t", "float",
                                              "double", "string",  "boolean", "byte"};
  return names.contains(type);
}

Result<std::vector<LcmType>> ParseLcm(std::string_view text) { return LcmParser(text).Parse(); }

}  // namespace morphbus::tools
