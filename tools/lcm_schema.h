#pragma once
// LCM type definitions read at run time, and messages decoded by them: what lets the spy show the
// fields of any message whose .lcm text is known, without generated code.

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "compiler/source/result.h"

namespace morphbus::tools {

/// One dimension of an array: a fixed size, or the name of the member that holds it.
struct LcmDimension {
  bool variable = false;
  std::string size;  ///< Digits, or a member's name; constants are replaced by their values.
};

struct LcmMember {
  std::string name;
  std::string type;  ///< A primitive, or a full name such as morphbus.pose_t.
  std::vector<LcmDimension> dimensions;
};

struct LcmType {
  std::string name;  ///< Full: package.struct.
  std::vector<LcmMember> members;
  std::map<std::string, int64_t> constants;
  int64_t base_hash = 0;  ///< Of its own members, before those of nested types are added.
  int64_t fingerprint = 0;
};

class LcmSchema {
 public:
  /// Parses .lcm text: packages, structs, constants, comments. The error names the line.
  static Result<LcmSchema> Parse(std::string_view text);

  /// The type with this wire fingerprint; nullptr if there is none. Types with equal fields are one
  /// to LCM; the first in order of name is returned.
  [[nodiscard]] const LcmType* Find(int64_t fingerprint) const;
  [[nodiscard]] const LcmType* FindByName(const std::string& name) const;

  /// A message as an object of its members; arrays of bytes as hexadecimal text. Fails on unknown
  /// fingerprints, and unless the bytes fit the type exactly.
  [[nodiscard]] Result<nlohmann::ordered_json> Decode(const uint8_t* data, size_t size) const;

 private:
  void ComputeFingerprints();

  std::map<std::string, LcmType> types_;
  std::map<int64_t, std::string> by_fingerprint_;
};

}  // namespace morphbus::tools
