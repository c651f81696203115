#include "compiler/emit/xml_text.h"

#include <sstream>

namespace morphbus::emit {

void StartXml(pugi::xml_document* document) {
  pugi::xml_node declaration = document->append_child(pugi::node_declaration);
  declaration.append_attribute("version") = "1.0";
  declaration.append_attribute("encoding") = "UTF-8";
}

std::string XmlText(const pugi::xml_document& document) {
  std::ostringstream out;
  document.save(out, "  ", pugi::format_indent, pugi::encoding_utf8);
  return out.str();
}

void Set(pugi::xml_node node, const std::string& attribute, const std::string& value) {
  node.append_attribute(attribute.c_str()) = value.c_str();
}

pugi::xml_node AppendText(pugi::xml_node parent, const char* element, const std::string& text) {
  pugi::xml_node node = parent.append_child(element);
  node.append_child(pugi::node_pcdata).set_value(text.c_str());
  return node;
}

void Comment(pugi::xml_node parent, std::string text) {
  for (size_t at = text.find("--"); at != std::string::npos; at = text.find("--", at)) {
    text.insert(at + 1, " ");
  }
  parent.append_child(pugi::node_comment).set_value((" " + text + " ").c_str());
}

}  // namespace morphbus::emit
