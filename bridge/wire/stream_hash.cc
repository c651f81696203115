#include "bridge/wire/stream_hash.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <algorithm>
#include <array>

#include "bridge/wire/codec.h"
#include "compiler/base/big_endian.h"

namespace morphbus::bridge {
namespace {

/// The hash in the library's canonical form: the high half first.
std::string TextOf(const XXH128_hash_t& hash) { return HexText(hash.high64) + HexText(hash.low64); }

}  // namespace

uint64_t DigestOf(const uint8_t* data, size_t size) { return XXH3_64bits(data, size); }

uint64_t MessageDigest(const uint8_t* data, size_t size) {
  if (size < kContentOffset) return DigestOf(data, size);
  const auto fingerprint = static_cast<uint64_t>(FingerprintOf(data, size));
  return XXH3_64bits_withSeed(data + kContentOffset, size - kContentOffset, fingerprint);
}

void StreamHash::Add(uint64_t digest) {
  std::array<uint8_t, 16> link;
  StoreBigEndian(value_, link.data());
  StoreBigEndian(digest, link.data() + 8);
  value_ = DigestOf(link.data(), link.size());
}

std::string HexText(uint64_t hash) {
  std::string text;
  for (int shift = 60; shift >= 0; shift -= 4) text += "0123456789abcdef"[hash >> shift & 15];
  return text;
}

std::string BytesHash(std::string_view bytes) {
  return TextOf(XXH3_128bits(bytes.data(), bytes.size()));
}

std::string RunHash(std::vector<ChannelTotal> totals) {
  std::ranges::sort(totals, {}, &ChannelTotal::channel);
  XXH3_state_t state;
  // Whoever calls may list the channels in any order, but the hash depends on it: hence the sort.
  XXH3_128bits_reset(&state);
  for (const ChannelTotal& total : totals) {
    if (!total.hashed) continue;
    // The run's own name is left out, so that equal runs have equal hashes.
    const size_t slash = total.channel.find('/');
    const std::string name = total.channel.substr(slash == std::string::npos ? 0 : slash + 1);
    // The name goes in with its NUL, so that no name runs on into the numbers behind it.
    XXH3_128bits_update(&state, name.c_str(), name.size() + 1);
    // Count and hash in network order, so that machines agree.
    std::array<uint8_t, 16> numbers;
    StoreBigEndian(static_cast<uint64_t>(total.count), numbers.data());
    StoreBigEndian(static_cast<uint64_t>(total.chained_hash), numbers.data() + 8);
    XXH3_128bits_update(&state, numbers.data(), numbers.size());
  }
  return TextOf(XXH3_128bits_digest(&state));
}

}  // namespace morphbus::bridge
