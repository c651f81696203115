#pragma once
// A cursor over the bytes of a message that checks as it goes: the visitor of
// bridge/wire/message_layout.h that decides what a receiver may believe. The first failure sticks,
// with the path of its field and its place; after it every read yields zero, so that callers need
// not test each step.
//
// Bytes may be made up in bad faith, so three things hold whatever they are: nothing beyond the
// message's end is read, no length is believed before it is known to be possible, and the work done
// is bounded by the message's size and by the layout's counts.

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>

#include "bridge/wire/message_layout.h"
#include "compiler/base/big_endian.h"

namespace morphbus::bridge {

/// Reads a message once, from its first byte to its last. Nothing is allocated unless a check
/// fails.
class WireReader {
 public:
  /// `type` is the message's name, the first word of every failure; `data` outlives the reader.
  WireReader(const char* type, const uint8_t* data, size_t size)
      : type_(type), data_(data), size_(size) {}

  /// Whether no check has failed so far.
  [[nodiscard]] bool ok() const { return failure_.empty(); }
  /// For instance "transform_t.link_poses[3].position_m[1] is not finite (byte 213)"; empty while
  /// all is well.
  [[nodiscard]] const std::string& failure() const { return failure_; }

  /// Passes over the fingerprint, which codec.h checks.
  void SkipFingerprint() { Skip("", 8); }
  /// To be called at the end of the message.
  void ExpectEnd() {
    if (position_ != size_) Fail("", -1, "is followed by further bytes");
  }

  // The visitor's part, as bridge/wire/message_layout.h asks for it. `name` is the field's name for
  // failures. After a failure these read nothing, and what they return is 0.
  /// A whole number in network order, refused outside lowest..highest (both allowed), which lies
  /// within T's range. T says how many bytes it has, and that they are signed in two's complement.
  /// The failure names the number's first byte.
  /// @param index  its place, if it is one of an array; else -1.
  template <class T>
  int64_t Int(const char* name, int64_t lowest, int64_t highest, int64_t index = -1) {
    const auto value = static_cast<T>(Bits<std::make_unsigned_t<T>>(name, index));
    if (ok() && (value < lowest || value > highest)) {
      position_ -= sizeof(T);
      Fail(name, index, "is out of range");
    }
    return ok() ? value : 0;
  }
  /// The length of an array that follows, not below 0; its highest value bounds all further work.
  template <class T>
  int64_t Count(const char* name, int64_t lowest, int64_t highest) {
    return Int<T>(name, lowest, highest);
  }
  /// A flag is 0 or 1 and nothing else, so that what is accepted means exactly its bytes.
  void Bool(const char* name) { Int<int8_t>(name, 0, 1); }
  /// `count` numbers in IEEE 754; infinite ones and those that are not numbers are refused.
  void Floats(const char* name, int64_t count) { Reals<float, uint32_t>(name, count); }
  void Doubles(const char* name, int64_t count) { Reals<double, uint64_t>(name, count); }
  /// Four numbers, w x y z. A quaternion far from unit length is no rotation: its squared length
  /// must lie between 0.9 and 1.1.
  void FloatQuaternion(const char* name) { Quaternion<float, uint32_t>(name); }
  void DoubleQuaternion(const char* name) { Quaternion<double, uint64_t>(name); }
  /// Bytes without a meaning of their own. `count` comes from a length that was read before, and so
  /// is no larger than the layout allows; that as many bytes are there is checked here.
  void Bytes(const char* name, int64_t count) { Skip(name, static_cast<size_t>(count)); }

  /// A string as LCM writes it: its length with the NUL (4 bytes), its bytes, and a NUL, with no
  /// other NUL inside. It has at most `longest` bytes without the NUL.
  /// @param index  its place, if it is one of an array of strings; else -1.
  void Text(const char* name, size_t longest, int64_t index = -1) {
    // The length itself must be possible before any byte of the text is looked at.
    const auto length =
        static_cast<size_t>(Int<int32_t>(name, 1, static_cast<int64_t>(longest) + 1, index));
    if (!ok()) return;
    // position_ never exceeds size_, so the difference is no less than 0.
    if (length > size_ - position_) return Fail(name, index, "is cut short");
    if (std::memchr(data_ + position_, 0, length) != data_ + position_ + length - 1) {
      return Fail(name, index, "does not end with its only NUL");
    }
    position_ += length;
  }
  /// `count` strings, one after another. Every string takes five bytes at least, so that the
  /// message's end stops the loop however large the count is.
  void Texts(const char* name, int64_t count, size_t longest) {
    for (int64_t i = 0; i < count && ok(); ++i) Text(name, longest, i);
  }

  /// Goes into another struct, whose layout is that of M; its fields are named behind this one's.
  template <class M>
  void Struct(const char* name, int64_t index = -1) {
    if (!ok()) return;
    // The layout of the inner struct is walked over by this same reader, which is thus recursive.
    path_[depth_++] = {name, index};
    Walk(*this, layout::As<M>());
    if (ok()) --depth_;  // A failure has used the path already.
  }
  /// The same for each element of an array, whose place in the array a failure names.
  template <class M>
  void Structs(const char* name, int64_t count) {
    for (int64_t i = 0; i < count && ok(); ++i) Struct<M>(name, i);
  }

  /// A failure that two fields together make, neither of which is wrong alone; `why` follows the
  /// field's name in the sentence.
  void Refuse(const char* name, const char* why) { Fail(name, -1, why); }

 private:
  /// A struct on the way to the present field; `index` is its place in an array, -1 if it is in
  /// none.
  struct Step {
    const char* name = nullptr;
    int64_t index = -1;
  };

  /// ".name" or ".name[index]".
  static std::string Named(const Step& step) {
    std::string text = std::string(".") + step.name;
    return step.index < 0 ? text : text + "[" + std::to_string(step.index) + "]";
  }

  /// Notes the first failure, with the path that leads to the field.
  void Fail(const char* name, int64_t index, const char* why) {
    if (!ok()) return;
    // The sentence is put together only now, so that good messages cost no memory.
    failure_ = type_;
    // The path from the message's name down to the field.
    for (int i = 0; i < depth_; ++i) failure_ += Named(path_[i]);
    if (*name != '\0') failure_ += Named({name, index});
    failure_ += std::string(" ") + why + " (byte " + std::to_string(position_) + ")";
  }

  // What follows moves the place of the next byte, and is the only code that does. Each checks
  // first that the bytes are there; the difference of size and place cannot be below 0, as the
  // place never goes beyond the end.
  /// Passes over bytes that any value is allowed for, if they are there.
  void Skip(const char* name, size_t bytes) {
    if (!ok()) return;
    if (bytes > size_ - position_) return Fail(name, -1, "is cut short");
    position_ += bytes;
  }

  /// The next bytes in network order as one unsigned number; 0 if they are not there or a check has
  /// failed before.
  template <class U>
  U Bits(const char* name, int64_t index) {
    if (!ok()) return 0;
    if (sizeof(U) > size_ - position_) {
      Fail(name, index, "is cut short");
      return 0;
    }
    const U value = LoadBigEndian<U>(data_ + position_);
    position_ += sizeof(U);
    return value;
  }

  /// One number in IEEE 754, of any value: whoever asks for it checks that it is finite. F is float
  /// or double, and U the unsigned type of the same size.
  template <class F, class U>
  F Real(const char* name, int64_t index) {
    // The bits of a float or double travel as those of an integer of the same size.
    const U bits = Bits<U>(name, index);
    F value;
    std::memcpy(&value, &bits, sizeof value);
    return value;
  }

  /// `count` finite numbers of type F, whose bits are U's. A field that is one number is called by
  /// its name alone, without an index.
  template <class F, class U>
  void Reals(const char* name, int64_t count) {
    for (int64_t i = 0; i < count && ok(); ++i) {
      const int64_t index = count > 1 ? i : -1;
      if (std::isfinite(Real<F, U>(name, index)) || !ok()) continue;
      position_ -= sizeof(F);
      Fail(name, index, "is not a finite number");
    }
  }

  /// Four numbers whose squares add up to about 1. Rounding of single precision stays far within
  /// the bounds; whoever computes with a rotation may scale it to unit length.
  template <class F, class U>
  void Quaternion(const char* name) {
    double norm = 0;
    for (int64_t i = 0; i < 4; ++i) {
      const double component = Real<F, U>(name, i);
      norm += component * component;
    }
    // Written so that a component that is not a number is refused too: no comparison with it holds.
    if (ok() && !(norm > 0.9 && norm < 1.1)) {
      position_ -= 4 * sizeof(F);
      Fail(name, -1, "is not of unit length");
    }
  }

  // The message's name and bytes, neither of them owned, and the place of the next byte to read.
  const char* type_;
  const uint8_t* data_;
  size_t size_;
  size_t position_ = 0;
  std::array<Step, 4> path_;  ///< The deepest is sensors_t.modules[i].docked[j].
  /// Entries of path_ that lead to the present field.
  int depth_ = 0;
  /// The first failure, as a sentence; empty while all is well.
  std::string failure_;
};

}  // namespace morphbus::bridge
