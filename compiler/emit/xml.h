#pragma once
// The XML file that extends the role language by a module type's links, joints, connectors and
// state variables (paper, Sec. III B).
//
//   <module version="1" name="MTRAN">
//     <link name="connecting_bar" keyword="LINK_CONNECTING_BAR"/>
//     <joint name="joint_1" keyword="JOINT_1" type="revolute"/>
//     <connector name="c1" keyword="C1">
//       <state name="extended" keyword="EXTENDED" type="bool"/>
//       <state name="mode" keyword="MODE" type="string"><value>slow</value>…</state>
//     </connector>
//   </module>

#include <string>

#include "compiler/emit/keywords.h"

namespace morphbus::emit {

/// The keywords as XML, UTF-8, two blanks an indent. ParseKeywordsXml reads it back unchanged.
std::string KeywordsXml(const ModuleKeywords& keywords);

}  // namespace morphbus::emit
