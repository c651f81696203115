#pragma once
// A module's packages in the memory of a host.

#include <cstdint>
#include <vector>

#include "vm/limits.h"
#include "vm/spread/package_store.h"

namespace morphbus::bridge {

/// Has room for any package, and uses as much memory as those that have come.
class PackageMemory final : public vm::PackageStore {
 public:
  [[nodiscard]] uint32_t capacity() const override { return vm::kMaxPackageBytes; }
  bool Write(int place, uint32_t offset, const uint8_t* bytes, uint32_t size) override {
    std::vector<uint8_t>& package = places_[place];
    package.resize(offset);
    package.insert(package.end(), bytes, bytes + size);
    return true;
  }
  [[nodiscard]] const uint8_t* Read(int place) const override { return places_[place].data(); }

  /// Empties both places.
  void Clear() {
    for (std::vector<uint8_t>& package : places_) package.clear();
  }

 private:
  std::vector<uint8_t> places_[2];
};

}  // namespace morphbus::bridge
