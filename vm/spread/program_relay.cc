#include "vm/spread/program_relay.h"

#include <cstring>
#include <initializer_list>

namespace morphbus::vm {

namespace {

constexpr uint32_t kPiece = kFragmentBytes;
constexpr uint32_t kPiecesAhead = 4;
/// Versions travel as 32 bits with a sign.
constexpr uint32_t kHighestVersion = 0x7fffffffu;

/// The highest version counts; the hash decides between programs that were deployed at once.
bool IsNewer(uint32_t version, uint64_t hash, const ProgramNews& than) {
  return version > than.version || (version == than.version && hash > than.hash);
}

/// Pieces that a package of this size is cut into, and the size of the one at an offset.
uint32_t NumPieces(uint32_t size) { return (size + kPiece - 1) / kPiece; }

uint32_t PieceSize(uint32_t package_size, uint32_t offset) {
  const uint32_t rest = package_size - offset;
  return rest < kPiece ? rest : kPiece;
}

}  // namespace

int64_t SpreadTicks(uint32_t package_size, int hops) {
  // News takes a tick, the wish for it another one; then a piece comes every tick.
  constexpr int64_t kBeforeFirstPiece = 2;
  return hops * (kBeforeFirstPiece + NumPieces(package_size));
}

void ProgramRelay::Start(const uint8_t* image, uint32_t size, uint64_t hash, uint32_t version) {
  // As a package without a tick, so that a neighbour without this program can have it.
  uint8_t* package = state_.packages[state_.active];
  WritePackageHead({}, package);
  std::memcpy(package + kPackageHeadBytes, image, size);
  state_.running_size = kPackageHeadBytes + size;
  state_.running = {.version = version, .hash = hash};
  state_.newest_heard = version;
}

void ProgramRelay::Deploy(const uint8_t* package, uint32_t size, uint64_t id, uint32_t number) {
  // Above every version heard of, so that it replaces them all; at the end of numbers ids decide.
  if (state_.newest_heard < kHighestVersion) ++state_.newest_heard;
  if (number > state_.newest_heard && number <= kHighestVersion) state_.newest_heard = number;
  Begin(state_.newest_heard, id, size);
  std::memcpy(state_.packages[1 - state_.active], package, size);
  std::memset(state_.have_piece, 1, sizeof(state_.have_piece));
  state_.pieces_missing = 0;
}

bool ProgramRelay::AsStarted() const {
  const RelayState& s = state_;
  const bool nothing_came = s.incoming.version == 0 && s.refused.version == 0 &&
                            s.newest_heard == s.running.version && s.offered_tick == 0;
  const bool nothing_went = s.wanted == 0 && s.want_offset == 0 && s.serve_offset == 0;
  return nothing_came && nothing_went;
}

bool ProgramRelay::ready() const {
  return state_.incoming.version != 0 && state_.pieces_missing == 0 && state_.held == 0;
}

void ProgramRelay::Begin(uint32_t version, uint64_t id, uint32_t size) {
  // What was held until now is older, and its bytes go.
  state_.held = 0;
  state_.incoming = {.version = version, .hash = id, .image_size = size};
  // The size is not known before the first piece; one piece stands for it until then.
  state_.pieces_missing = size == 0 ? 1 : NumPieces(size);
  std::memset(state_.have_piece, 0, sizeof(state_.have_piece));
}

// A neighbour has something newer than what we run, collect, hold or have refused: it is collected.
void ProgramRelay::OnNews(const ProgramNews& news, int64_t tick) {
  for (const uint32_t version : {news.version, news.want_version}) {
    if (version > state_.newest_heard && version <= kHighestVersion) state_.newest_heard = version;
  }
  const ProgramNews incoming = {.version = state_.incoming.version, .hash = state_.incoming.hash};
  if (news.version == incoming.version && news.hash == incoming.hash) state_.offered_tick = tick;
  if (!IsNewer(news.version, news.hash, state_.running)) return;
  if (!IsNewer(news.version, news.hash, state_.refused)) return;
  if (!IsNewer(news.version, news.hash, incoming)) return;
  Begin(news.version, news.hash, 0);
  state_.offered_tick = tick;
}

// Pieces come in any order, and again; each counts once.
void ProgramRelay::TakePiece(const ProgramFragment& piece) {
  ProgramFragment& incoming = state_.incoming;
  if (piece.size == 0 || state_.pieces_missing == 0 || incoming.version == 0 ||
      piece.version != incoming.version || piece.hash != incoming.hash) {
    return;
  }
  // A piece that does not lie on the grid of its package is damaged or a lie.
  if (piece.image_size == 0 || piece.image_size > kMaxPackageBytes || piece.offset % kPiece != 0 ||
      piece.offset >= piece.image_size || piece.size != PieceSize(piece.image_size, piece.offset)) {
    return;
  }
  // The first piece tells how many there are.
  if (incoming.image_size == 0) {
    incoming.image_size = piece.image_size;
    state_.pieces_missing = NumPieces(piece.image_size);
  }
  const uint32_t index = piece.offset / kPiece;
  if (piece.image_size != incoming.image_size || state_.have_piece[index] != 0) return;
  std::memcpy(state_.packages[1 - state_.active] + piece.offset, piece.bytes, piece.size);
  state_.have_piece[index] = 1;
  --state_.pieces_missing;
}

ProgramNews ProgramRelay::Newest() const {
  if (!held()) return {.version = state_.running.version, .hash = state_.running.hash};
  return {.version = state_.incoming.version, .hash = state_.incoming.hash};
}

const uint8_t* ProgramRelay::newest_package() const {
  return state_.packages[held() ? 1 - state_.active : state_.active];
}

uint32_t ProgramRelay::newest_size() const {
  return held() ? state_.incoming.image_size : state_.running_size;
}

void ProgramRelay::Receive(const TickInput& input) {
  state_.wanted = 0;
  for (const NeighbourMessage* message : input.messages) {
    if (message == nullptr) continue;
    OnNews(message->news, input.tick);
    TakePiece(message->fragment);
  }
  // Only now is it settled what is newest here, and whose wishes count.
  const ProgramNews newest = Newest();
  for (const NeighbourMessage* message : input.messages) {
    if (message == nullptr) continue;
    const ProgramNews& news = message->news;
    if (news.want_version != newest.version || news.want_hash != newest.hash ||
        news.want_offset % kPiece != 0 || news.want_offset >= newest_size()) {
      continue;
    }
    // Several neighbours may be at different places: the one furthest behind is served first, so
    // that all catch up with each other and the same pieces serve them all.
    if (state_.wanted == 0 || news.want_offset < state_.want_offset) {
      state_.want_offset = news.want_offset;
    }
    state_.wanted = 1;
  }
  // Whoever offered it is gone: another one, perhaps an older one, may still come whole.
  if (state_.incoming.version != 0 && state_.pieces_missing > 0 &&
      input.tick - state_.offered_tick > kSilentTicks) {
    state_.incoming = ProgramFragment();
  }
  if (state_.wanted == 0) return;
  // A few pieces go ahead of what is asked for, since an answer takes two ticks; if one of them got
  // lost the neighbour stays where it is, and we go back to it.
  const bool ahead = state_.serve_offset >= state_.want_offset &&
                     state_.serve_offset < state_.want_offset + kPiecesAhead * kPiece &&
                     state_.serve_offset < newest_size();
  if (!ahead) state_.serve_offset = state_.want_offset;
}

// The two halves of the store change their roles; no byte is copied.
void ProgramRelay::Accept() {
  state_.active = static_cast<uint8_t>(1 - state_.active);
  state_.running_size = state_.incoming.image_size;
  state_.running = {.version = state_.incoming.version, .hash = state_.incoming.hash};
  state_.incoming = ProgramFragment();
  state_.held = 0;
}

// Remembered, so that it is not collected again and again.
void ProgramRelay::Refuse() {
  state_.refused = {.version = state_.incoming.version, .hash = state_.incoming.hash};
  state_.incoming = ProgramFragment();
}

void ProgramRelay::Fill(NeighbourMessage* message) {
  ProgramNews& news = message->news;
  const ProgramNews newest = Newest();
  news = newest;
  // Asks for the first piece that is missing.
  if (state_.incoming.version != 0 && state_.pieces_missing > 0) {
    news.want_version = state_.incoming.version;
    news.want_hash = state_.incoming.hash;
    uint32_t first = 0;
    while (state_.incoming.image_size != 0 && state_.have_piece[first] != 0) ++first;
    news.want_offset = first * kPiece;
  }
  // Invocations and bodies go before: a program takes the room that they leave.
  message->fragment.size = 0;
  const int used = message->num_acks * kAckWireBytes +
                   message->num_invocations * kInvocationWireBytes +
                   message->num_body_entries * kBodyEntryWireBytes;
  if (state_.wanted == 0 || used + kFragmentWireBytes > kMessageTailBytes) return;
  // What was wanted may have been replaced since by a smaller package, which nobody has asked for.
  if (state_.serve_offset >= newest_size()) return;
  ProgramFragment& piece = message->fragment;
  piece.version = newest.version;
  piece.hash = newest.hash;
  piece.image_size = newest_size();
  piece.offset = state_.serve_offset;
  piece.size = static_cast<uint16_t>(PieceSize(newest_size(), piece.offset));
  std::memcpy(piece.bytes, newest_package() + piece.offset, piece.size);
  state_.serve_offset += kPiece;
}

}  // namespace morphbus::vm
