// Replays a corpus through a fuzz target's entry point without libFuzzer: every file of the given
// folders is one input. A crash or a sanitizer finding fails the test. Besides each file as it is,
// its prefixes of a few lengths are tried, so that "cut short" is part of every corpus.

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);

namespace {

std::vector<std::filesystem::path> FilesUnder(const std::filesystem::path& place) {
  std::vector<std::filesystem::path> files;
  if (std::filesystem::is_regular_file(place)) return {place};
  for (const auto& entry : std::filesystem::recursive_directory_iterator(place)) {
    if (entry.is_regular_file()) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

void Replay(const std::vector<uint8_t>& bytes) {
  constexpr size_t kCuts = 8;
  for (size_t cut = 0; cut <= kCuts; ++cut) {
    // A copy of exactly this size, so that reading past the end is seen.
    const std::vector<uint8_t> part(
        bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(bytes.size() * cut / kCuts));
    LLVMFuzzerTestOneInput(part.data(), part.size());
  }
}

}  // namespace

int main(int argc, char** argv) {
  size_t count = 0;
  for (int i = 1; i < argc; ++i) {
    for (const auto& path : FilesUnder(argv[i])) {
      std::ifstream in(path, std::ios::binary);
      Replay(std::vector<uint8_t>(std::istreambuf_iterator<char>(in), {}));
      ++count;
    }
  }
  std::printf("%zu inputs replayed\n", count);
  if (count == 0) std::fprintf(stderr, "the corpus is empty: nothing was tested\n");
  return count == 0 ? 1 : 0;
}
