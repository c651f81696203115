#include "logger/show/animation.h"

#include <webp/encode.h>
#include <webp/mux.h>

namespace morphbus::logger {

struct Animation::Encoder {
  WebPAnimEncoder* encoder = nullptr;
  WebPConfig config = {};
  int width = 0;
  int height = 0;
  /// When the next frame begins, ms.
  int time_ms = 0;

  Encoder() = default;
  Encoder(const Encoder&) = delete;
  Encoder& operator=(const Encoder&) = delete;
  ~Encoder() { WebPAnimEncoderDelete(encoder); }
};

Animation::Animation(std::unique_ptr<Encoder> encoder) : encoder_(std::move(encoder)) {}
Animation::~Animation() = default;

Result<std::unique_ptr<Animation>> Animation::Create(int width, int height) {
  if (width < 1 || height < 1 || width > WEBP_MAX_DIMENSION || height > WEBP_MAX_DIMENSION) {
    return Fail("a picture of " + std::to_string(width) + " x " + std::to_string(height) +
                " pixels is too large for WebP");
  }
  // The object owns the encoder from here on, so that every failure below frees it.
  auto encoder = std::make_unique<Encoder>();
  encoder->width = width;
  encoder->height = height;
  // Options with their defaults, of which one is a loop without end.
  WebPAnimEncoderOptions options;
  // Level 1 of 9 takes a fifth of the time of the default, for some more bytes.
  if (WebPAnimEncoderOptionsInit(&options) == 0 || WebPConfigInit(&encoder->config) == 0 ||
      WebPConfigLosslessPreset(&encoder->config, 1) == 0) {
    return Fail("libwebp is of another version than its headers");
  }
  encoder->encoder = WebPAnimEncoderNew(width, height, &options);
  if (encoder->encoder == nullptr) return Fail("libwebp has no memory for the animation");
  return std::unique_ptr<Animation>(new Animation(std::move(encoder)));
}

Result<void> Animation::Add(const Raster& frame, int milliseconds) {
  if (frame.width != encoder_->width || frame.height != encoder_->height) {
    return Fail("the frames of an animation must be of one size");
  }
  // All frames are of the size that the encoder was made for, else it would refuse them with less
  // to say.
  WebPPicture picture;
  if (WebPPictureInit(&picture) == 0) return Fail("libwebp is of another version");
  // Lossless needs ARGB; YUV, the default, is for lossy pictures.
  picture.use_argb = 1;
  picture.width = frame.width;
  picture.height = frame.height;
  // The picture holds a copy, which the encoder compares with the frame before.
  const bool added =
      WebPPictureImportRGBA(&picture, frame.rgba.data(), frame.width * 4) != 0 &&
      WebPAnimEncoderAdd(encoder_->encoder, &picture, encoder_->time_ms, &encoder_->config) != 0;
  WebPPictureFree(&picture);
  if (!added) {
    return Fail(std::string("libwebp: ") + WebPAnimEncoderGetError(encoder_->encoder));
  }
  // libwebp takes the time at which a frame begins, and so its duration is that up to the next one.
  encoder_->time_ms += milliseconds;
  return {};
}

Result<std::string> Animation::Finish() {
  // A frame without a picture says when the last one ends.
  WebPData data;
  WebPDataInit(&data);
  const bool done =
      WebPAnimEncoderAdd(encoder_->encoder, nullptr, encoder_->time_ms, nullptr) != 0 &&
      WebPAnimEncoderAssemble(encoder_->encoder, &data) != 0;
  if (!done) {
    WebPDataClear(&data);
    return Fail(std::string("libwebp: ") + WebPAnimEncoderGetError(encoder_->encoder));
  }
  std::string bytes(reinterpret_cast<const char*>(data.bytes), data.size);
  WebPDataClear(&data);
  return bytes;
}

}  // namespace morphbus::logger
