#pragma once
// LCM messages as Protocol Buffers, field by field under the same names: what leaves the bus must
// bring its own schema, which the .lcm definitions give.

#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "compiler/base/result.h"
#include "tools/spy/lcm_schema.h"

namespace morphbus::tools {

/// The Protocol Buffers form of one LCM type and of all types that it holds, each under its full
/// LCM name (package morphbus, message sensors_t); fields are numbered from 1 in their order.
/// Integers become sint32 and sint64, a boolean bool, a lone byte uint32, bytes in a row bytes,
/// arrays of more than one dimension one list, in the order of the wire.
class LcmProto {
 public:
  /// Fails if Protocol Buffers cannot express the type, as where two packages need each other.
  static Result<std::unique_ptr<LcmProto>> Create(const LcmSchema& schema, const LcmType& type);
  ~LcmProto();
  LcmProto(const LcmProto&) = delete;
  LcmProto& operator=(const LcmProto&) = delete;

  /// A serialized google.protobuf.FileDescriptorSet with everything that the type needs.
  [[nodiscard]] const std::string& schema() const { return schema_; }
  /// The bytes of a message; `message` is what LcmSchema::Decode() made of one of the type. Text
  /// that is not UTF-8, as the format demands, gets U+FFFD where it is wrong.
  [[nodiscard]] std::string Convert(const nlohmann::ordered_json& message) const;

 private:
  LcmProto();

  std::string schema_;
  /// The descriptors and the factory of messages, which the header need not know.
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace morphbus::tools
