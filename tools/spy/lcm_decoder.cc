#include "tools/spy/lcm_decoder.h"

#include <fmt/format.h>

#include <bit>

#include "compiler/base/bytes.h"
#include "tools/spy/lcm_parser.h"

namespace morphbus::tools {
namespace {

// A type may hold itself, so that only the depth bounds the recursion.
constexpr int kDeepest = 32;

/// Bytes of a number or truth value on the wire; 0 for what is none.
int WidthOf(const std::string& type) {
  static const std::map<std::string, int> widths = {{"int8_t", 1},  {"int16_t", 2}, {"int32_t", 4},
                                                    {"int64_t", 8}, {"byte", 1},    {"boolean", 1},
                                                    {"float", 4},   {"double", 8}};
  const auto found = widths.find(type);
  return found == widths.end() ? 0 : found->second;
}

}  // namespace

bool LcmDecoder::Message(const LcmType& type, Json* out) {
  if (size_ < at_) return false;
  // A message may also be a bare enumeration.
  const bool fits = type.is_enum ? Value(type.name, 0, out) : Struct(type, 0, out);
  // Bytes that are left over are a sign of another type as much as bytes that are missing.
  return fits && at_ == size_;
}

bool LcmDecoder::Struct(const LcmType& type, int depth, Json* out) {
  if (depth > kDeepest || ++values_ > LcmSchema::kMostValues) return false;
  Lengths lengths(type.members.size());
  if (out != nullptr) *out = Json::object();
  for (size_t i = 0; i < type.members.size(); ++i) {
    const LcmMember& member = type.members[i];
    // No two members have one name, so that nothing need be looked up.
    Json* value = nullptr;
    if (out != nullptr) {
      value = &out->get_ref<Json::object_t&>().emplace_back(member.name, nullptr).second;
    }
    if (!member.dimensions.empty()) {
      if (!Array(member, 0, lengths, depth, value)) return false;
    } else if (!Value(member.type, depth, value, &lengths[i])) {
      return false;
    }
  }
  return true;
}

bool LcmDecoder::Array(const LcmMember& member, size_t dimension, const Lengths& lengths, int depth,
                       Json* out) {
  if (dimension == member.dimensions.size()) return Value(member.type, depth, out);
  if (++values_ > LcmSchema::kMostValues) return false;
  const LcmDimension& d = member.dimensions[dimension];
  const int64_t count = d.variable ? lengths[d.member] : d.fixed;
  // Every element takes a byte at least, so a length from outside cannot ask for more. Structs
  // without members take none: of those the number of values is the only bound.
  if (count < 0 || static_cast<uint64_t>(count) > size_ - at_) return false;
  const bool last = dimension + 1 == member.dimensions.size();
  if (member.type == "byte" && last) return Bytes(count, out);
  // Nobody wants to see the numbers: they are passed over as a whole.
  const int width = WidthOf(member.type);
  if (out == nullptr && last && width > 0) {
    if (static_cast<uint64_t>(count) > (size_ - at_) / static_cast<size_t>(width)) return false;
    values_ += count;
    at_ += static_cast<size_t>(count) * static_cast<size_t>(width);
    return !too_long();
  }
  if (out != nullptr) *out = Json::array();
  for (int64_t i = 0; i < count; ++i) {
    Json element;
    if (!Array(member, dimension + 1, lengths, depth, out == nullptr ? nullptr : &element)) {
      return false;
    }
    if (out != nullptr) out->push_back(std::move(element));
  }
  return true;
}

bool LcmDecoder::Bytes(int64_t count, Json* out) {
  if (out != nullptr) *out = fmt::format("{:02x}", fmt::join(data_ + at_, data_ + at_ + count, ""));
  at_ += static_cast<size_t>(count);
  return true;
}

bool LcmDecoder::Value(const std::string& type, int depth, Json* out, int64_t* whole) {
  if (++values_ > LcmSchema::kMostValues) return false;
  if (type == "string") return Text(out);
  if (type == "float" || type == "double") {
    uint64_t bits = 0;
    // Both are sent as the bits of IEEE 754 numbers.
    if (!Unsigned(WidthOf(type), &bits)) return false;
    if (out == nullptr) return true;
    *out = type == "float" ? static_cast<double>(std::bit_cast<float>(static_cast<uint32_t>(bits)))
                           : std::bit_cast<double>(bits);
    return true;
  }
  if (WidthOf(type) > 0) {
    int64_t value = 0;
    if (!Whole(type, &value)) return false;
    if (whole != nullptr) *whole = value;
    if (out != nullptr) *out = type == "boolean" ? Json(value != 0) : Json(value);
    return true;
  }
  // What is no primitive is a type of the schema.
  const auto nested = types_.find(type);
  if (nested == types_.end()) return false;
  if (!nested->second.is_enum) return Struct(nested->second, depth + 1, out);
  int64_t value = 0;
  if (!Whole("int32_t", &value)) return false;
  if (out == nullptr) return true;
  // A value that has no name is shown as the number it is.
  const auto name = nested->second.values.find(static_cast<int32_t>(value));
  *out = name == nested->second.values.end() ? Json(value) : Json(name->second);
  return true;
}

bool LcmDecoder::Whole(const std::string& type, int64_t* out) {
  uint64_t bits = 0;
  const int width = WidthOf(type);
  if (!Unsigned(width, &bits)) return false;
  // Shifting up and back fills in the sign; bytes have none.
  const int shift = 64 - 8 * width;
  *out = type == "byte" ? static_cast<int64_t>(bits) : static_cast<int64_t>(bits << shift) >> shift;
  return true;
}

bool LcmDecoder::Text(Json* out) {
  uint64_t length = 0;
  // The length counts the zero, so that it is 1 at least.
  if (!Unsigned(4, &length) || length == 0 || length > size_ - at_) return false;
  const char* begin = reinterpret_cast<const char*>(data_ + at_);
  if (begin[length - 1] != '\0') return false;
  at_ += length;
  if (out != nullptr) *out = std::string(begin, length - 1);
  return true;
}

bool LcmDecoder::Unsigned(int bytes, uint64_t* out) {
  if (static_cast<size_t>(bytes) > size_ - at_) return false;
  *out = ReadBig(data_ + at_, bytes);
  at_ += static_cast<size_t>(bytes);
  return true;
}

}  // namespace morphbus::tools
