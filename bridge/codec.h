#pragma once
// LCM structs to bytes and back, with every check that untrusted bytes need: size exact,
// fingerprint, protocol version, CRC-32, lengths within the capacities of vm/limits.h, ids in
// range, numbers finite, text clean. All checks run on the bytes, before anything is allocated.
// Layout: lcm-gen's (big-endian, fingerprint first); header_t comes first in every message, so its
// crc32 stands at byte 8.

#include <cstdint>
#include <morphbus/header_t.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/wire_check.h"
#include "compiler/source/check.h"
#include "compiler/source/result.h"

namespace morphbus::bridge {

/// Largest message that a channel of the run may carry, bytes: with LCM's header (8), the longest
/// channel name (64) and IP and UDP (28) the packet stays within 1400 bytes.
inline constexpr size_t kMaxPayloadBytes = 1300;

/// What a message must speak of to be accepted; 0 accepts anything.
struct Expectation {
  uint64_t model_hash = 0;
  uint64_t program_hash = 0;
};

/// CRC-32 (IEEE 802.3, reflected, as in zlib) of an encoded message, its own field counted as zero.
/// `size` is at least 12.
uint32_t MessageCrc(const uint8_t* data, size_t size);

/// Encodes `message` into `out` (replaced), with its CRC. The header's crc32 field is ignored.
template <class M>
void Encode(const M& message, std::vector<uint8_t>* out);

/// Decodes and checks. On error `out` is unspecified, and the error says at which byte and why.
template <class M>
Result<void> Decode(const uint8_t* data, size_t size, const Expectation& expect, M* out);

/// All of Decode's checks without decoding.
template <class M>
Result<void> Check(const uint8_t* data, size_t size, const Expectation& expect);

/// Checks protocol and CRC of a message of any type and reads its header: for loggers and spies.
Result<void> DecodeHeader(const uint8_t* data, size_t size, morphbus::header_t* out);

/// Fingerprint of the message's type; 0 if there are not 8 bytes.
int64_t FingerprintOf(const uint8_t* data, size_t size);

/// Hash of the fingerprints of all wire types and the protocol's number: unlike builds differ in
/// it.
uint64_t WireHash();

// Implementation of the templates.

namespace internal {
void PatchCrc(std::vector<uint8_t>* message);
Result<void> CheckEnvelope(const uint8_t* data, size_t size, int64_t fingerprint,
                           const Expectation& expect);
}  // namespace internal

template <class M>
void Encode(const M& message, std::vector<uint8_t>* out) {
  const int size = message.getEncodedSize();
  out->resize(static_cast<size_t>(size));
  MORPHBUS_CHECK(message.encode(out->data(), 0, size) == size);
  internal::PatchCrc(out);
}

template <class M>
Result<void> Check(const uint8_t* data, size_t size, const Expectation& expect) {
  if (Result<void> r = internal::CheckEnvelope(data, size, M::getHash(), expect); !r) return r;
  return CheckWire<M>(data, size);
}

template <class M>
Result<void> Decode(const uint8_t* data, size_t size, const Expectation& expect, M* out) {
  if (Result<void> r = Check<M>(data, size, expect); !r) return r;
  if (out->decode(data, 0, static_cast<int>(size)) != static_cast<int>(size)) {
    return Fail("the message's size does not fit its lengths");
  }
  return {};
}

}  // namespace morphbus::bridge
