#pragma once
// The little that the XML back ends share.

#include <pugixml.hpp>
#include <string>

namespace morphbus::emit {

/// The declaration that every document of ours begins with.
void StartXml(pugi::xml_document* document);
/// UTF-8, two blanks an indent.
std::string XmlText(const pugi::xml_document& document);

void Set(pugi::xml_node node, const std::string& attribute, const std::string& value);
/// <element>text</element>; returns the element.
pugi::xml_node AppendText(pugi::xml_node parent, const char* element, const std::string& text);
/// A comment as the next child; "--", which XML forbids there, becomes "- -".
void Comment(pugi::xml_node parent, std::string text);

}  // namespace morphbus::emit
