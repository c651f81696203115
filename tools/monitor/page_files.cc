#include "tools/monitor/page_files.h"

#include <fmt/format.h>

#include <filesystem>

#include "tools/base/files.h"

namespace morphbus::tools {
namespace {

namespace fs = std::filesystem;

/// Bounds for --page, which may name any folder by mistake.
constexpr size_t kMostPageFiles = 1000;
constexpr size_t kMostBytes = size_t{64} << 20;

/// MIME type by the name's suffix.
std::string TypeOf(const std::string& suffix) {
  static const std::map<std::string, std::string> kTypes = {
      {".html", "text/html; charset=utf-8"},
      {".js", "text/javascript; charset=utf-8"},
      {".css", "text/css; charset=utf-8"},
      {".svg", "image/svg+xml"},
      {".png", "image/png"},
      {".ico", "image/x-icon"},
      {".json", "application/json"},
      {".txt", "text/plain; charset=utf-8"},
      {".woff2", "font/woff2"},
      {".wasm", "application/wasm"},
      {".map", "application/json"}};
  // A browser does not run what it does not know.
  const auto found = kTypes.find(suffix);
  return found == kTypes.end() ? "application/octet-stream" : found->second;
}

}  // namespace

Result<std::map<std::string, bridge::PageFile>> LoadPage(const std::string& folder) {
  std::map<std::string, bridge::PageFile> files;
  size_t bytes = 0;
  std::error_code error;
  for (fs::recursive_directory_iterator it(folder, error), end; !error && it != end;
       it.increment(error)) {
    if (!it->is_regular_file(error)) continue;
    // All files are held in memory, so that a request can never reach the disk.
    Result<std::string> content = ReadFile(it->path().string(), kMostBytes);
    if (!content) return Fail(content.error().message);
    bytes += content->size();
    if (files.size() >= kMostPageFiles || bytes > kMostBytes) {
      return Fail(folder + " holds more than the monitor's page");
    }
    // By the path of a URL; the page itself is at the root.
    const std::string path = "/" + it->path().lexically_relative(folder).generic_string();
    files[path == "/index.html" ? "/" : path] = {TypeOf(it->path().extension().string()),
                                                 std::move(*content)};
  }
  // A folder without the page itself is another folder, named by mistake.
  if (!files.contains("/")) return Fail("there is no page of the monitor in " + folder);
  return files;
}

std::map<std::string, bridge::PageFile> PageOfNoPage() {
  return {
      {"/",
       {"text/html; charset=utf-8",
        "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>Morphbus</title>"
        "<body style=\"font:16px/1.5 sans-serif;max-width:40em;margin:3em auto;padding:0 1em\">"
        "<h1>The page was not built</h1><p>This program was built without Node.js, so it has "
        "no page of its own. Install it (<code>tools/setup</code>) and build again.</p>"
        "<p>Everything else works: connect Foxglove or Lichtblick (Foxglove WebSocket) to this "
        "address, with <code>ws://</code> in place of <code>http://</code>.</p></body></html>\n"}}};
}

}  // namespace morphbus::tools
