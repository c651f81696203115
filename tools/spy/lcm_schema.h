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
  /// Digits as they stand in the file (also 0x10), or a member's name; constants are replaced by
  /// their values. As a text it is part of the fingerprint.
  std::string size;
  int64_t fixed = 0;  ///< The size, where it is not variable.
  int member = -1;    ///< Where it is: the index of the member, which stands before the array.
};

/// A field of a type, in the order in which it stands on the wire.
struct LcmMember {
  std::string name;
  std::string type;  ///< A primitive, or a full name such as morphbus.pose_t.
  /// Outermost first; empty for a single value.
  std::vector<LcmDimension> dimensions;
  int line = 0;  ///< Of the file.
};

/// A struct or an enumeration of an .lcm file. The schema that parsed it owns it.
struct LcmType {
  std::string name;  ///< Full: package.struct.
  std::vector<LcmMember> members;
  /// Values by name, as they stand in the file. They are not on the wire, but may be the sizes of
  /// arrays.
  std::map<std::string, std::string> constants;
  /// An enumeration has no members: on the wire it is an int32_t.
  bool is_enum = false;
  std::map<int32_t, std::string> values;  ///< An enumeration's names.
  int64_t base_hash = 0;  ///< Of its own members, before those of nested types are added.
  /// The eight bytes that every message of this type begins with, as lcm-gen computes them.
  int64_t fingerprint = 0;
};

/// Types by full name.
using LcmTypes = std::map<std::string, LcmType>;

/// The text of an .lcm file, and what messages call it.
struct LcmFile {
  std::string name;
  std::string text;
};

/// A set of types, by name and by the fingerprint that every message begins with. It never changes
/// after it was parsed; the pointers that it hands out live as long as it does.
class LcmSchema {
 public:
  /// A message that holds more values is not decoded: no person reads them, and types can be
  /// written whose arrays of empty structs have more than any machine holds.
  static constexpr int64_t kMostValues = int64_t{1} << 18;

  /// Parses .lcm text: packages, structs, enumerations, constants, comments. The error names the
  /// line, or the member whose type the text does not define.
  static Result<LcmSchema> Parse(std::string_view text);
  /// Parses files that may use each other's types, in any order; each begins without a package. The
  /// error names file and line. A type that needs one that no file defines, or that nests too
  /// deeply, is left out, and so is a second, other definition of a name: `warnings` says so.
  static Result<LcmSchema> ParseFiles(const std::vector<LcmFile>& files,
                                      std::vector<std::string>* warnings);

  /// The type with this wire fingerprint; nullptr if there is none. Types with equal fields are one
  /// to LCM; the first in order of name is returned.
  [[nodiscard]] const LcmType* Find(int64_t fingerprint) const;
  /// The type of this full name; nullptr if there is none.
  [[nodiscard]] const LcmType* FindByName(const std::string& name) const;
  [[nodiscard]] size_t size() const { return types_.size(); }

  /// A message as an object of its members; arrays of bytes as hexadecimal text, values of
  /// enumerations by name. `data` may be any bytes from the network. Fails on unknown fingerprints,
  /// unless the bytes fit the type exactly, and on messages of more than kMostValues.
  [[nodiscard]] Result<nlohmann::ordered_json> Decode(const uint8_t* data, size_t size) const;
  /// Whether Decode would succeed, without making the object; so much cheaper that every message
  /// can be asked. `type` is that of its fingerprint.
  [[nodiscard]] bool Fits(const LcmType& type, const uint8_t* data, size_t size) const;

 private:
  /// Fills in the fingerprints of all types: their own hashes and those of the types they hold
  /// (lcmgen.c, lcm_struct_hash). Types that nest too deeply are left out and returned.
  std::vector<std::string> ComputeFingerprints();

  LcmTypes types_;  ///< By full name.
  /// Full name of the first type of each fingerprint.
  std::map<int64_t, std::string> by_fingerprint_;
};

}  // namespace morphbus::tools
