#include "tools/spy/lcm_schema.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <optional>
#include <set>

#include "compiler/base/bytes.h"
#include "tools/spy/lcm_decoder.h"
#include "tools/spy/lcm_parser.h"

namespace morphbus::tools {
namespace {

// ---- Fingerprints (as lcm-gen computes them) ----

/// One step of lcm-gen's hash, whose `c` is a char. C shifts a signed v, whose sign bit fills;
/// unsigned sums may wrap.
int64_t Update(int64_t v, int64_t c) {
  const uint64_t mixed = (static_cast<uint64_t>(v) << 8) ^ static_cast<uint64_t>(v >> 55);
  return static_cast<int64_t>(mixed + static_cast<uint64_t>(int64_t{static_cast<int8_t>(c)}));
}

/// The same for a text: its length, then its characters.
int64_t Update(int64_t v, const std::string& text) {
  v = Update(v, static_cast<int64_t>(text.size()));
  for (const char c : text) v = Update(v, c);
  return v;
}

/// The hash of the members' names, primitive types and dimensions; neither the type's own name nor
/// its constants count. Of an enumeration only the name without its package counts.
int64_t BaseHash(const LcmType& type) {
  if (type.is_enum) {
    const size_t point = type.name.rfind('.');
    return Update(0x87654321, point == std::string::npos ? type.name : type.name.substr(point + 1));
  }
  int64_t v = 0x12345678;
  for (const LcmMember& member : type.members) {
    v = Update(v, member.name);
    if (IsLcmPrimitive(member.type)) v = Update(v, member.type);
    // The number of dimensions comes first, then the mode and the size of each.
    v = Update(v, static_cast<int64_t>(member.dimensions.size()));
    for (const LcmDimension& dimension : member.dimensions) {
      // The mode of lcm-gen is 0 for a fixed size and 1 for a variable one.
      v = Update(v, dimension.variable ? 1 : 0);
      v = Update(v, dimension.size);
    }
  }
  return v;
}

/// The hashes of types with those of the types that they hold.
class RecursiveHashes {
 public:
  explicit RecursiveHashes(const LcmTypes& types) : types_(types) {}

  /// Of the type of this name; nothing if it nests too deeply, or in too many ways, to be computed.
  std::optional<int64_t> Of(const std::string& name) {
    steps_ = 0;
    limit_ = wasted_ > kMostWasted ? kFewSteps : kMostSteps;
    bool cut = false;
    const int64_t hash = Hash(name, &cut);
    if (steps_ <= limit_) return hash;
    wasted_ += steps_;
    return std::nullopt;
  }

 private:
  // Steps of one computation, and types within types. Those that hold themselves along many ways
  // would take for ever; lcm-gen's own code would, too. Once so many steps have led to nothing, a
  // type gets few only, for there may be thousands like it.
  static constexpr int kMostSteps = 200'000;
  static constexpr int kMostWasted = 400'000;
  static constexpr int kFewSteps = 1'000;
  static constexpr size_t kDeepestHash = 64;

  /// A type within itself counts once, or there would be no end; `cut` tells that this happened.
  int64_t Hash(const std::string& name, bool* cut) {
    const auto known = known_.find(name);
    if (known != known_.end()) return known->second;
    const auto type = types_.find(name);
    if (type == types_.end()) return 0;
    if (type->second.is_enum) return type->second.base_hash;
    if (std::find(parents_.begin(), parents_.end(), name) != parents_.end()) {
      *cut = true;
      return 0;
    }
    // Nesting that deep would use up the stack: the computation is given up with the next step.
    if (parents_.size() >= kDeepestHash) steps_ = limit_;
    // The members' hashes are added, and the sum turned by a bit; primitives have none.
    parents_.push_back(name);
    bool cut_below = false;
    auto v = static_cast<uint64_t>(type->second.base_hash);
    for (const LcmMember& member : type->second.members) {
      if (++steps_ > limit_) break;
      if (!IsLcmPrimitive(member.type)) v += static_cast<uint64_t>(Hash(member.type, &cut_below));
    }
    parents_.pop_back();
    const auto hash = static_cast<int64_t>(std::rotl(v, 1));
    // Nothing below was cut, so that the hash does not depend on who asks.
    if (!cut_below && steps_ <= limit_) known_.emplace(name, hash);
    *cut |= cut_below;
    return hash;
  }

  const LcmTypes& types_;
  std::vector<std::string> parents_;  ///< The types whose hash is being computed, outermost first.
  std::map<std::string, int64_t> known_;
  int steps_ = 0;   ///< Of this computation,
  int limit_ = 0;   ///< how many it may take,
  int wasted_ = 0;  ///< and how many those took that led to nothing.
};

/// True if two definitions give the same messages with the same names.
bool SameFields(const LcmType& a, const LcmType& b) {
  const auto same = [](const LcmMember& x, const LcmMember& y) { return x.type == y.type; };
  return a.is_enum == b.is_enum && a.values == b.values && BaseHash(a) == BaseHash(b) &&
         std::equal(a.members.begin(), a.members.end(), b.members.begin(), b.members.end(), same);
}

/// The first member whose type nobody defines; nullptr if there is none.
const LcmMember* Undefined(const LcmType& type, const LcmTypes& types) {
  const auto found =
      std::find_if(type.members.begin(), type.members.end(), [&](const LcmMember& member) {
        return !IsLcmPrimitive(member.type) && !types.contains(member.type);
      });
  return found == type.members.end() ? nullptr : &*found;
}

}  // namespace

Result<LcmSchema> LcmSchema::Parse(std::string_view text) {
  Result<std::vector<LcmType>> types = ParseLcm(text);
  if (!types) return Fail(types.error().message);
  LcmSchema schema;
  for (LcmType& type : *types) {
    // Of two definitions of one name in a text the last one counts.
    std::string name = type.name;
    schema.types_.insert_or_assign(std::move(name), std::move(type));
  }
  // Types may be used before they are defined, so names are looked up when all are known. A member
  // of an unknown type could be neither hashed nor decoded.
  for (const auto& [name, type] : schema.types_) {
    const LcmMember* member = Undefined(type, schema.types_);
    if (member == nullptr) continue;
    return Fail(
        fmt::format("{}: member {} is of unknown type {}", name, member->name, member->type));
  }
  const std::vector<std::string> too_deep = schema.ComputeFingerprints();
  if (!too_deep.empty()) return Fail(too_deep.front() + ": nests too deeply");
  return schema;
}

Result<LcmSchema> LcmSchema::ParseFiles(const std::vector<LcmFile>& files,
                                        std::vector<std::string>* warnings) {
  LcmSchema schema;
  std::map<std::string, std::string> file_of;  // By type.
  for (const LcmFile& file : files) {
    Result<std::vector<LcmType>> types = ParseLcm(file.text);
    if (!types) return Fail(fmt::format("{}: {}", file.name, types.error().message));
    for (LcmType& type : *types) {
      const std::string name = type.name;
      const auto known = schema.types_.find(name);
      // Projects often have copies of each other's files, which are no mistake while they say the
      // same.
      if (known == schema.types_.end()) {
        file_of[name] = file.name;
        schema.types_.emplace(name, std::move(type));
      } else if (!SameFields(known->second, type)) {
        warnings->push_back(fmt::format("{}: {} is another one than in {}, which counts", file.name,
                                        name, file_of[name]));
      }
    }
  }
  // Leaving a type out can leave another one without it.
  for (bool again = true; again;) {
    again = false;
    for (auto it = schema.types_.begin(); it != schema.types_.end();) {
      const LcmMember* member = Undefined(it->second, schema.types_);
      if (member == nullptr) {
        ++it;
        continue;
      }
      warnings->push_back(fmt::format("{}:{}: {} is left out: no file defines the type of {}, {}",
                                      file_of[it->first], member->line, it->first, member->name,
                                      member->type));
      it = schema.types_.erase(it);
      again = true;
    }
  }
  for (const std::string& name : schema.ComputeFingerprints()) {
    warnings->push_back(
        fmt::format("{}: {} is left out: it nests too deeply", file_of[name], name));
  }
  return schema;
}

std::vector<std::string> LcmSchema::ComputeFingerprints() {
  for (auto& [name, type] : types_) type.base_hash = BaseHash(type);
  RecursiveHashes hashes(types_);
  std::vector<std::string> too_deep;
  for (auto& [name, type] : types_) {
    const std::optional<int64_t> hash = hashes.Of(name);
    if (!hash) {
      too_deep.push_back(name);
      continue;
    }
    type.fingerprint = *hash;
    // Types of equal fields have one fingerprint, and the first in order of name keeps it.
    by_fingerprint_.emplace(*hash, name);
  }
  return too_deep;
}

const LcmType* LcmSchema::Find(int64_t fingerprint) const {
  const auto found = by_fingerprint_.find(fingerprint);
  return found == by_fingerprint_.end() ? nullptr : FindByName(found->second);
}

const LcmType* LcmSchema::FindByName(const std::string& name) const {
  const auto found = types_.find(name);
  return found == types_.end() ? nullptr : &found->second;
}

bool LcmSchema::Fits(const LcmType& type, const uint8_t* data, size_t size) const {
  return LcmDecoder(types_, data, size).Message(type, nullptr);
}

Result<nlohmann::ordered_json> LcmSchema::Decode(const uint8_t* data, size_t size) const {
  if (size < 8) return Fail("shorter than a fingerprint");
  const uint64_t bits = ReadBig(data, 8);
  const LcmType* type = Find(static_cast<int64_t>(bits));
  if (type == nullptr) return Fail(fmt::format("unknown type, fingerprint {:016x}", bits));
  LcmDecoder decoder(types_, data, size);
  nlohmann::ordered_json json;
  if (decoder.Message(*type, &json)) return json;
  if (decoder.too_long()) {
    return Fail(fmt::format("more than {} values of {}", kMostValues, type->name));
  }
  return Fail(fmt::format("the bytes do not fit {}", type->name));
}

}  // namespace morphbus::tools
