#pragma once
// Videos as MP4 (H.264) and GIF, encoded by the program ffmpeg, which gets the frames one by one.
// Its libraries are not linked: with what they need they are some forty packages, for a file that
// few users ask for (docs/libraries.md).

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "compiler/base/result.h"
#include "tools/base/descriptor.h"
#include "tools/machine/child_process.h"

namespace morphbus::tools {

/// What a video is, and how its frames come: `width` x `height` pixels, `fps` a second.
struct VideoFormat {
  enum class Kind { kMp4, kGif };
  Kind kind = Kind::kMp4;
  int width = 0, height = 0;
  int fps = 1;
};

/// A video that is being encoded. One version of ffmpeg makes the same bytes of the same frames.
class VideoEncoder {
 public:
  /// The path of ffmpeg; fails, saying how to get it, if this machine has none.
  static Result<std::string> Program();
  /// Starts ffmpeg, which writes to `file`: a descriptor of a file that can be read and sought,
  /// open until Finish(). Fails as Program() does, or if ffmpeg does not start.
  static Result<std::unique_ptr<VideoEncoder>> Start(const VideoFormat& format, int file);

  /// Adds a frame: row by row from the top, each pixel red, green, blue, alpha. Waits while ffmpeg
  /// has enough to do, so that nothing piles up. Fails, with what ffmpeg says, if it has ended.
  Result<void> Add(std::span<const uint8_t> rgba);
  /// Waits for ffmpeg to end the file. Called once, after the last frame.
  Result<void> Finish();

 private:
  VideoEncoder(const VideoFormat& format, ChildProcess child, Descriptor frames, Descriptor words)
      : frame_bytes_(static_cast<size_t>(format.width) * static_cast<size_t>(format.height) * 4),
        child_(std::move(child)),
        frames_(std::move(frames)),
        words_(std::move(words)) {}

  size_t frame_bytes_;
  ChildProcess child_;
  /// The end of the pipe into which frames go. Open until Finish().
  std::optional<Descriptor> frames_;
  /// Where ffmpeg says what is wrong: a file in memory, which never makes it wait.
  Descriptor words_;
};

}  // namespace morphbus::tools
