#include "compiler/dynarole/keyword_table.h"

namespace morphbus::dynarole {

void KeywordTable::Add(int type, vm::KeywordKind kind, const std::string& spelling,
                       const std::string& name, bool takes_bool) {
  const uint64_t bit = uint64_t{1} << (type & 63);
  const int found = Find(kind, spelling);
  if (found >= 0) {
    Keyword& keyword = all_[static_cast<size_t>(found)];
    keyword.types |= bit;
    keyword.takes_bool = keyword.takes_bool || takes_bool;
    keyword.takes_int = keyword.takes_int || !takes_bool;
    return;
  }
  all_.push_back({kind, spelling, name, bit, takes_bool, !takes_bool});
}

int KeywordTable::Find(vm::KeywordKind kind, const std::string& spelling) const {
  for (size_t i = 0; i < all_.size(); ++i) {
    if (all_[i].kind == kind && all_[i].spelling == spelling) return static_cast<int>(i);
  }
  return -1;
}

std::vector<std::string> KeywordTable::Spellings(vm::KeywordKind kind) const {
  std::vector<std::string> spellings;
  for (const Keyword& keyword : all_) {
    if (keyword.kind == kind) spellings.push_back(keyword.spelling);
  }
  return spellings;
}

}  // namespace morphbus::dynarole
