#include "compiler/keywords/xml_text.h"

#include <sstream>

namespace morphbus::xml {

void Start(pugi::xml_document* document) {
  // Readers may take the encoding from it, though UTF-8 is what XML has without it.
  pugi::xml_node declaration = document->append_child(pugi::node_declaration);
  Set(declaration, "version", "1.0");
  Set(declaration, "encoding", "UTF-8");
}

std::string Text(const pugi::xml_document& document) {
  std::ostringstream out;
  // pugixml escapes what needs it.
  document.save(out, "  ", pugi::format_indent, pugi::encoding_utf8);
  return out.str();
}

pugi::xml_node Append(pugi::xml_node parent, const char* element, Attributes attributes) {
  pugi::xml_node node = parent.append_child(element);
  for (const auto& [name, value] : attributes) Set(node, name, value);
  return node;
}

void Set(pugi::xml_node node, const char* attribute, const std::string& value) {
  node.append_attribute(attribute) = value.c_str();
}

pugi::xml_node AppendText(pugi::xml_node parent, const char* element, const std::string& text) {
  pugi::xml_node node = parent.append_child(element);
  node.append_child(pugi::node_pcdata).set_value(text.c_str());
  return node;
}

void Comment(pugi::xml_node parent, std::string text) {
  // Every pair is parted, also in a longer row of them.
  // XML allows no "--" within a comment.
  for (size_t at = text.find("--"); at != std::string::npos; at = text.find("--", at)) {
    text.insert(at + 1, " ");
  }
  parent.append_child(pugi::node_comment).set_value((" " + text + " ").c_str());
}

}  // namespace morphbus::xml
