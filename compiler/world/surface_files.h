#pragma once
// The files that a world's meshes and height maps name.

#include <string>

#include "compiler/world/surface.h"

namespace morphbus::world {

/// The file that a uri of `world_file` names: a path relative to that file's folder, with or
/// without file:// before it.
std::string FileOfUri(const std::string& world_file, const std::string& uri);

/// Reads the files that uris name (FileOfUri). Meshes are STL, text or binary; height maps are PNG
/// (ParseHeights). The errors name the file and what is wrong with it.
SurfaceLoader FilesBeside(const std::string& world_file);

/// Heights from the bytes of a grey PNG of 8 or 16 bits a pixel, without alpha, interlaced or not;
/// at most kMaxHeightSide pixels a side. The error says what is wrong with it.
Result<Heights> ParseHeights(const std::string& bytes);

}  // namespace morphbus::world
