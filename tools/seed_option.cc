#include "tools/seed_option.h"

#include <CLI/CLI.hpp>
#include <charconv>

namespace morphbus::tools {

CLI::Option* AddSeed(CLI::App* sub, uint64_t* seed, const std::string& what) {
  const auto check = [](const std::string& text) {
    uint64_t value = 0;
    const char* end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), end, value);
    return error == std::errc() && stop == end ? std::string()
                                               : "a seed is a whole number, 0 to 2^64 - 1";
  };
  return sub->add_option("--seed", *seed, what)->check(CLI::Validator(check, ""));
}

}  // namespace morphbus::tools
