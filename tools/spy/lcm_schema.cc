#include "tools/spy/lcm_schema.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cctype>
#include <cstring>
#include <set>

#include "compiler/base/bytes.h"

namespace morphbus::tools {
namespace {

using Json = nlohmann::ordered_json;

/// The types that lcm-gen knows without a definition.
const std::set<std::string>& Primitives() {
  static const std::set<std::string> names = {"int8_t", "int16_t", "int32_t", "int64_t", "float",
                                              "double", "string",  "boolean", "byte"};
  return names;
}

// ---- Parsing ----

/// A word, a number or a single character.
struct Token {
  std::string text;  ///< Empty at the end.
  int line = 1;
};

/// Words may hold points (package.type) and minus signs (-1); comments and space are left out.
std::vector<Token> Tokenize(std::string_view text) {
  std::vector<Token> tokens;
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
        return std::isalnum(static_cast<unsigned char>(w)) != 0 || w == '_' || w == '.' || w == '-';
      };
      size_t end = i + 1;
      while (in_word(c) && end < text.size() && in_word(text[end])) ++end;
      tokens.push_back({std::string(text.substr(i, end - i)), line});
      i = end;
    }
  }
  tokens.push_back({"", line});
  return tokens;
}

/// Recursive descent over the tokens; stops at the first error.
class Parser {
 public:
  explicit Parser(std::string_view text) : tokens_(Tokenize(text)) {}

  Result<std::map<std::string, LcmType>> Parse() {
    while (!Peek().empty() && error_.empty()) {
      if (Accept("package")) {
        package_ = Next();
        Expect(";");
      } else if (Accept("struct")) {
        Struct();
      } else {
        Error("expected 'package' or 'struct'");
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
  /// Notes the first error, with its line; parsing stops at it.
  void Error(const std::string& what) {
    if (error_.empty())
      error_ = fmt::format("line {}: {}, found '{}'", tokens_[at_].line, what, Peek());
  }
  /// A name without a package is one of the file's package.
  [[nodiscard]] std::string Qualified(const std::string& name) const {
    const bool whole = Primitives().contains(name) || name.find('.') != std::string::npos;
    return whole || package_.empty() ? name : package_ + "." + name;
  }

  /// struct NAME { constants and members }
  void Struct() {
    LcmType type;
    type.name = Qualified(Next());
    Expect("{");
    while (error_.empty() && !Accept("}")) {
      if (Peek().empty()) return Error("expected '}'");
      if (Accept("const")) {
        Constants(&type);
      } else {
        Members(&type);
      }
    }
    types_[type.name] = type;
  }

  /// const TYPE NAME = VALUE, NAME = VALUE;
  void Constants(LcmType* type) {
    Next();  // its type
    do {
      const std::string name = Next();
      Expect("=");
      const std::string value = Next();
      // Base 0 takes hexadecimal numbers as well; constants that are fractions are cut, for no
      // array has such a size.
      type->constants[name] = std::strtoll(value.c_str(), nullptr, 0);
    } while (Accept(",") && error_.empty());
    Expect(";");
  }

  /// TYPE NAME[SIZE]..., NAME;
  void Members(LcmType* type) {
    const std::string kind = Qualified(Next());
    do {
      LcmMember member;
      member.type = kind;
      member.name = Next();
      while (error_.empty() && Accept("[")) {
        LcmDimension dimension;
        dimension.size = Next();
        // A constant as a size counts by its value, in the fingerprint too.
        const auto constant = type->constants.find(dimension.size);
        if (constant != type->constants.end()) dimension.size = std::to_string(constant->second);
        dimension.variable = std::isdigit(static_cast<unsigned char>(dimension.size[0])) == 0;
        member.dimensions.push_back(dimension);
        Expect("]");
      }
      type->members.push_back(member);
    } while (Accept(",") && error_.empty());
    Expect(";");
  }

  std::vector<Token> tokens_;
  size_t at_ = 0;
  std::string package_;
  std::string error_;
  std::map<std::string, LcmType> types_;
};

// ---- Fingerprints (as lcm-gen computes them) ----

/// One step of lcm-gen's hash. C shifts a signed v, whose sign bit fills; unsigned sums may wrap.
int64_t Update(int64_t v, int64_t c) {
  const uint64_t mixed = (static_cast<uint64_t>(v) << 8) ^ static_cast<uint64_t>(v >> 55);
  return static_cast<int64_t>(mixed + static_cast<uint64_t>(c));
}

/// The same for a text: its length, then its characters.
int64_t Update(int64_t v, const std::string& text) {
  v = Update(v, static_cast<int64_t>(text.size()));
  for (const char c : text) v = Update(v, c);
  return v;
}

/// The hash of the members' names, primitive types and dimensions; neither the type's own name nor
/// its constants count.
int64_t BaseHash(const LcmType& type) {
  int64_t v = 0x12345678;
  for (const LcmMember& member : type.members) {
    v = Update(v, member.name);
    if (Primitives().contains(member.type)) v = Update(v, member.type);
    // The number of dimensions comes first, then the mode and the size of each.
    v = Update(v, static_cast<int64_t>(member.dimensions.size()));
    for (const LcmDimension& dimension : member.dimensions) {
      v = Update(v, dimension.variable ? 1 : 0);
      v = Update(v, dimension.size);
    }
  }
  return v;
}

/// The hash of a type with those of the types that it holds. A type within itself counts once, or
/// there would be no end.
int64_t RecursiveHash(const std::map<std::string, LcmType>& types, const std::string& name,
                      std::vector<std::string>* parents) {
  const auto type = types.find(name);
  if (type == types.end() || std::find(parents->begin(), parents->end(), name) != parents->end())
    return 0;
  // The types on the way down are remembered, to notice one within itself.
  parents->push_back(name);
  uint64_t v = static_cast<uint64_t>(type->second.base_hash);
  for (const LcmMember& member : type->second.members) {
    v += static_cast<uint64_t>(RecursiveHash(types, member.type, parents));
  }
  parents->pop_back();
  return static_cast<int64_t>(std::rotl(v, 1));
}

// ---- Decoding ----

/// Walks one message; every read is checked.
class Decoder {
 public:
  Decoder(const std::map<std::string, LcmType>& types, const uint8_t* data, size_t size)
      : types_(types), data_(data), size_(size) {}

  /// All members in order. Integers are remembered: an array behind them may have them as its
  /// length.
  bool Struct(const LcmType& type, int depth, Json* out) {
    // A type may hold itself, so that only the depth bounds the recursion.
    if (depth > 16) return false;
    std::map<std::string, int64_t> lengths;
    *out = Json::object();
    for (const LcmMember& member : type.members) {
      Json value;
      if (!Array(member, 0, lengths, depth, &value)) return false;
      if (value.is_number_integer()) lengths[member.name] = value.get<int64_t>();
      (*out)[member.name] = std::move(value);
    }
    return true;
  }

  [[nodiscard]] bool at_end() const { return at_ == size_; }

 private:
  /// The dimensions from `dimension` on; below the last one stands a value.
  bool Array(const LcmMember& member, size_t dimension,
             const std::map<std::string, int64_t>& lengths, int depth, Json* out) {
    if (dimension == member.dimensions.size()) return Value(member.type, depth, out);
    const LcmDimension& d = member.dimensions[dimension];
    const auto known = lengths.find(d.size);
    // The length must have come before the array, as in LCM.
    if (d.variable && known == lengths.end()) return false;
    const int64_t count = d.variable ? known->second : std::strtoll(d.size.c_str(), nullptr, 10);
    // Every element takes a byte at least, so a length from outside cannot ask for more.
    if (count < 0 || static_cast<uint64_t>(count) > size_ - at_) return false;
    if (member.type == "byte" && dimension + 1 == member.dimensions.size())
      return Bytes(count, out);
    *out = Json::array();
    for (int64_t i = 0; i < count; ++i) {
      Json element;
      if (!Array(member, dimension + 1, lengths, depth, &element)) return false;
      out->push_back(std::move(element));
    }
    return true;
  }

  /// So many bytes as hexadecimal digits, for bytes need not be text.
  bool Bytes(int64_t count, Json* out) {
    *out = fmt::format("{:02x}", fmt::join(data_ + at_, data_ + at_ + count, ""));
    at_ += static_cast<size_t>(count);
    return true;
  }

  /// A value that is no array: text, number, truth or a nested struct.
  bool Value(const std::string& type, int depth, Json* out) {
    if (type == "string") return Text(out);
    if (type == "float" || type == "double") {
      uint64_t bits = 0;
      // Both are sent as the bits of IEEE 754 numbers.
      if (!Unsigned(type == "float" ? 4 : 8, &bits)) return false;
      *out = type == "float"
                 ? static_cast<double>(std::bit_cast<float>(static_cast<uint32_t>(bits)))
                 : std::bit_cast<double>(bits);
      return true;
    }
    static const std::map<std::string, int> widths = {
        {"int8_t", 1}, {"int16_t", 2}, {"int32_t", 4}, {"int64_t", 8}, {"boolean", 1}, {"byte", 1}};
    const auto width = widths.find(type);
    if (width == widths.end()) {
      // What is no primitive is a struct of the schema.
      const auto nested = types_.find(type);
      return nested != types_.end() && Struct(nested->second, depth + 1, out);
    }
    uint64_t bits = 0;
    if (!Unsigned(width->second, &bits)) return false;
    // Shifting up and back fills in the sign.
    const int shift = 64 - 8 * width->second;
    const int64_t value = static_cast<int64_t>(bits << shift) >> shift;
    if (type == "boolean") {
      *out = value != 0;
    } else {
      *out = type == "byte" ? static_cast<int64_t>(bits) : value;
    }
    return true;
  }

  /// A string: its length with the closing zero, then the bytes, then the zero.
  bool Text(Json* out) {
    uint64_t length = 0;
    // The length counts the zero, so that it is 1 at least.
    if (!Unsigned(4, &length) || length == 0 || length > size_ - at_) return false;
    const char* begin = reinterpret_cast<const char*>(data_ + at_);
    if (begin[length - 1] != '\0') return false;
    at_ += length;
    *out = std::string(begin, length - 1);
    return true;
  }

  /// An unsigned number of so many bytes, big-endian as all of LCM is.
  bool Unsigned(int bytes, uint64_t* out) {
    if (static_cast<size_t>(bytes) > size_ - at_) return false;
    *out = ReadBig(data_ + at_, bytes);
    at_ += static_cast<size_t>(bytes);
    return true;
  }

  const std::map<std::string, LcmType>& types_;
  const uint8_t* data_;
  size_t size_;
  size_t at_ = 8;  ///< Behind the fingerprint.
};

}  // namespace

Result<LcmSchema> LcmSchema::Parse(std::string_view text) {
  // Types may be used before they are defined, so names are looked up when all are known.
  Result<std::map<std::string, LcmType>> types = Parser(text).Parse();
  if (!types) return Fail(types.error().message);
  LcmSchema schema;
  schema.types_ = std::move(*types);
  // A member of an unknown type could be neither hashed nor decoded.
  for (const auto& [name, type] : schema.types_) {
    for (const LcmMember& member : type.members) {
      if (Primitives().contains(member.type) || schema.types_.contains(member.type)) continue;
      return Fail(
          fmt::format("{}: member {} is of unknown type {}", name, member.name, member.type));
    }
  }
  schema.ComputeFingerprints();
  return schema;
}

void LcmSchema::ComputeFingerprints() {
  for (auto& [name, type] : types_) type.base_hash = BaseHash(type);
  for (auto& [name, type] : types_) {
    // Every type starts a walk of its own: what it holds counts afresh.
    std::vector<std::string> parents;
    type.fingerprint = RecursiveHash(types_, name, &parents);
    by_fingerprint_.emplace(type.fingerprint, name);
  }
}

const LcmType* LcmSchema::Find(int64_t fingerprint) const {
  const auto found = by_fingerprint_.find(fingerprint);
  return found == by_fingerprint_.end() ? nullptr : FindByName(found->second);
}

const LcmType* LcmSchema::FindByName(const std::string& name) const {
  const auto found = types_.find(name);
  return found == types_.end() ? nullptr : &found->second;
}

Result<Json> LcmSchema::Decode(const uint8_t* data, size_t size) const {
  if (size < 8) return Fail("shorter than a fingerprint");
  const uint64_t bits = ReadBig(data, 8);
  const LcmType* type = Find(static_cast<int64_t>(bits));
  if (type == nullptr) return Fail(fmt::format("unknown type, fingerprint {:016x}", bits));
  Decoder decoder(types_, data, size);
  Json json;
  // Bytes that are left over are a sign of another type as much as bytes that are missing.
  if (!decoder.Struct(*type, 0, &json) || !decoder.at_end()) {
    return Fail(fmt::format("the bytes do not fit {}", type->name));
  }
  return json;
}

}  // namespace morphbus::tools
