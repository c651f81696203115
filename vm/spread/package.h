#pragma once
// A program as it spreads: its image behind a head that names the tick of the root's clock at which
// all modules that have it go over to it. So the time travels with the bytes, in the same messages.
//
//   head     magic u32, number u32, switch tick i64 (little-endian)
//   image    as in vm/image/image.h

#include <cstdint>

#include "vm/limits.h"

namespace morphbus::vm {

/// What a package says of its image. All 0 for the program that a module starts with.
struct PackageHead {
  /// The program is run from this tick of the root's clock on; 0: from when it is there.
  int64_t switch_tick = 0;
  /// The run that deploys counts its packages from 2 up: of two that are given to modules which
  /// have not heard of each other the later one is newer. 0: it is newer than what its module has
  /// heard of.
  uint32_t number = 0;
};

/// A package that has been read; the image points into its bytes.
struct Package : PackageHead {
  const uint8_t* image = nullptr;
  uint32_t image_size = 0;
};

/// The name of a package among modules: FNV-1a of its image's hash and its head, or the hash itself
/// where the head is empty. So one program deployed twice is two packages.
uint64_t PackageId(uint64_t image_hash, const PackageHead& head);

/// Writes the head, kPackageHeadBytes at `out`; the image follows it.
void WritePackageHead(const PackageHead& head, uint8_t* out);

/// Reads a package; false if the head is none, the tick is negative or no image follows. Nothing is
/// said of the image: the verifier judges it.
bool ReadPackage(const uint8_t* bytes, uint32_t size, Package* out);

}  // namespace morphbus::vm
