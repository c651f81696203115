#pragma once
// Where a module keeps the packages of programs that come to it (vm/spread/package.h): memory on a
// host, pages of flash on a microcontroller.

#include <cstdint>

namespace morphbus::vm {

/// Two places of the same size. In the one lies the package that runs, once a first one has come,
/// while the next one is written to the other. Packages are read where they lie.
class PackageStore {
 public:
  /// Bytes that each place has room for; from 0, where no package can be kept.
  [[nodiscard]] virtual uint32_t capacity() const = 0;
  /// Writes a part of a package to a place, 0 or 1, within its capacity. Parts come in order: one
  /// at offset 0, for which the place is emptied, then each where the last one ended. False if the
  /// memory does not hold it; the package is then given up.
  virtual bool Write(int place, uint32_t offset, const uint8_t* bytes, uint32_t size) = 0;
  /// The package in a place is whole: whatever is kept back for a full page is written.
  virtual bool Finish(int /*place*/) { return true; }
  /// The first byte of a place; what was written there follows, once it is finished.
  [[nodiscard]] virtual const uint8_t* Read(int place) const = 0;

 protected:
  ~PackageStore() = default;
};

/// Of a module that can keep no later program.
class NoPackages final : public PackageStore {
 public:
  [[nodiscard]] uint32_t capacity() const override { return 0; }
  bool Write(int /*place*/, uint32_t /*offset*/, const uint8_t* /*bytes*/,
             uint32_t /*size*/) override {
    return false;
  }
  [[nodiscard]] const uint8_t* Read(int /*place*/) const override { return nullptr; }
};

}  // namespace morphbus::vm
