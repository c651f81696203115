#pragma once
// A cursor over the bytes of a message that checks as it goes. The first failure sticks; after it
// every read yields zero, so that callers need not test each step.

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

namespace morphbus::bridge {

class WireReader {
 public:
  WireReader(const uint8_t* data, size_t size) : data_(data), size_(size) {}

  [[nodiscard]] bool ok() const { return failure_ == nullptr; }
  [[nodiscard]] const char* failure() const { return failure_; }
  [[nodiscard]] size_t position() const { return position_; }

  void Refuse(const char* why) {
    if (failure_ == nullptr) failure_ = why;
  }
  /// To be called at the end of the message.
  void ExpectEnd() {
    if (position_ != size_) Refuse("bytes follow the end of the message");
  }

  /// Integers of 1, 2, 4, 8 bytes, refused outside lowest..highest.
  int64_t Int8(int64_t lowest, int64_t highest) { return Integer<int8_t>(lowest, highest); }
  int64_t Int16(int64_t lowest, int64_t highest) { return Integer<int16_t>(lowest, highest); }
  int64_t Int32(int64_t lowest, int64_t highest) { return Integer<int32_t>(lowest, highest); }
  int64_t Int64(int64_t lowest, int64_t highest) { return Integer<int64_t>(lowest, highest); }
  void Bool() { Int8(0, 1); }

  /// Finite numbers.
  void Floats(int64_t count) {
    for (int64_t i = 0; i < count && ok(); ++i) CheckFinite(Real<float, uint32_t>());
  }
  void Doubles(int64_t count) {
    for (int64_t i = 0; i < count && ok(); ++i) CheckFinite(Real<double, uint64_t>());
  }
  /// Four components w x y z of a quaternion of about unit length.
  void FloatQuaternion() { Quaternion<float, uint32_t>(); }
  void DoubleQuaternion() { Quaternion<double, uint64_t>(); }

  void Skip(size_t bytes) {
    if (!ok()) return;
    if (bytes > size_ - position_) return Refuse("the message is cut short");
    position_ += bytes;
  }

  /// Text of at most `longest` bytes: length with NUL, bytes, NUL, no other NUL.
  void Text(size_t longest) {
    const auto length = static_cast<size_t>(Int32(1, static_cast<int64_t>(longest) + 1));
    if (!ok()) return;
    if (length > size_ - position_) return Refuse("a text is cut short");
    if (std::memchr(data_ + position_, 0, length) != data_ + position_ + length - 1) {
      return Refuse("a text does not end with its only NUL");
    }
    position_ += length;
  }

 private:
  template <class T>
  int64_t Integer(int64_t lowest, int64_t highest) {
    using U = std::make_unsigned_t<T>;
    const auto value = static_cast<T>(Bits<U>());
    if (ok() && (value < lowest || value > highest)) Refuse("a number is out of range");
    return ok() ? value : 0;
  }

  template <class U>
  U Bits() {
    if (!ok()) return 0;
    if (sizeof(U) > size_ - position_) {
      Refuse("the message is cut short");
      return 0;
    }
    uint64_t value = 0;
    for (size_t i = 0; i < sizeof(U); ++i) value = value << 8 | data_[position_ + i];
    position_ += sizeof(U);
    return static_cast<U>(value);
  }

  template <class F, class U>
  F Real() {
    const U bits = Bits<U>();
    F value;
    std::memcpy(&value, &bits, sizeof value);
    return value;
  }

  void CheckFinite(double value) {
    if (!std::isfinite(value)) Refuse("a number is not finite");
  }

  template <class F, class U>
  void Quaternion() {
    double norm = 0;
    for (int i = 0; i < 4; ++i) {
      const double c = Real<F, U>();
      norm += c * c;
    }
    if (ok() && !(norm > 0.9 && norm < 1.1)) Refuse("a quaternion is not of unit length");
  }

  const uint8_t* data_;
  size_t size_;
  size_t position_ = 0;
  const char* failure_ = nullptr;
};

}  // namespace morphbus::bridge
