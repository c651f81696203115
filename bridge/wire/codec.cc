#include "bridge/wire/codec.h"

#include <libdeflate.h>

#include <array>
#include <cstring>

#include "bridge/wire/wire_size.h"
#include "compiler/base/big_endian.h"
#include "compiler/base/utf8.h"

namespace morphbus::bridge {
namespace {

// Where the further fields of header_t stand that are looked at without decoding.
constexpr size_t kProtocolOffset = OffsetOf<morphbus::header_t>("protocol");
constexpr size_t kModelOffset = OffsetOf<morphbus::header_t>("model_hash");
constexpr size_t kProgramOffset = OffsetOf<morphbus::header_t>("program_hash");
constexpr size_t kHeaderEnd = 8 + LargestSize<morphbus::header_t>();
static_assert(OffsetOf<morphbus::header_t>("crc32") == kCrcOffset &&
              OffsetOf<morphbus::header_t>("auth") == kAuthOffset &&
              kProtocolOffset == kContentOffset);

/// Protocol and CRC, the same for every type.
Result<void> CheckHeaderBytes(const uint8_t* data, size_t size) {
  if (size < kHeaderEnd) return Fail("the message is shorter than its header");
  // The protocol comes first: another one may mean another CRC.
  const auto protocol = static_cast<int32_t>(LoadBigEndian<uint32_t>(data + kProtocolOffset));
  if (protocol != morphbus::header_t::PROTOCOL) {
    return Fail("the message speaks protocol " + std::to_string(protocol) + ", this build " +
                std::to_string(morphbus::header_t::PROTOCOL));
  }
  // A message may have been changed on its way, or made up.
  if (LoadBigEndian<uint32_t>(data + kCrcOffset) != MessageCrc(data, size)) {
    return Fail("the message's CRC does not fit its bytes");
  }
  return {};
}

}  // namespace

std::string CutText(const std::string& text, size_t most) {
  if (text.size() <= most) return text;
  // No character is cut in two.
  size_t end = most;
  while (end > 0 && ContinuesCharacter(text[end])) --end;
  return text.substr(0, end);
}

uint32_t MessageCrc(const uint8_t* data, size_t size) {
  // The CRC's own bytes count as zero.
  constexpr std::array<uint8_t, 4> kZero = {};
  uint32_t crc = libdeflate_crc32(0, data, kCrcOffset);
  crc = libdeflate_crc32(crc, kZero.data(), kZero.size());
  return libdeflate_crc32(crc, data + kCrcOffset + 4, size - kCrcOffset - 4);
}

void PatchCrc(uint8_t* data, size_t size) {
  // In network order, like every number of LCM's.
  StoreBigEndian(MessageCrc(data, size), data + kCrcOffset);
}

int64_t FingerprintOf(const uint8_t* data, size_t size) {
  return size < 8 ? 0 : static_cast<int64_t>(LoadBigEndian<uint64_t>(data));
}

Result<void> DecodeHeader(const uint8_t* data, size_t size, morphbus::header_t* out) {
  if (Result<void> r = CheckHeaderBytes(data, size); !r) return r;
  // The length was checked above, and a header has no arrays: this cannot fail.
  out->_decodeNoHash(data, 8, static_cast<int>(size) - 8);
  if (out->tick < 0 || out->sequence < 0 || out->sim_time_us < 0) {
    return Fail("the message's header counts below zero");
  }
  if (out->sequence > kMostSequence) return Fail("its sequence number is impossible");
  return {};
}

uint64_t WireHash() {
  // Every type that travels, and the rules that fingerprints do not show.
  const std::array<int64_t, 21> parts = {
      morphbus::header_t::PROTOCOL,         morphbus::sim_clock_t::getHash(),
      morphbus::sensors_t::getHash(),       morphbus::world_t::getHash(),
      morphbus::transform_t::getHash(),     morphbus::actuator_t::getHash(),
      morphbus::status_t::getHash(),        morphbus::hello_t::getHash(),
      morphbus::resend_t::getHash(),        morphbus::health_t::getHash(),
      morphbus::info_part_t::getHash(),     morphbus::control_t::getHash(),
      morphbus::log_end_t::getHash(),       morphbus::progress_t::getHash(),
      morphbus::totals_t::getHash(),        morphbus::verdict_t::getHash(),
      morphbus::leave_t::getHash(),         morphbus::admit_t::getHash(),
      morphbus::replay_batch_t::getHash(),  morphbus::replay_follow_t::getHash(),
      morphbus::control_answer_t::getHash()};
  uint64_t hash = 0;
  for (const int64_t part : parts) {
    // FNV-1a over whole words: order matters, and any change shows.
    hash = (hash ^ static_cast<uint64_t>(part)) * 0x100000001b3ULL;
  }
  return hash;
}

namespace internal {

void FinishEncoding(std::vector<uint8_t>* message) {
  StoreBigEndian<uint64_t>(0, message->data() + kAuthOffset);
  PatchCrc(message->data(), message->size());
}

Result<void> CheckEnvelope(const uint8_t* data, size_t size, int64_t fingerprint,
                           const Expectation& expect) {
  // LCM's fingerprint changes with every field's name, type and order.
  if (FingerprintOf(data, size) != fingerprint) {
    return Fail(kOtherType);
  }
  if (Result<void> r = CheckHeaderBytes(data, size); !r) return r;
  // The two hashes are the last fields of the header.
  if (expect.model_hash != 0 && LoadBigEndian<uint64_t>(data + kModelOffset) != expect.model_hash) {
    return Fail("the message speaks of another model");
  }
  if (expect.program_hash != 0 &&
      LoadBigEndian<uint64_t>(data + kProgramOffset) != expect.program_hash) {
    return Fail("the message speaks of another program");
  }
  return {};
}

}  // namespace internal
}  // namespace morphbus::bridge
