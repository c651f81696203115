#include "tools/commands/draw_video.h"

#include <memory>
#include <utility>

#include "tools/base/files.h"
#include "tools/machine/video_encoder.h"

namespace morphbus::tools {

const OutputKind* VideoKindOf(const std::string& path) {
  if (path.ends_with(".webp")) return &outputs::kWebp;
  if (path.ends_with(".mp4")) return &outputs::kMp4;
  return path.ends_with(".gif") ? &outputs::kGif : nullptr;
}

Result<void> MayEncode(const std::string& path) {
  // WebP is encoded by a library that is always there.
  if (path.ends_with(".webp")) return {};
  const Result<std::string> program = VideoEncoder::Program();
  return program ? Result<void>() : Fail(path + ": " + program.error().message);
}

Result<void> WriteVideo(const logger::LogPictures& pictures, const VideoOptions& options,
                        const std::string& path, const std::function<void(double)>& progress) {
  const auto& [fps, width_px, times, views] = options;
  if (path.ends_with(".webp")) {
    const Result<std::string> bytes = pictures.Video(fps, width_px, times, views, progress);
    return bytes ? WriteFile(path, *bytes) : Fail(bytes.error().message);
  }
  Result<std::unique_ptr<OutputFile>> file = OutputFile::Create(path);
  if (!file) return Fail(file.error().message);
  // What is wrong with the log does not name the video.
  const auto named = [&path](const Result<void>& done) {
    return done ? done : Fail(path + ": " + done.error().message);
  };
  if ((*file)->file() < 0) return named(Fail("a video can only be written to a file"));
  VideoFormat format;
  format.kind = path.ends_with(".gif") ? VideoFormat::Kind::kGif : VideoFormat::Kind::kMp4;
  format.fps = fps;
  std::unique_ptr<VideoEncoder> encoder;
  const Result<void> drawn = pictures.Frames(
      fps, width_px, times, views,
      [&](const logger::Raster& frame, int /*milliseconds*/) -> Result<void> {
        // The size is known once the first frame is drawn.
        if (!encoder) {
          format.width = frame.width;
          format.height = frame.height;
          auto started = VideoEncoder::Start(format, (*file)->file());
          if (!started) return named(Fail(started.error().message));
          encoder = std::move(*started);
        }
        return named(encoder->Add(frame.rgba));
      },
      progress);
  // There is a first frame always, so that an encoder is there if nothing has failed.
  const Result<void> encoded = drawn ? named(encoder->Finish()) : drawn;
  if (!encoded) return encoded;
  return (*file)->Close();
}

}  // namespace morphbus::tools
