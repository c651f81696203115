// Bytes from a serial line: the reader finds the frames that a search from the line's beginning
// finds, whatever lies between them. As no fuzzer guesses a CRC, the input says what the line is
// made of: noise, frames, frames that are cut or damaged.

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <vector>

#include "vm/port/frame.h"

namespace {

using Bytes = std::vector<uint8_t>;

Bytes FrameOf(const uint8_t* body, size_t size) {
  Bytes frame(morphbus::vm::kMaxFrameBytes);
  std::copy_n(body, size, frame.begin() + morphbus::vm::kFrameHeadBytes);
  frame.resize(static_cast<size_t>(morphbus::vm::WriteFrame(frame.data(), static_cast<int>(size))));
  return frame;
}

/// A byte says what comes next and of how many of the bytes behind it.
Bytes LineOf(const uint8_t* data, size_t size) {
  Bytes line;
  for (size_t at = 0; at < size;) {
    const uint8_t what = data[at] >> 6;
    const size_t count = std::min<size_t>(data[at] & 0x3f, size - at - 1);
    const uint8_t* bytes = data + at + 1;
    at += 1 + count;
    Bytes part = what == 0 ? Bytes(bytes, bytes + count) : FrameOf(bytes, count);
    if (what == 2) part.resize(part.size() - 1 - count / 2);
    if (what == 3) part[count % part.size()] ^= static_cast<uint8_t>(1 + count);
    line.insert(line.end(), part.begin(), part.end());
  }
  return line;
}

/// The bodies of the frames of a line, by looking at each place.
std::vector<Bytes> Search(const Bytes& line) {
  using namespace morphbus::vm;
  const uint8_t start = FrameOf(nullptr, 0)[0];
  std::vector<Bytes> bodies;
  for (size_t at = 0; at < line.size();) {
    const size_t left = line.size() - at;
    const uint8_t* here = line.data() + at;
    const size_t size = left < 3 ? 0 : here[1] | static_cast<size_t>(here[2]) << 8;
    if (here[0] != start || size > kMaxFrameBodyBytes) {
      ++at;
      continue;
    }
    // The head of a frame of this length is what WriteFrame makes of it, its check included.
    const Bytes head = FrameOf(Bytes(size).data(), size);
    const size_t known = left < 3 ? 1 : std::min<size_t>(left, kFrameHeadBytes);
    if (!std::equal(here, here + known, head.begin())) {
      ++at;
      continue;
    }
    // One that is not whole yet may become one.
    if (left < head.size()) return bodies;
    const Bytes frame = FrameOf(here + kFrameHeadBytes, size);
    if (std::equal(frame.begin(), frame.end(), here)) {
      bodies.emplace_back(here + kFrameHeadBytes, here + kFrameHeadBytes + size);
      at += frame.size();
    } else {
      ++at;
    }
  }
  return bodies;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size > 4096) return 0;
  const Bytes line = LineOf(data, size);
  std::vector<Bytes> found;
  const auto reader = std::make_unique<morphbus::vm::FrameReader>();
  for (const uint8_t byte : line) {
    reader->Put(byte);
    while (reader->Next()) {
      found.emplace_back(reader->body(), reader->body() + reader->body_size());
    }
  }
  if (found != Search(line)) std::abort();
  return 0;
}
