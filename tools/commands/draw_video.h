#pragma once
// A log in motion as a file: animated WebP, GIF, or MP4.

#include <functional>
#include <string>
#include <vector>

#include "compiler/base/result.h"
#include "logger/show/log_pictures.h"
#include "tools/base/output_path.h"

namespace morphbus::tools {

/// What a video shows, and how.
struct VideoOptions {
  int fps = 10;      ///< Frames a second of sim time, 1 to 50.
  int width_px = 0;  ///< Of each view; 0: as LogPictures::Frames has it.
  logger::PictureTimes times;
  std::vector<logger::View> views;
};

/// The kind of video that a file's suffix says; null for a name that is no video's.
const OutputKind* VideoKindOf(const std::string& path);
/// Fails, saying what to install, if videos of this name cannot be made on this machine.
Result<void> MayEncode(const std::string& path);

/// Draws a log into the file `path`, whose name is a video's, frame by frame; nothing of it is left
/// after a failure. `progress` hears now and then how much is done, 0 to 1. Fails as MayEncode and
/// LogPictures::Frames do, and if the file cannot be written.
Result<void> WriteVideo(const logger::LogPictures& pictures, const VideoOptions& options,
                        const std::string& path, const std::function<void(double)>& progress);

}  // namespace morphbus::tools
