#pragma once
// LCM structs to bytes and back, with every check that untrusted bytes need: size exact,
// fingerprint, protocol version, CRC-32, lengths within the capacities of vm/limits.h, ids in
// range, numbers finite, text clean. All checks run on the bytes, before anything is allocated.
// Layout: lcm-gen's (big-endian, fingerprint first); header_t comes first in every message, so its
// crc32 stands at byte 8 and its auth at byte 12.

#include <cstddef>
#include <cstdint>
#include <morphbus/header_t.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/wire/wire_limits.h"
#include "compiler/base/check.h"
#include "compiler/base/result.h"

namespace morphbus::bridge {

/// Where lcm-gen puts the first two fields of header_t, behind the fingerprint, and where the
/// others begin: everything that the message says.
inline constexpr size_t kCrcOffset = 8, kAuthOffset = 12, kContentOffset = 20;

/// `text` cut to at most `most` bytes, before a UTF-8 character that would not fit whole. Whoever
/// writes a text into a message cuts it; readers refuse what is longer.
std::string CutText(const std::string& text, size_t most);

/// What is said of a message whose fingerprint is not its type's: LCM's fingerprints change with
/// every field's name, type and order.
inline constexpr const char* kOtherType = "the message is of another type or another version of it";

/// What a message must speak of to be accepted; 0 accepts anything.
struct Expectation {
  /// Hash of the model, and of the program image, that the header must name.
  uint64_t model_hash = 0;
  uint64_t program_hash = 0;
};

/// Checks the bytes of one message of type M as lcm-gen lays them out; its fingerprint is passed
/// over, since Check has looked at it.
/// Refuses whatever the generated decoder would choke on or a receiver must not believe: lengths
/// beyond capacities, text without its NUL or with one inside, numbers that are not finite, ids out
/// of range, trailing bytes. Allocates nothing. Instantiated for the top-level types only
/// (bridge/wire/wire_check.cc).
template <class M>
Result<void> CheckWire(const uint8_t* data, size_t size);

/// CRC-32 (IEEE 802.3, reflected, as in zlib) of an encoded message, its own field counted as zero.
/// `size` is at least 12.
uint32_t MessageCrc(const uint8_t* data, size_t size);

/// Writes the CRC of an encoded message into its place.
void PatchCrc(uint8_t* data, size_t size);

/// Encodes `message` into `out` (replaced), with its CRC and with auth zero: the header's crc32 and
/// auth fields are ignored. The message is the sender's own work, so nothing of it is checked but
/// that lcm-gen could encode it.
template <class M>
void Encode(const M& message, std::vector<uint8_t>* out);

/// Decodes and checks. On error `out` is unspecified, and the error names the field, its place and
/// what is wrong with it.
/// @param data, size  the payload, from any source; nothing is believed of it.
/// @param expect      the model and program that it must speak of.
template <class M>
Result<void> Decode(const uint8_t* data, size_t size, const Expectation& expect, M* out);

/// All of Decode's checks without decoding: for who needs to know only that a message is sound.
template <class M>
Result<void> Check(const uint8_t* data, size_t size, const Expectation& expect);

/// Decode for a message whose header DecodeHeader has accepted: everything else is checked, and the
/// CRC is not computed a second time.
template <class M>
Result<void> DecodeBody(const uint8_t* data, size_t size, M* out);

/// The checks of DecodeBody without decoding.
template <class M>
Result<void> CheckBody(const uint8_t* data, size_t size);

/// Checks protocol and CRC of a message of any type and reads its header: for loggers and spies.
/// Fails also if tick, time or number is below 0; the type and the rest are not looked at.
Result<void> DecodeHeader(const uint8_t* data, size_t size, morphbus::header_t* out);

/// Fingerprint of the message's type; 0 if there are not 8 bytes.
int64_t FingerprintOf(const uint8_t* data, size_t size);

/// Hash of the fingerprints of all wire types and the protocol's number: unlike builds differ in
/// it.
uint64_t WireHash();

// Implementation of the templates.

namespace internal {
/// Puts the CRC of an encoded message into its place, and zero into that of auth.
void FinishEncoding(std::vector<uint8_t>* message);
/// Checks what is the same for every type: fingerprint, protocol, CRC, model and program.
Result<void> CheckEnvelope(const uint8_t* data, size_t size, int64_t fingerprint,
                           const Expectation& expect);
}  // namespace internal

template <class M>
void Encode(const M& message, std::vector<uint8_t>* out) {
  // LCM's own encoder writes everything but the CRC.
  const int size = message.getEncodedSize();
  out->resize(static_cast<size_t>(size));
  MORPHBUS_CHECK(message.encode(out->data(), 0, size) == size);
  internal::FinishEncoding(out);
}

template <class M>
Result<void> Check(const uint8_t* data, size_t size, const Expectation& expect) {
  if (Result<void> r = internal::CheckEnvelope(data, size, M::getHash(), expect); !r) return r;
  return CheckWire<M>(data, size);
}

template <class M>
Result<void> CheckBody(const uint8_t* data, size_t size) {
  if (FingerprintOf(data, size) != M::getHash()) return Fail(kOtherType);
  return CheckWire<M>(data, size);
}

template <class M>
Result<void> DecodeBody(const uint8_t* data, size_t size, M* out) {
  if (Result<void> r = CheckBody<M>(data, size); !r) return r;
  if (out->decode(data, 0, static_cast<int>(size)) != static_cast<int>(size)) {
    return Fail("the message's size does not fit its lengths");
  }
  return {};
}

template <class M>
Result<void> Decode(const uint8_t* data, size_t size, const Expectation& expect, M* out) {
  if (Result<void> r = Check<M>(data, size, expect); !r) return r;
  // Whatever passed the check decodes; should the two ever differ, the decoder has the last word.
  if (out->decode(data, 0, static_cast<int>(size)) != static_cast<int>(size)) {
    return Fail("the message's size does not fit its lengths");
  }
  return {};
}

}  // namespace morphbus::bridge
