#include "tools/machine/video_encoder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>
#include <vector>

#include "tools/base/lines.h"
#include "tools/machine/program_output.h"

namespace morphbus::tools {
namespace {

/// What ffmpeg is told of the frames, and of what it makes of them.
std::vector<std::string> EncoderArguments(const std::string& program, const VideoFormat& format,
                                          int file) {
  std::vector<std::string> words = {program, "-hide_banner", "-loglevel", "error", "-nostdin"};
  const auto add = [&](const std::vector<std::string>& more) {
    words.insert(words.end(), more.begin(), more.end());
  };
  add({"-f", "rawvideo", "-pixel_format", "rgba", "-video_size",
       fmt::format("{}x{}", format.width, format.height), "-framerate", std::to_string(format.fps),
       "-i", "pipe:0"});
  // Nothing of the time and of versions, so that the same frames become the same bytes.
  add({"-fflags", "+bitexact", "-flags:v", "+bitexact", "-map_metadata", "-1"});
  if (format.kind == VideoFormat::Kind::kMp4) {
    // H.264 with colours at half the resolution is what every player knows; it needs even sizes.
    // The matrix is said, for players take another one by default. 17 is where losses begin to be
    // seen (https://trac.ffmpeg.org/wiki/Encode/H.264). What a player needs first comes first.
    add({"-vf",
         "pad=ceil(iw/2)*2:ceil(ih/2)*2:color=white,scale=out_color_matrix=bt709,format=yuv420p",
         "-c:v", "libx264", "-preset", "medium", "-tune", "animation", "-crf", "17"});
    add({"-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709"});
    add({"-movflags", "+faststart", "-f", "mp4"});
  } else {
    // A palette for each frame: one for all would need all frames in memory. Without dithering flat
    // faces stay flat. 0: it repeats for ever.
    add({"-filter_complex",
         "split[a][b];[a]palettegen=stats_mode=single[p];[b][p]paletteuse=new=1:dither=none",
         "-loop", "0", "-f", "gif"});
  }
  add({"-y", fmt::format("/proc/self/fd/{}", file)});
  return words;
}

}  // namespace

Result<std::string> VideoEncoder::Program() {
  const Result<std::string> path = FindProgram("ffmpeg");
  if (path) return path;
  return Fail("MP4 and GIF are encoded by ffmpeg, and " + path.error().message +
              "; install it (Debian: apt install ffmpeg), or name a .webp, which needs nothing");
}

Result<std::unique_ptr<VideoEncoder>> VideoEncoder::Start(const VideoFormat& format, int file) {
  const Result<std::string> program = Program();
  if (!program) return Fail(program.error().message);
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) {
    return Fail(fmt::format("cannot make a pipe: {}", std::strerror(errno)));
  }
  const Descriptor theirs(ends[0]);
  Descriptor ours(ends[1]);
  Descriptor words(memfd_create("ffmpeg", MFD_CLOEXEC));
  if (words.get() < 0) return Fail(fmt::format("cannot make a file: {}", std::strerror(errno)));
  ChildProcess::Options options;
  options.name = "ffmpeg";
  options.argv = EncoderArguments(*program, format, file);
  options.inherited_fds = {file};
  options.input = theirs.get();
  // All that it says is what is wrong.
  options.output = words.get();
  options.errors = words.get();
  Result<ChildProcess> child = ChildProcess::Start(options);
  if (!child) return Fail(child.error().message);
  return std::unique_ptr<VideoEncoder>(
      new VideoEncoder(format, std::move(*child), std::move(ours), std::move(words)));
}

Result<void> VideoEncoder::Add(std::span<const uint8_t> rgba) {
  if (rgba.size() != frame_bytes_) return Fail("the frames of a video must be of one size");
  const std::string_view bytes(reinterpret_cast<const char*>(rgba.data()), rgba.size());
  if (WriteWhole(frames_->get(), bytes)) return {};
  // It has closed the pipe, and so has something to say.
  const Result<void> end = Finish();
  return end ? Fail("ffmpeg ended before it had all frames") : end;
}

Result<void> VideoEncoder::Finish() {
  // The end of the pipe is the end of the video.
  frames_.reset();
  while (!child_.Poll()) {
    pollfd ended = {child_.pidfd(), POLLIN, 0};
    poll(&ended, 1, -1);
  }
  if (child_.status() == 0) return {};
  std::string said;
  lseek(words_.get(), 0, SEEK_SET);
  while (ReadSome(words_.get(), &said)) continue;
  const std::string last = LastLine(said);
  return Fail(fmt::format("ffmpeg {}{}{}", child_.exit_text(), last.empty() ? "" : ": ", last));
}

}  // namespace morphbus::tools
