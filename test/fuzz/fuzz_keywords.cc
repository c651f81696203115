// Any bytes as a module type's keywords in XML: refused with a message, or read, written and read
// again unchanged.

#include <cstdint>
#include <string_view>

#include "compiler/keywords/keywords_xml.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace morphbus::keywords;  // Everything under test.
  const auto keywords = ParseKeywordsXml({reinterpret_cast<const char*>(data), size});
  if (!keywords) {
    if (keywords.error().message.empty()) __builtin_trap();
    return 0;
  }
  const std::string text = KeywordsXml(*keywords);
  const auto again = ParseKeywordsXml(text);
  if (!again || KeywordsXml(*again) != text) __builtin_trap();
  return 0;
}
