// libFuzzer's hooks: three of four mutations know the structure of M3L, the rest are of bytes.

#include <cstdint>
#include <cstring>

#include "test/fuzz/m3l_mutator.h"

extern "C" size_t LLVMFuzzerMutate(uint8_t* data, size_t size, size_t max_size);

namespace {

size_t Store(const std::string& text, uint8_t* out) {
  std::memcpy(out, text.data(), text.size());
  return text.size();
}

std::string_view Text(const uint8_t* data, size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

}  // namespace

extern "C" size_t LLVMFuzzerCustomMutator(uint8_t* data, size_t size, size_t max_size,
                                          unsigned seed) {
  if (seed % 4 == 0) return LLVMFuzzerMutate(data, size, max_size);
  return Store(morphbus::test::MutateM3l(Text(data, size), seed, max_size), data);
}

extern "C" size_t LLVMFuzzerCustomCrossOver(const uint8_t* data1, size_t size1,
                                            const uint8_t* data2, size_t size2, uint8_t* out,
                                            size_t max_out, unsigned seed) {
  return Store(morphbus::test::CrossM3l(Text(data1, size1), Text(data2, size2), seed, max_out),
               out);
}
