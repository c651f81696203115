// Height maps as PNG.

#include <fmt/format.h>
#include <png.h>

#include <csetjmp>
#include <cstring>

#include "compiler/world/surface_files.h"

namespace morphbus::world {
namespace {

/// What libpng's callbacks share with the reader: the bytes that are left, and what was wrong.
struct PngInput {
  const std::string* bytes = nullptr;
  size_t at = 0;
  std::string error;
};

void TakeBytes(png_structp png, png_bytep out, size_t size) {
  auto* input = static_cast<PngInput*>(png_get_io_ptr(png));
  // png_error does not return: it calls OnError, which jumps.
  if (size > input->bytes->size() - input->at) png_error(png, "it is cut");
  std::memcpy(out, input->bytes->data() + input->at, size);
  input->at += size;
}

[[noreturn]] void OnError(png_structp png, png_const_charp what) {
  // libpng's contract: an error function must not return. The text is kept for ParseHeights first.
  static_cast<PngInput*>(png_get_error_ptr(png))->error = what;
  png_longjmp(png, 1);
}

void OnWarning(png_structp /*png*/, png_const_charp /*what*/) {}

/// What is wrong with the picture's kind and size; empty if nothing is.
std::string WhyNoHeights(png_structp png, png_infop info) {
  const unsigned columns = png_get_image_width(png, info);
  const unsigned rows = png_get_image_height(png, info);
  if (std::min(columns, rows) < 2 || std::max(columns, rows) > kMaxHeightSide) {
    return fmt::format("has {} x {} pixels; from 2 to {} a side are possible", columns, rows,
                       kMaxHeightSide);
  }
  const int depth = png_get_bit_depth(png, info);
  if (png_get_color_type(png, info) != PNG_COLOR_TYPE_GRAY || (depth != 8 && depth != 16)) {
    return "is no grey picture of 8 or 16 bits a pixel without transparency";
  }
  return "";
}

/// Reads the whole picture. libpng may leave it by longjmp wherever it is called, so that nothing
/// here owns anything at those places.
[[gnu::noinline]] bool ReadPicture(png_structp png, png_infop info, PngInput* input,
                                   Heights* heights, std::string* pixels) {
  png_set_read_fn(png, input, TakeBytes);
  png_read_info(png, info);
  input->error = WhyNoHeights(png, info);
  if (!input->error.empty()) return false;
  // Rows of an interlaced picture come in several passes, each over what the last one left.
  const int passes = png_set_interlace_handling(png);
  png_read_update_info(png, info);
  heights->columns = static_cast<int>(png_get_image_width(png, info));
  heights->rows = static_cast<int>(png_get_image_height(png, info));
  const size_t row_bytes = png_get_rowbytes(png, info);
  pixels->assign(row_bytes * static_cast<size_t>(heights->rows), '\0');
  for (int pass = 0; pass < passes; ++pass) {
    for (int y = 0; y < heights->rows; ++y) {
      png_read_row(png, reinterpret_cast<png_bytep>(pixels->data() + y * row_bytes), nullptr);
    }
  }
  png_read_end(png, nullptr);
  return true;
}

/// The same, with libpng's errors caught.
bool CatchErrors(png_structp png, png_infop info, PngInput* input, Heights* heights,
                 std::string* pixels) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;  // NOLINT: libpng's way to report errors.
  return ReadPicture(png, info, input, heights, pixels);
}

}  // namespace

Result<Heights> ParseHeights(const std::string& bytes) {
  PngInput input{&bytes, 0, ""};
  if (bytes.size() < 8 || png_sig_cmp(reinterpret_cast<png_const_bytep>(bytes.data()), 0, 8) != 0) {
    return Fail("is no PNG file");
  }
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &input, OnError, OnWarning);
  // Both are null if memory is short, and destroying null is allowed.
  png_infop info = png == nullptr ? nullptr : png_create_info_struct(png);
  Heights heights;
  std::string pixels;
  const bool good = info != nullptr && CatchErrors(png, info, &input, &heights, &pixels);
  const bool wide = good && png_get_bit_depth(png, info) == 16;
  png_destroy_read_struct(&png, &info, nullptr);
  if (!good) {
    // Our own sentences go on from the file's name, libpng's do not.
    const bool own = input.error.starts_with("has ") || input.error.starts_with("is no ");
    return Fail(own ? input.error : "cannot be read: " + input.error);
  }
  // Eight bits are stretched to sixteen, white to white.
  const auto byte = [&](size_t i) {
    return static_cast<unsigned>(static_cast<uint8_t>(pixels[i]));
  };
  for (size_t i = 0; i < pixels.size(); i += wide ? 2 : 1) {
    heights.samples.push_back(
        static_cast<uint16_t>(wide ? byte(i) << 8 | byte(i + 1) : byte(i) * 257));
  }
  return heights;
}

}  // namespace morphbus::world
