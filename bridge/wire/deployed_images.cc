#include "bridge/wire/deployed_images.h"

#include <algorithm>

#include "vm/image/image.h"
#include "vm/limits.h"
#include "vm/spread/package.h"

namespace morphbus::bridge {
namespace {

/// Packages that are put together at one time, and images that are kept: more than any run has.
constexpr size_t kMostBegun = 16;
constexpr size_t kMostImages = 1024;

}  // namespace

void DeployedImages::Take(const morphbus::sensors_t& sensors,
                          std::map<uint64_t, std::string>* whole) {
  for (const morphbus::deploy_piece_t& piece : sensors.pieces) {
    // Begun anew with a first piece, which the log has as often as the module was given it.
    // Whoever invents packages gets no more room than this; the oldest ids make way.
    if (begun_.size() >= kMostBegun && !begun_.contains(piece.hash)) begun_.erase(begun_.begin());
    std::string& package = begun_[piece.hash];
    if (piece.offset == 0) package.clear();
    // A gap makes a package of no use, and none is larger than this.
    const bool next = static_cast<size_t>(piece.offset) == package.size();
    if (!next || package.size() > vm::kMaxPackageBytes) continue;
    package.append(piece.bytes.begin(), piece.bytes.end());
    if (package.size() < static_cast<size_t>(piece.image_size)) continue;
    // Its image is called by the hash that modules name in their headers.
    vm::Package parts;
    const auto* bytes = reinterpret_cast<const uint8_t*>(package.data());
    if (whole->size() < kMostImages &&
        vm::ReadPackage(bytes, static_cast<uint32_t>(package.size()), &parts) &&
        parts.image_size >= vm::image::kHeaderBytes) {
      // What lies behind the part that modules run, for people, is not in that hash.
      const uint32_t runs = vm::image::ReadU32(parts.image + vm::image::kSizeAt);
      const uint64_t hash = vm::image::HashOf(parts.image, std::min(runs, parts.image_size));
      (*whole)[hash] = package.substr(vm::kPackageHeadBytes);
    }
    begun_.erase(piece.hash);
  }
}

}  // namespace morphbus::bridge
