#pragma once
// LCM type definitions read at run time, and messages decoded by them: what lets the spy show the
// fields of any message whose .lcm text is known, without generated code.

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "compiler/base/result.h"

namespace morphbus::tools {

/// One dimension of an array: a fixed size, or the name of the member that holds it.
struct LcmDimension {
  bool variable = false;
  std::string size;  ///< Digits, or a member's name; constants are replaced by their values.
};

/// A field of a type, in the order in which it stands on the wire.
struct LcmMember {
  std::string name;
  std::string type;  ///< A primitive, or a full name such as morphbus.pose_t.
  /// Outermost first; empty for a single value.
  std::vector<LcmDimension> dimensions;
};

/// A struct of an .lcm file. The schema that parsed it owns it.
struct LcmType {
  std::string name;  ///< Full: package.struct.
  std::vector<LcmMember> members;
  /// Constants by name. They are not on the wire, but may be the sizes of arrays.
  std::map<std::string, int64_t> constants;
  int64_t base_hash = 0;  ///< Of its own members, before those of nested types are added.
  /// The eight bytes that every message of this type begins with, as lcm-gen computes them.
  int64_t fingerprint = 0;
};

/// A set of types, by name and by the fingerprint that every message begins with. It never changes
/// after Parse; the pointers that it hands out live as long as it does.
class LcmSchema {
 public:
  /// Parses .lcm text: packages, structs, constants, comments. The error names the line, or the
  /// member whose type the text does not define.
  static Result<LcmSchema> Parse(std::string_view text);

  /// The type with this wire fingerprint; nullptr if there is none. Types with equal fields are one
  /// to LCM; the first in order of name is returned.
  [[nodiscard]] const LcmType* Find(int64_t fingerprint) const;
  /// The type of this full name; nullptr if there is none.
  [[nodiscard]] const LcmType* FindByName(const std::string& name) const;

  /// A message as an object of its members; arrays of bytes as hexadecimal text. `data` may be any
  /// bytes from the network. Fails on unknown fingerprints, and unless the bytes fit the type
  /// exactly.
  [[nodiscard]] Result<nlohmann::ordered_json> Decode(const uint8_t* data, size_t size) const;

 private:
  /// Fills in `fingerprint` of all types: their own hashes and those of the types they hold
  /// (lcmgen.c, lcm_struct_hash).
  void ComputeFingerprints();

  std::map<std::string, LcmType> types_;  ///< By full name.
  /// Full name of the first type of each fingerprint.
  std::map<int64_t, std::string> by_fingerprint_;
};

}  // namespace morphbus::tools
