#pragma once
// Moving pictures as animated WebP: lossless, so that edges stay as smooth as they were drawn, and
// shown by every browser. (https://developers.google.com/speed/webp)

#include <memory>
#include <string>

#include "compiler/base/result.h"
#include "logger/show/drawing.h"

namespace morphbus::logger {

/// Takes the frames of an animation one by one, all of one size, and encodes them as they come.
class Animation {
 public:
  /// Width and height in pixels, at most 16383 each. Fails beyond that.
  static Result<std::unique_ptr<Animation>> Create(int width, int height);
  ~Animation();
  Animation(const Animation&) = delete;
  Animation& operator=(const Animation&) = delete;

  /// Adds a frame that is shown for `milliseconds` (above 0).
  Result<void> Add(const Raster& frame, int milliseconds);
  /// The bytes of the file; it repeats for ever. Called once, after the last frame.
  Result<std::string> Finish();

 private:
  /// The encoder, kept out of this header.
  struct Encoder;
  explicit Animation(std::unique_ptr<Encoder> encoder);
  std::unique_ptr<Encoder> encoder_;
};

}  // namespace morphbus::logger
