#include "bridge/outward/topics.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>

#include <set>

#include "bridge/outward/foxglove.pb.h"
#include "bridge/outward/monitor.pb.h"
#include "compiler/base/check.h"

namespace morphbus::bridge {
namespace {

/// Adds a file behind those that it imports, each once.
void AddFile(const google::protobuf::FileDescriptor& file, std::set<std::string>* added,
             google::protobuf::FileDescriptorSet* set) {
  if (!added->insert(file.name()).second) return;
  for (int i = 0; i < file.dependency_count(); ++i) AddFile(*file.dependency(i), added, set);
  file.CopyTo(set->add_file());
}

}  // namespace

std::string TopicPath(std::string_view source, OutwardTopic topic) {
  return "/" + std::string(source) + "/" + std::string(RowOf(topic).name);
}

std::string SchemaOf(std::string_view message) {
  // The generated files enter themselves into the pool; asking each for something makes sure that
  // the linker keeps them.
  const google::protobuf::DescriptorPool& pool = *foxglove::Log::descriptor()->file()->pool();
  MORPHBUS_CHECK(morphbus::Clock::descriptor()->file()->pool() == &pool);
  const google::protobuf::Descriptor* type = pool.FindMessageTypeByName(std::string(message));
  MORPHBUS_CHECK(type != nullptr);
  google::protobuf::FileDescriptorSet set;
  std::set<std::string> added;
  AddFile(*type->file(), &added, &set);
  return set.SerializeAsString();
}

}  // namespace morphbus::bridge
