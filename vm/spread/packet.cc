#include "vm/spread/packet.h"

#include <cstring>
#include <type_traits>

namespace morphbus::vm {

namespace {

/// Puts numbers behind each other. There is room for the largest message (kMaxPacketBytes).
class PacketWriter {
 public:
  explicit PacketWriter(uint8_t* out) : begin_(out), at_(out) {}

  template <class Number>
  void Value(const Number& number) {
    // Bits of a number of any type, lowest byte first whatever the machine.
    uint64_t bits = 0;
    // Floats have four bytes, and so have the integers that take this way: their bits are taken as
    // they are, where a conversion would round a float to a whole number.
    if constexpr (sizeof(Number) == 4) {
      uint32_t narrow;
      std::memcpy(&narrow, &number, 4);
      bits = narrow;
    } else {
      bits = static_cast<uint64_t>(number);
    }
    for (unsigned i = 0; i < sizeof(Number); ++i) *at_++ = static_cast<uint8_t>(bits >> (8 * i));
  }
  void Bytes(const uint8_t* bytes, int count) {
    std::memcpy(at_, bytes, static_cast<size_t>(count));
    at_ += count;
  }
  /// A writer's counts are those of a message of this profile.
  static bool Fits(int /*count*/, int /*capacity*/) { return true; }
  [[nodiscard]] int size() const { return static_cast<int>(at_ - begin_); }

 private:
  uint8_t* begin_;
  uint8_t* at_;
};

/// Takes numbers off again. Behind the end everything is 0, and ok() says so.
class PacketReader {
 public:
  PacketReader(const uint8_t* bytes, int size) : at_(bytes), left_(size) {}

  template <class Number>
  void Value(Number& number) {
    constexpr int kSize = sizeof(Number);
    uint64_t bits = 0;
    if (!Take(kSize)) {
      number = Number{};
      return;
    }
    // Take() has moved at_ behind the number.
    for (int i = 0; i < kSize; ++i) bits |= static_cast<uint64_t>(at_[i - kSize]) << (8 * i);
    if constexpr (kSize == 4) {
      const auto narrow = static_cast<uint32_t>(bits);
      std::memcpy(&number, &narrow, 4);
    } else {
      number = static_cast<Number>(bits);
    }
  }
  void Bytes(uint8_t* bytes, int count) {
    if (Take(count)) std::memcpy(bytes, at_ - count, static_cast<size_t>(count));
  }
  /// Every count is asked for here before anything is written by it: a packet comes from a
  /// neighbour that may be broken, and a row longer than its array would be written over what
  /// follows.
  bool Fits(int count, int capacity) {
    ok_ = ok_ && count <= capacity;
    return ok_;
  }
  [[nodiscard]] bool ok() const { return ok_; }
  /// Everything was taken, and no more.
  [[nodiscard]] bool at_end() const { return ok_ && left_ == 0; }

 private:
  bool Take(int count) {
    // Once something was lacking nothing is taken any more, so that the rest of a packet is not
    // read at the wrong places.
    ok_ = ok_ && count <= left_;
    if (!ok_) return false;
    at_ += count;
    left_ -= count;
    return true;
  }
  const uint8_t* at_;
  int left_;
  bool ok_ = true;
};

// The layout, once for both directions: `Message` is const where it is written.

template <class Stream, class... Numbers>
void Values(Stream& s, Numbers&... numbers) {
  (s.Value(numbers), ...);
}

template <class Stream, class Message>
void Poses(Stream& s, Message& m) {
  // Two flags, and nothing more without a pose.
  uint8_t flags = static_cast<uint8_t>((m.has_pose ? 1 : 0) | (m.pose_stale ? 2 : 0));
  s.Value(flags);
  if constexpr (!std::is_const_v<Message>) {
    m.has_pose = (flags & 1) != 0;
    m.pose_stale = (flags & 2) != 0;
    // Other bits mean nothing yet; a count that never fits refuses the packet.
    if (flags > 3) s.Fits(1, 0);
  }
  if (!m.has_pose) return;
  // Whose pose it is, its age in hops, and then the poses of all links: position in m and
  // quaternion w x y z, in the robot frame.
  Values(s, m.root, m.root_incarnation, m.root_sequence, m.hops, m.num_links);
  if (!s.Fits(m.num_links, kMaxLinks)) return;
  for (int i = 0; i < m.num_links; ++i) {
    auto& X = m.X_RL[i];
    Values(s, X.p.x, X.p.y, X.p.z, X.q.w, X.q.x, X.q.y, X.q.z);
  }
}

template <class Stream, class Message>
void Bodies(Stream& s, Message& m) {
  s.Value(m.num_docked);
  if (!s.Fits(m.num_docked, kMaxNeighbours)) return;
  for (int i = 0; i < m.num_docked; ++i) {
    auto& docked = m.docked[i];
    // What the sender is docked with, by which the neighbour there knows which link is meant; then
    // what of its bodies this message tells, in turns (BodyEntry).
    Values(s, docked.connector, docked.link, docked.body_link, docked.mate_module);
  }
  Values(s, m.body_turns, m.num_body_entries);
  if (!s.Fits(m.num_body_entries, kMaxMessageBodyEntries)) return;
  for (int i = 0; i < m.num_body_entries; ++i) {
    auto& entry = m.body_entries[i];
    Values(s, entry.link, entry.joint, entry.module, entry.stamp);
  }
}

template <class Stream, class Message>
void Diffusion(Stream& s, Message& m) {
  s.Value(m.num_invocations);
  if (!s.Fits(m.num_invocations, kMaxMessageInvocations)) return;
  for (int i = 0; i < m.num_invocations; ++i) {
    auto& call = m.invocations[i];
    // Of each invocation who issued it and its number there, which program it is of, for whom it
    // is, and its arguments.
    Values(s, call.origin, call.origin_incarnation, call.id, call.program_hash, call.target,
           call.role, call.command, call.num_arguments);
    if (!s.Fits(call.num_arguments, kMaxArguments)) return;
    for (int k = 0; k < call.num_arguments; ++k) s.Value(call.arguments[k].bits);
  }
  s.Value(m.num_acks);
  if (!s.Fits(m.num_acks, kMaxMessageAcks)) return;
  for (int i = 0; i < m.num_acks; ++i) {
    auto& ack = m.acks[i];
    Values(s, ack.origin, ack.origin_incarnation, ack.id, ack.floor);
  }
}

template <class Stream, class Message>
void Program(Stream& s, Message& m) {
  auto& news = m.news;
  // What the sender runs or holds, and what it wants next; then, if it hands one on, a piece of a
  // package.
  Values(s, news.version, news.hash, news.want_version, news.want_hash, news.want_offset,
         news.piece_bytes);
  auto& piece = m.fragment;
  // A size of 0 stands for no piece, and nothing of it follows.
  s.Value(piece.size);
  if (piece.size == 0 || !s.Fits(piece.size, kFragmentBytes)) return;
  Values(s, piece.version, piece.hash, piece.image_size, piece.offset);
  s.Bytes(piece.bytes, piece.size);
}

template <class Stream, class Message>
void Layout(Stream& s, Message& m) {
  // Who speaks and when, and the role with its shared fields; everything else in groups of its own.
  // A change here is another kPacketVersion.
  Values(s, m.sender, m.incarnation, m.tick, m.program_hash, m.role, m.num_shared);
  if (!s.Fits(m.num_shared, kMaxSharedFields)) return;
  for (int i = 0; i < m.num_shared; ++i) s.Value(m.shared[i].bits);
  Poses(s, m);
  Bodies(s, m);
  Diffusion(s, m);
  Program(s, m);
}

}  // namespace

int WritePacket(const NeighbourMessage& message, uint8_t* out) {
  PacketWriter writer(out);
  writer.Value(kPacketVersion);
  Layout(writer, message);
  return writer.size();
}

bool ReadPacket(const uint8_t* bytes, int size, NeighbourMessage* message) {
  PacketReader reader(bytes, size);
  uint8_t version = 0;
  reader.Value(version);
  if (version != kPacketVersion) return false;
  // What the packet leaves out, such as poses, is as in a fresh message, and not as in the last
  // one.
  *message = NeighbourMessage();
  Layout(reader, *message);
  return reader.at_end();
}

}  // namespace morphbus::vm
