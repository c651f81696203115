#include "vm/spread/program_relay.h"

#include <cstring>

namespace morphbus::vm {

namespace {

constexpr uint32_t kPiecesAhead = 3;
/// Versions travel as 32 bits with a sign.
constexpr uint32_t kHighestVersion = 0x7fffffffu;
/// RelayState::place of the program that the module was started with.
constexpr uint8_t kFirst = 2;

/// The highest version counts; the id decides between programs that were deployed at once.
bool IsNewer(uint32_t version, uint64_t id, const PackageName& than) {
  return version > than.version || (version == than.version && id > than.id);
}

bool IsCalled(uint32_t version, uint64_t id, const PackageName& name) {
  return version == name.version && id == name.id;
}

}  // namespace

int64_t SpreadTicks(uint32_t package_size, int hops) {
  // News takes a tick, the wish for it another one; then a piece comes every tick.
  constexpr int64_t kBeforeFirstPiece = 2;
  return hops * (kBeforeFirstPiece + (package_size + kFragmentBytes - 1) / kFragmentBytes);
}

void ProgramRelay::Start(uint64_t hash, uint32_t version) {
  // As a package without a tick, so that a neighbour without this program can have it.
  state_.running = {.version = version, .size = kPackageHeadBytes + first_size_, .id = hash};
  state_.newest_heard = version;
}

void ProgramRelay::Deploy(const uint8_t* package, uint32_t size, uint64_t id, uint32_t number) {
  // Above every version heard of, so that it replaces them all; at the end of numbers ids decide.
  if (state_.newest_heard < kHighestVersion) ++state_.newest_heard;
  if (number > state_.newest_heard && number <= kHighestVersion) state_.newest_heard = number;
  Begin({.version = state_.newest_heard, .size = size, .id = id});
  state_.have = size;
  const int place = incoming_place();
  state_.whole = store_.Write(place, 0, package, size) && store_.Finish(place) ? 1 : 0;
  if (state_.whole == 0) Refuse();
}

bool ProgramRelay::AsStarted() const {
  const RelayState& s = state_;
  const bool nothing_came = s.incoming.version == 0 && s.refused.version == 0 &&
                            s.newest_heard == s.running.version && s.offered_tick == 0;
  const bool nothing_went = s.wanted == 0 && s.want_offset == 0 && s.serve_offset == 0;
  return nothing_came && nothing_went && s.place == kFirst && s.cut == kFragmentBytes;
}

bool ProgramRelay::Sound() const {
  const RelayState& s = state_;
  const uint32_t running = s.running.size;
  // A first program is larger than a place may be, and has no bytes in one.
  const bool first = s.place == kFirst && running == kPackageHeadBytes + first_size_;
  const bool placed =
      s.place < kFirst && running > kPackageHeadBytes && running <= store_.capacity();
  const bool incoming = s.incoming.size <= store_.capacity() && s.have <= s.incoming.size &&
                        (s.whole == 0 || (s.have == s.incoming.size && s.have > 0)) &&
                        s.verified <= s.whole;
  return (first || placed) && incoming && s.cut > 0 && s.cut <= kFragmentBytes;
}

uint32_t ProgramRelay::BytesIn(int place) const {
  if (place == state_.place) return state_.running.size;
  return place == incoming_place() ? state_.have : 0;
}

const uint8_t* ProgramRelay::running_image() const {
  return state_.place == kFirst ? first_image_ : store_.Read(state_.place) + kPackageHeadBytes;
}

void ProgramRelay::Begin(const PackageName& name) {
  // What was kept until now is older, and its bytes go.
  state_.incoming = name;
  state_.have = 0;
  state_.whole = state_.verified = 0;
}

// A neighbour has something newer than what we run, collect, hold or have refused: it is collected.
void ProgramRelay::OnNews(const ProgramNews& news, int64_t tick) {
  for (int i = 0; i < 2; ++i) {
    // What a neighbour has and what it asks for: both are versions that exist somewhere.
    const uint32_t version = i == 0 ? news.version : news.want_version;
    if (version > state_.newest_heard && version <= kHighestVersion) state_.newest_heard = version;
  }
  // The smallest that any neighbour can take: what a module says, all of them hear.
  if (news.piece_bytes > 0 && news.piece_bytes < kFragmentBytes && news.piece_bytes <= state_.cut) {
    state_.cut = news.piece_bytes;
    state_.small_tick = tick;
  }
  if (IsCalled(news.version, news.hash, state_.incoming)) state_.offered_tick = tick;
  if (!IsNewer(news.version, news.hash, state_.running) ||
      !IsNewer(news.version, news.hash, state_.refused) ||
      !IsNewer(news.version, news.hash, state_.incoming) || store_.capacity() == 0) {
    return;
  }
  // What was collected before is older than this, and is given up for it.
  Begin({.version = news.version, .size = 0, .id = news.hash});
  state_.offered_tick = tick;
}

// Pieces come in any order, and again; of each counts what goes on from where the package is.
void ProgramRelay::TakePiece(const ProgramFragment& piece) {
  PackageName& incoming = state_.incoming;
  if (piece.size == 0 || state_.whole != 0 || incoming.version == 0 ||
      !IsCalled(piece.version, piece.hash, incoming)) {
    return;
  }
  // A piece that does not lie in its package, or in one of another size, is damaged or a lie.
  if (piece.image_size > kMostPackageBytes || piece.offset >= piece.image_size ||
      piece.size > piece.image_size - piece.offset ||
      (incoming.size != 0 && incoming.size != piece.image_size)) {
    return;
  }
  // The first piece tells how many bytes there are.
  if (piece.image_size > store_.capacity()) return Refuse();
  incoming.size = piece.image_size;
  const uint32_t end = piece.offset + piece.size;
  // A piece that leaves a gap is of no use yet, and one that brings nothing new none any more.
  if (piece.offset > state_.have || end <= state_.have) return;
  const int place = incoming_place();
  const bool kept = store_.Write(place, state_.have, piece.bytes + (state_.have - piece.offset),
                                 end - state_.have);
  state_.have = end;
  const bool whole = end == incoming.size;
  if (!kept || (whole && !store_.Finish(place))) return Refuse();
  state_.whole = whole ? 1 : 0;
}

// Several neighbours may be at different places: the one furthest behind is served first, so that
// all catch up with each other and the same pieces serve them all.
void ProgramRelay::OnWish(const ProgramNews& news) {
  if (!IsCalled(news.want_version, news.want_hash, Newest()) || news.want_offset >= Newest().size) {
    return;
  }
  if (state_.wanted == 0 || news.want_offset < state_.want_offset) {
    state_.want_offset = news.want_offset;
  }
  state_.wanted = 1;
}

void ProgramRelay::Receive(const TickInput& input) {
  state_.wanted = 0;
  for (const NeighbourMessage* message : input.messages) {
    if (message == nullptr) continue;
    OnNews(message->news, input.tick);
    TakePiece(message->fragment);
  }
  // Only now is it settled what is newest here, and whose wishes count.
  for (const NeighbourMessage* message : input.messages) {
    if (message != nullptr) OnWish(message->news);
  }
  // The neighbour that offered it is gone: another package, perhaps an older one, may still come
  // whole. So may be the one that could take small pieces only.
  if (state_.incoming.version != 0 && state_.whole == 0 &&
      input.tick - state_.offered_tick > kSilentTicks) {
    Begin({});
  }
  if (input.tick - state_.small_tick > kSilentTicks) state_.cut = kFragmentBytes;
  if (state_.wanted == 0) return;
  // A few pieces go ahead of what is asked for, since an answer takes two ticks; if one of them got
  // lost the neighbour stays where it is, and we go back to it.
  const bool ahead = state_.serve_offset >= state_.want_offset &&
                     state_.serve_offset < state_.want_offset + kPiecesAhead * state_.cut &&
                     state_.serve_offset < Newest().size;
  if (!ahead) state_.serve_offset = state_.want_offset;
}

// The two places change their roles; no byte is copied.
void ProgramRelay::Accept() {
  state_.place = static_cast<uint8_t>(incoming_place());
  state_.running = state_.incoming;
  Begin({});
}

// Remembered, so that it is not collected again and again.
void ProgramRelay::Refuse() {
  state_.refused = state_.incoming;
  Begin({});
}

void ProgramRelay::CopyNewest(uint32_t offset, uint32_t size, uint8_t* out) const {
  if (verified() || state_.place != kFirst) {
    std::memcpy(out, store_.Read(verified() ? incoming_place() : state_.place) + offset, size);
    return;
  }
  // The first program lies there without the head of a package.
  uint8_t head[kPackageHeadBytes];
  WritePackageHead({}, head);
  while (size > 0 && offset < kPackageHeadBytes) {
    *out++ = head[offset++];
    --size;
  }
  if (size > 0) std::memcpy(out, first_image_ + (offset - kPackageHeadBytes), size);
}

void ProgramRelay::Fill(NeighbourMessage* message) {
  ProgramNews& news = message->news;
  const PackageName& newest = Newest();
  news = {.version = newest.version, .hash = newest.id};
  // Asks for the first byte that is missing.
  if (state_.incoming.version != 0 && state_.whole == 0) {
    news.want_version = state_.incoming.version;
    news.want_hash = state_.incoming.id;
    news.want_offset = state_.have;
  }
  // Invocations and bodies go before: a program takes the room that they leave.
  ProgramFragment& piece = message->fragment;
  piece.size = 0;
  const int used = message->num_acks * kAckWireBytes +
                   message->num_invocations * kInvocationWireBytes +
                   message->num_body_entries * kBodyEntryWireBytes;
  if (state_.wanted == 0 || used + kFragmentWireBytes > kMessageTailBytes) return;
  // What was wanted may have been replaced since by a smaller package, which no neighbour has asked
  // for.
  if (state_.serve_offset >= newest.size) return;
  const uint32_t rest = newest.size - state_.serve_offset;
  piece.version = newest.version;
  piece.hash = newest.id;
  piece.image_size = newest.size;
  piece.offset = state_.serve_offset;
  piece.size = static_cast<uint16_t>(rest < state_.cut ? rest : state_.cut);
  CopyNewest(piece.offset, piece.size, piece.bytes);
  state_.serve_offset += piece.size;
}

}  // namespace morphbus::vm
