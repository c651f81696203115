#include "vm/spread/package.h"

#include "vm/image/image.h"
#include "vm/run/context.h"

namespace morphbus::vm {

namespace {

/// The first bytes of every package: "DYNP".
constexpr uint32_t kMagic = 0x504e5944u;

/// Little-endian, lowest byte first.
void WriteNumber(uint64_t value, int bytes, uint8_t* out) {
  for (int i = 0; i < bytes; ++i) out[i] = static_cast<uint8_t>(value >> (8 * i));
}

}  // namespace

uint64_t PackageId(uint64_t image_hash, const PackageHead& head) {
  if (head.switch_tick == 0 && head.number == 0) return image_hash;
  Digest digest;
  // The head is part of the name: an image that is deployed for another tick, or once more, is
  // another package.
  digest.Add(image_hash, head.switch_tick, head.number);
  return digest.value();
}

void WritePackageHead(const PackageHead& head, uint8_t* out) {
  // Magic word, number and tick: 16 bytes, kPackageHeadBytes.
  WriteNumber(kMagic, 4, out);
  WriteNumber(head.number, 4, out + 4);
  WriteNumber(static_cast<uint64_t>(head.switch_tick), 8, out + 8);
}

bool ReadPackage(const uint8_t* bytes, uint32_t size, Package* out) {
  // The bytes come from other modules, piece by piece; a head without an image is none.
  if (size <= kPackageHeadBytes || size > kMaxPackageBytes) return false;
  if (image::ReadU32(bytes) != kMagic) return false;
  out->number = image::ReadU32(bytes + 4);
  out->switch_tick = static_cast<int64_t>(image::ReadU64(bytes + 8));
  out->image = bytes + kPackageHeadBytes;
  out->image_size = size - kPackageHeadBytes;
  return out->switch_tick >= 0;
}

}  // namespace morphbus::vm
