#include "logger/log/compress.h"

#include <zstd.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "logger/log/event_log.h"

namespace morphbus::logger {
namespace {

/// A frame ends with the first event that begins so far behind the frame's own beginning.
constexpr uint64_t kFrameBytes = uint64_t{4} << 20;
/// The log is handed to the compressor in pieces of this size.
constexpr size_t kCopyBytes = size_t{1} << 20;

/// Compresses stretches of one log, a frame each.
class FrameWriter {
 public:
  FrameWriter(LogBytes* bytes, const ByteSink& write)
      : bytes_(*bytes), write_(write), context_(ZSTD_createCCtx(), ZSTD_freeCCtx) {
    // With a checksum a reader knows a damaged frame, and goes on at the next.
    ZSTD_CCtx_setParameter(context_.get(), ZSTD_c_checksumFlag, 1);
  }

  /// Writes log bytes [begin, end) as one frame.
  Result<void> Write(uint64_t begin, uint64_t end) {
    // zstd then writes the size at the frame's beginning, where other programs look for it.
    ZSTD_CCtx_setPledgedSrcSize(context_.get(), end - begin);
    while (begin < end) {
      const size_t n =
          bytes_.ReadAt(begin, in_.data(), std::min<uint64_t>(kCopyBytes, end - begin));
      if (n == 0) return Fail("the log became shorter while it was read");
      begin += n;
      bytes_.Forget(begin);
      if (Result<void> written = Compress(n, begin == end); !written) return written;
    }
    return {};
  }

  [[nodiscard]] uint64_t written() const { return written_; }

 private:
  /// Compresses the first `size` bytes of in_; `last`: they end the frame.
  Result<void> Compress(size_t size, bool last) {
    ZSTD_inBuffer input = {in_.data(), size, 0};
    size_t rest = 0;
    do {
      ZSTD_outBuffer output = {out_.data(), out_.size(), 0};
      rest = ZSTD_compressStream2(context_.get(), &output, &input,
                                  last ? ZSTD_e_end : ZSTD_e_continue);
      if (ZSTD_isError(rest) != 0) return Fail(std::string("zstd: ") + ZSTD_getErrorName(rest));
      if (Result<void> written = write_({out_.data(), output.pos}); !written) return written;
      written_ += output.pos;
    } while (last ? rest > 0 : input.pos < size);
    return {};
  }

  LogBytes& bytes_;
  const ByteSink& write_;
  std::unique_ptr<ZSTD_CCtx, size_t (*)(ZSTD_CCtx*)> context_;
  std::vector<uint8_t> in_ = std::vector<uint8_t>(kCopyBytes);
  std::vector<uint8_t> out_ = std::vector<uint8_t>(ZSTD_CStreamOutSize());
  uint64_t written_ = 0;
};

}  // namespace

Result<CompressionReport> CompressLog(const std::string& path, const ByteSink& write) {
  // The reader of events says where a frame may end; the bytes themselves are copied unread.
  auto reader = EventLogReader::Open(path);
  if (!reader) return tl::unexpected(reader.error());
  auto bytes = LogBytes::Open(path);
  if (!bytes) return tl::unexpected(bytes.error());
  FrameWriter frames(bytes->get(), write);
  LogEvent event;
  uint64_t begin = 0;
  while ((*reader)->Next(&event)) {
    if (event.offset - begin < kFrameBytes) continue;
    if (Result<void> r = frames.Write(begin, event.offset); !r) return tl::unexpected(r.error());
    begin = event.offset;
  }
  if (!(*reader)->io_error().empty()) {
    return Fail("cannot read " + path + ": " + (*reader)->io_error());
  }
  if (const std::string why = (*reader)->WhyNoLog(); !why.empty()) return Fail(why);
  // The last frame takes what is left, damage at the end included; of an empty log nothing is
  // written.
  const uint64_t end = (*reader)->log_size();
  if (Result<void> r = frames.Write(begin, end); !r) return tl::unexpected(r.error());
  return CompressionReport{end, frames.written()};
}

}  // namespace morphbus::logger
