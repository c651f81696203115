#include "logger/log/deployed_images.h"

#include <utility>

#include "vm/limits.h"

namespace morphbus::logger {

void DeployedImages::Take(const morphbus::sensors_t& sensors,
                          std::map<uint64_t, std::string>* whole) {
  for (const morphbus::deploy_piece_t& piece : sensors.pieces) {
    // Begun anew with a first piece, as the module does that collects it.
    std::string& image = begun_[piece.hash];
    if (piece.offset == 0) image.clear();
    // A gap makes an image of no use, and no image is larger than this.
    const bool next = static_cast<size_t>(piece.offset) == image.size();
    if (!next || image.size() > vm::kMaxImageBytes) continue;
    image.append(piece.bytes.begin(), piece.bytes.end());
    if (image.size() < static_cast<size_t>(piece.image_size)) continue;
    (*whole)[static_cast<uint64_t>(piece.hash)] = std::move(image);
    begun_.erase(piece.hash);
  }
}

}  // namespace morphbus::logger
