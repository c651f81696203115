// Frames on a line: what was sent comes out, once and in order, whatever else is on the line.

#include "vm/port/frame.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>
#include <string>
#include <vector>

namespace morphbus::vm {
namespace {

using Bytes = std::vector<uint8_t>;

Bytes FrameOf(const Bytes& body) {
  Bytes frame(kMaxFrameBytes);
  std::copy(body.begin(), body.end(), frame.begin() + kFrameHeadBytes);
  frame.resize(static_cast<size_t>(WriteFrame(frame.data(), static_cast<int>(body.size()))));
  return frame;
}

Bytes BodyOf(const std::string& text) { return {text.begin(), text.end()}; }

Bytes Joined(std::initializer_list<Bytes> parts) {
  Bytes all;
  for (const Bytes& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

/// The bodies of the frames that a reader finds in a line.
class Line {
 public:
  std::vector<Bytes> Read(const Bytes& line) {
    std::vector<Bytes> bodies;
    for (const uint8_t byte : line) {
      reader_->Put(byte);
      while (reader_->Next()) {
        bodies.emplace_back(reader_->body(), reader_->body() + reader_->body_size());
      }
    }
    return bodies;
  }

 private:
  /// On the heap, where the sanitizer watches its end.
  std::unique_ptr<FrameReader> reader_ = std::make_unique<FrameReader>();
};

std::vector<Bytes> Read(const Bytes& line) { return Line().Read(line); }

TEST(FrameTest, HasTheBytesOfTheDocument) {
  // docs/porting.md shows this frame.
  EXPECT_EQ(FrameOf({7, 0, 1}),
            (Bytes{0xa5, 0x03, 0x00, 0xfc, 0x07, 0x00, 0x01, 0x15, 0xde, 0x93, 0xb0}));
}

TEST(FrameTest, ComesOutAsItWasSent) {
  Bytes longest(kMaxFrameBodyBytes);
  for (size_t i = 0; i < longest.size(); ++i) longest[i] = static_cast<uint8_t>(i * 37);
  for (const Bytes& body : {Bytes{}, Bytes{0xa5}, BodyOf("body"), longest}) {
    EXPECT_EQ(Read(FrameOf(body)), std::vector<Bytes>{body});
  }
  EXPECT_EQ(FrameOf(longest).size(), static_cast<size_t>(kMaxFrameBytes));
}

TEST(FrameTest, TwoInOneReadAreTwo) {
  const Bytes one = BodyOf("one"), two = BodyOf("two");
  EXPECT_EQ(Read(Joined({FrameOf(one), FrameOf(two)})), (std::vector<Bytes>{one, two}));
}

TEST(FrameTest, GarbageBeforeOneIsPassedOver) {
  const Bytes body = BodyOf("body");
  for (const Bytes& garbage : {Bytes{0}, Bytes(3000, 0xff), Bytes(7, 0xa5),
                               Bytes{0xa5, 3, 0, 0xfc, 1}, Bytes{0xa5, 0xff, 0xff, 0xff}}) {
    EXPECT_EQ(Read(Joined({garbage, FrameOf(body), Bytes(20)})), std::vector<Bytes>{body})
        << garbage.size() << " bytes";
  }
}

TEST(FrameTest, OneThatIsCutCostsOnlyItself) {
  const Bytes cut = FrameOf(BodyOf("one that is cut")), body = BodyOf("the second");
  for (size_t length = 0; length < cut.size(); ++length) {
    const Bytes part(cut.begin(), cut.begin() + static_cast<std::ptrdiff_t>(length));
    // A few bytes behind it settle that the cut one does not go on.
    EXPECT_EQ(Read(Joined({part, FrameOf(body), Bytes(20)})), std::vector<Bytes>{body}) << length;
  }
}

TEST(FrameTest, OneBitIsAlwaysSeen) {
  const Bytes sent = FrameOf(BodyOf("a body of some length")), next = BodyOf("next");
  for (size_t bit = 0; bit < 8 * sent.size(); ++bit) {
    Bytes damaged = sent;
    damaged[bit / 8] = static_cast<uint8_t>(damaged[bit / 8] ^ (1u << (bit % 8)));
    EXPECT_EQ(Read(Joined({damaged, FrameOf(next), Bytes(20)})), std::vector<Bytes>{next}) << bit;
  }
}

TEST(FrameTest, ALongFrameThatNeverWasHidesNoShortOnes) {
  // A head that is whole announces the longest body, and three frames come in its place.
  Bytes head = FrameOf(Bytes(kMaxFrameBodyBytes));
  head.resize(kFrameHeadBytes);
  const Bytes one = BodyOf("one"), two = BodyOf("two"), three = BodyOf("three");
  Line line;
  EXPECT_TRUE(line.Read(Joined({head, FrameOf(one), FrameOf(two)})).empty());
  EXPECT_EQ(line.Read(Joined({Bytes(kMaxFrameBodyBytes), FrameOf(three)})),
            (std::vector<Bytes>{one, two, three}));
}

TEST(FrameTest, AnyLineIsRead) {
  std::mt19937_64 random(5);
  Line line;
  size_t found = 0, sent = 0;
  for (int i = 0; i < 3000; ++i) {
    const auto filling = static_cast<uint8_t>(random());
    Bytes frame = FrameOf(Bytes(random() % 40, filling));
    // Every second one is whole, the others are damaged somewhere.
    if (i % 2 == 0) {
      ++sent;
    } else {
      frame[random() % frame.size()] ^= static_cast<uint8_t>(1 + random() % 255);
    }
    found += line.Read(frame).size();
  }
  found += line.Read(Bytes(kMaxFrameBytes)).size();
  EXPECT_EQ(found, sent);
}

}  // namespace
}  // namespace morphbus::vm
