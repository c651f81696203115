#pragma once
// The little that all writers of XML share: the keywords and the back ends.

#include <initializer_list>
#include <pugixml.hpp>
#include <string>
#include <utility>

namespace morphbus::xml {

/// The declaration that every document of ours begins with.
void Start(pugi::xml_document* document);
/// UTF-8, two blanks an indent.
std::string Text(const pugi::xml_document& document);

/// Attributes of an element as they stand in it, from the first: {{"name", "m1"}, {"type",
/// "fixed"}}.
using Attributes = std::initializer_list<std::pair<const char*, std::string>>;

/// Appends <element attribute="value" .../> to the parent's children and returns it.
pugi::xml_node Append(pugi::xml_node parent, const char* element, Attributes attributes = {});
/// Adds one more attribute, for those that not every element of the kind has.
void Set(pugi::xml_node node, const char* attribute, const std::string& value);
/// Appends <element>text</element> and returns it.
pugi::xml_node AppendText(pugi::xml_node parent, const char* element, const std::string& text);
/// A comment as the next child; "--", which XML forbids there, becomes "- -".
void Comment(pugi::xml_node parent, std::string text);

}  // namespace morphbus::xml
