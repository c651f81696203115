#include "compiler/source/name_table.h"

#include <algorithm>
#include <tuple>
#include <utility>

namespace morphbus::source {

int NameTable::Add(NameKind kind, std::string name, int owner) {
  NamedThing thing;
  thing.kind = kind;
  thing.name = std::move(name);
  thing.owner = owner;
  things.push_back(std::move(thing));
  return static_cast<int>(things.size()) - 1;
}

int NameTable::Declare(NameKind kind, const std::string& name, const Span& span, int owner) {
  const int thing = Add(kind, name, owner);
  things[thing].extent = span;
  Use(span, thing, true);
  return thing;
}

void NameTable::Use(const Span& span, int thing, bool declares) {
  if (thing >= 0 && span.file >= 0 && span.begin < span.end)
    uses.push_back({span, thing, declares});
}

void NameTable::Sort() {
  const auto place = [](const NameUse& use) {
    return std::tuple(use.span.file, use.span.begin, use.span.end, !use.declares);
  };
  std::stable_sort(uses.begin(), uses.end(),
                   [&](const NameUse& x, const NameUse& y) { return place(x) < place(y); });
  // A checker that looks at a text several times sees a name as often.
  const auto same = [](const NameUse& x, const NameUse& y) {
    return x.span.file == y.span.file && x.span.begin == y.span.begin && x.thing == y.thing;
  };
  uses.erase(std::unique(uses.begin(), uses.end(), same), uses.end());
}

const NameUse* NameTable::At(int file, size_t offset) const {
  // The last use that begins at or before the place; names do not lie within each other.
  const auto after = std::upper_bound(uses.begin(), uses.end(), std::pair(file, offset),
                                      [](const auto& at, const NameUse& use) {
                                        return at < std::pair(use.span.file, use.span.begin);
                                      });
  if (after == uses.begin()) return nullptr;
  const NameUse& use = *std::prev(after);
  return use.span.file == file && offset <= use.span.end ? &use : nullptr;
}

int NameTable::Find(NameKind kind, const std::string& name, int owner) const {
  for (size_t i = 0; i < things.size(); ++i) {
    const NamedThing& thing = things[i];
    if (thing.kind == kind && thing.owner == owner && thing.name == name)
      return static_cast<int>(i);
  }
  return -1;
}

}  // namespace morphbus::source
