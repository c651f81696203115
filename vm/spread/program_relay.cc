#include "vm/spread/program_relay.h"

#include <cstring>

namespace morphbus::vm {

namespace {

constexpr uint32_t kPiece = kFragmentBytes;
constexpr uint32_t kPiecesAhead = 4;

/// The highest version counts; the hash decides between programs that were deployed at once.
bool IsNewer(uint32_t version, uint64_t hash, const ProgramNews& than) {
  return version > than.version || (version == than.version && hash > than.hash);
}

/// Pieces that an image of this size is cut into, and the size of the one at an offset.
uint32_t NumPieces(uint32_t size) { return (size + kPiece - 1) / kPiece; }

uint32_t PieceSize(uint32_t image_size, uint32_t offset) {
  const uint32_t rest = image_size - offset;
  return rest < kPiece ? rest : kPiece;
}

}  // namespace

void ProgramRelay::Start(const uint8_t* image, uint32_t size, uint64_t hash, uint32_t version) {
  std::memcpy(state_.images[state_.active], image, size);
  state_.running_size = size;
  state_.running = {.version = version, .hash = hash};
}

void ProgramRelay::Deploy(const uint8_t* image, uint32_t size, uint64_t hash) {
  // Above every version heard of, so that it replaces them all.
  uint32_t newest = state_.running.version;
  if (state_.incoming.version > newest) newest = state_.incoming.version;
  if (state_.refused.version > newest) newest = state_.refused.version;
  Begin(newest + 1, hash, size);
  std::memcpy(state_.images[1 - state_.active], image, size);
  std::memset(state_.have_piece, 1, sizeof(state_.have_piece));
  state_.pieces_missing = 0;
}

bool ProgramRelay::ready() const {
  return state_.incoming.version != 0 && state_.pieces_missing == 0;
}

void ProgramRelay::Begin(uint32_t version, uint64_t hash, uint32_t size) {
  state_.incoming = {.version = version, .hash = hash, .image_size = size};
  state_.pieces_missing = NumPieces(size);
  std::memset(state_.have_piece, 0, sizeof(state_.have_piece));
}

// A neighbour runs something newer than what we run, collect or have refused: it is collected now.
void ProgramRelay::OnNews(const ProgramNews& news) {
  if (!IsNewer(news.version, news.hash, state_.running)) return;
  if (!IsNewer(news.version, news.hash, state_.refused)) return;
  const ProgramNews incoming = {.version = state_.incoming.version, .hash = state_.incoming.hash};
  // The size is not known before the first piece; one piece stands for it until then.
  if (IsNewer(news.version, news.hash, incoming)) Begin(news.version, news.hash, 0);
  if (state_.incoming.image_size == 0) state_.pieces_missing = 1;
}

// Pieces come in any order, and again; each counts once.
void ProgramRelay::TakePiece(const ProgramFragment& piece) {
  ProgramFragment& incoming = state_.incoming;
  if (piece.size == 0 || ready() || piece.version != incoming.version ||
      piece.hash != incoming.hash) {
    return;
  }
  // A piece that does not lie on the grid of its image is damaged or a lie.
  if (piece.image_size == 0 || piece.image_size > kMaxImageBytes || piece.offset % kPiece != 0 ||
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
  std::memcpy(state_.images[1 - state_.active] + piece.offset, piece.bytes, piece.size);
  state_.have_piece[index] = 1;
  --state_.pieces_missing;
}

void ProgramRelay::Receive(const TickInput& input) {
  state_.wanted = 0;
  for (const NeighbourMessage* message : input.messages) {
    if (message == nullptr) continue;
    OnNews(message->news);
    TakePiece(message->fragment);
    const ProgramNews& news = message->news;
    if (news.want_version != state_.running.version || news.want_hash != state_.running.hash ||
        news.want_offset % kPiece != 0 || news.want_offset >= state_.running_size) {
      continue;
    }
    // Several neighbours may be at different places: the one furthest behind is served first, so
    // that all catch up with each other and the same pieces serve them all.
    if (state_.wanted == 0 || news.want_offset < state_.want_offset) {
      state_.want_offset = news.want_offset;
    }
    state_.wanted = 1;
  }
  if (state_.wanted == 0) return;
  // A few pieces go ahead of what is asked for, since an answer takes two ticks; if one of them got
  // lost the neighbour stays where it is, and we go back to it.
  const bool ahead = state_.serve_offset >= state_.want_offset &&
                     state_.serve_offset < state_.want_offset + kPiecesAhead * kPiece &&
                     state_.serve_offset < state_.running_size;
  if (!ahead) state_.serve_offset = state_.want_offset;
}

// The two halves of the store change their roles; no byte is copied.
void ProgramRelay::Accept() {
  state_.active = static_cast<uint8_t>(1 - state_.active);
  state_.running_size = state_.incoming.image_size;
  state_.running = {.version = state_.incoming.version, .hash = state_.incoming.hash};
  state_.incoming = ProgramFragment();
  state_.wanted = 0;
}

// Remembered, so that it is not collected again and again.
void ProgramRelay::Refuse() {
  state_.refused = {.version = state_.incoming.version, .hash = state_.incoming.hash};
  state_.incoming = ProgramFragment();
}

void ProgramRelay::Fill(NeighbourMessage* message) {
  ProgramNews& news = message->news;
  news = {.version = state_.running.version, .hash = state_.running.hash};
  // Asks for the first piece that is missing.
  if (state_.incoming.version != 0 && !ready()) {
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
  ProgramFragment& piece = message->fragment;
  piece.version = state_.running.version;
  piece.hash = state_.running.hash;
  piece.image_size = state_.running_size;
  piece.offset = state_.serve_offset;
  piece.size = static_cast<uint16_t>(PieceSize(state_.running_size, piece.offset));
  std::memcpy(piece.bytes, running_image() + piece.offset, piece.size);
  state_.serve_offset += kPiece;
}

}  // namespace morphbus::vm
