#include "vm/image/kinematics_verifier.h"

#include "vm/image/image.h"
#include "vm/image/kinematics_checks.h"
#include "vm/image/kinematics_layout.h"

namespace morphbus::vm {

namespace {

using image::ReadU16;
using image::ReadU32;
using image::ReadU64;
namespace layout = kinematics;

/// Reads forward and remembers the first thing that was wrong.
class Reader {
 public:
  Reader(const uint8_t* bytes, uint32_t size, uint32_t begin)
      : bytes_(bytes), size_(size), at_(begin) {}

  /// True if so many bytes are left and nothing was wrong so far.
  bool Need(uint32_t count) {
    if (error_.message == nullptr && size_ - at_ < count) Fail(Reason("image is cut short"));
    return error_.message == nullptr;
  }
  /// Notes what is wrong with the bytes just read, unless something was wrong before.
  void Fail(const char* message) {
    if (error_.message == nullptr) error_ = {message, at_};
  }
  uint8_t U8() { return Need(1) ? bytes_[at_++] : uint8_t{0}; }
  float Float() {
    // One number that is not finite would spread through all that is computed from it.
    if (!Need(4)) return 0;
    const float value = Cell{ReadU32(bytes_ + at_)}.AsFloat();
    if (!IsFinite(value)) Fail(Reason("number is not finite"));
    at_ += 4;
    return value;
  }
  /// Three floats in the order x, y, z.
  Vec3 Vector() {
    Vec3 v;
    v.x = Float();
    v.y = Float();
    v.z = Float();
    return v;
  }
  /// A name; it points into the image.
  Text Name() {
    // A name is its length and its characters.
    const uint8_t length = U8();
    if (length == 0) Fail(Reason("name is empty"));
    if (!Need(length)) return {};
    const Text text{reinterpret_cast<const char*>(bytes_ + at_), length};
    at_ += length;
    return text;
  }
  [[nodiscard]] uint32_t at() const { return at_; }
  [[nodiscard]] const VerifyError& error() const { return error_; }

 private:
  const uint8_t* bytes_;
  uint32_t size_;
  uint32_t at_;
  VerifyError error_;
};

/// The records in the order of their fields (vm/image/kinematics_layout.h).
KinJoint ReadJoint(Reader* in, int num_links) {
  KinJoint joint;
  // The fields are read in the order in which they are stored.
  joint.name = in->Name();
  const uint8_t kind = in->U8();
  if (kind > static_cast<uint8_t>(JointKind::kFixed)) in->Fail(Reason("joint kind is unknown"));
  joint.kind = static_cast<JointKind>(kind);
  joint.link_a = in->U8();
  joint.link_b = in->U8();
  joint.origin_m = in->Vector();
  joint.axis = in->Vector();
  joint.lower_rad = in->Float();
  joint.upper_rad = in->Float();
  joint.speed_rad_s = in->Float();
  // What makes no joint, however it is stored.
  const char* problem = ProblemOf(joint, num_links);
  if (problem != nullptr) in->Fail(problem);
  return joint;
}

KinConnector ReadConnector(Reader* in, int num_links) {
  KinConnector connector;
  connector.name = in->Name();
  connector.link = in->U8();
  if (connector.link >= num_links) in->Fail(Reason("connector sits on no link"));
  // Beyond the last state there is no room for another.
  connector.num_states = in->U8();
  if (connector.num_states > kMaxConnectorStates) in->Fail(Reason("connector has too many states"));
  // State variables keep their order: programs name them, commands number them.
  for (int i = 0; i < connector.num_states && in->error().message == nullptr; ++i) {
    connector.states[i].name = in->Name();
    connector.states[i].num_values = in->U8();
    if (connector.states[i].num_values == 0) in->Fail(Reason("state has no values"));
  }
  return connector;
}

KinSensor ReadSensor(Reader* in, int num_links) {
  KinSensor sensor;
  sensor.name = in->Name();
  const uint8_t kind = in->U8();
  if (kind > static_cast<uint8_t>(SensorKind::kTilt)) {
    // How many values it has, and what its range means, follows from the kind.
    in->Fail("sensor kind is unknown");
    return sensor;
  }
  sensor.kind = static_cast<SensorKind>(kind);
  sensor.link = in->U8();
  sensor.direction = in->Vector();
  sensor.range_m = in->Float();
  if (const char* problem = ProblemOf(sensor, num_links)) in->Fail(problem);
  return sensor;
}

/// Is it an image of ours, whole and unchanged, of a module type that the VM can hold?
VerifyError CheckHeader(const uint8_t* bytes, uint32_t size) {
  if (size < layout::kHeaderBytes) return {Reason("image is cut short"), size};
  if (ReadU32(bytes) != layout::kMagic) return {Reason("not a kinematics image"), 0};
  if (ReadU16(bytes + layout::kVersionAt) != layout::kVersion) {
    return {Reason("version of the image is not supported"), layout::kVersionAt};
  }
  if (size > kMaxImageBytes || ReadU32(bytes + layout::kSizeAt) != size) {
    return {Reason("size does not fit the bytes"), layout::kSizeAt};
  }
  // The hash is no signature: it tells damage only.
  if (ReadU64(bytes + layout::kHashAt) != image::HashOf(bytes, size)) {
    return {Reason("hash does not fit the content"), layout::kHashAt};
  }
  const uint8_t* counts = bytes + layout::kCountsAt;
  return {ProblemOfCounts(counts[0], counts[1], counts[2], counts[3]), layout::kCountsAt};
}

/// `p` points at the record of `c`, which begins at `offset` of the image.
VerifyError CheckConnection(const KinConnection& c, const uint8_t* p, int num_connectors,
                            uint32_t offset) {
  // What is reserved must be 0, so that a later version can give it a meaning.
  if ((p[1] & ~layout::kMemberBFlag) != 0 || ReadU16(p + 6) != 0) {
    return {Reason("reserved bits are set"), offset};
  }
  return {ProblemOf(c, num_connectors), offset};
}

}  // namespace

VerifyError VerifyKinematics(const uint8_t* bytes, uint32_t size, VerifiedKinematics* out) {
  *out = VerifiedKinematics();
  const VerifyError header = CheckHeader(bytes, size);
  if (header.message != nullptr) return header;
  // Filled apart from `out`, which stays empty if anything is wrong.
  VerifiedKinematics k;
  k.bytes_ = bytes;
  k.hash_ = ReadU64(bytes + layout::kHashAt);
  k.model_hash_ = ReadU64(bytes + layout::kModelHashAt);
  k.num_links_ = bytes[layout::kCountsAt];
  k.num_joints_ = bytes[layout::kCountsAt + 1];
  k.num_connectors_ = bytes[layout::kCountsAt + 2];
  k.num_sensors_ = bytes[layout::kCountsAt + 3];

  // The records of unlike sizes, one after the other.
  Reader in(bytes, size, layout::kHeaderBytes);
  k.type_name_ = in.Name();
  for (int i = 0; i < k.num_links_; ++i) k.links_[i].name = in.Name();
  for (int i = 0; i < k.num_joints_; ++i) k.joints_[i] = ReadJoint(&in, k.num_links_);
  for (int i = 0; i < k.num_connectors_; ++i) {
    k.connectors_[i] = ReadConnector(&in, k.num_links_);
  }
  for (int i = 0; i < k.num_sensors_; ++i) k.sensors_[i] = ReadSensor(&in, k.num_links_);
  if (const char* problem = k.NumberSensorValues()) in.Fail(problem);
  // The first error of all that was read, with its byte.
  if (in.error().message != nullptr) return in.error();

  // Connections have one size and fill the rest; they stay encoded, since there may be thousands.
  const uint32_t count = ReadU32(bytes + layout::kConnectionsAt);
  if ((size - in.at()) / layout::kConnectionBytes != count ||
      (size - in.at()) % layout::kConnectionBytes != 0) {
    return {Reason("number of connections does not fit the size"), layout::kConnectionsAt};
  }
  k.connections_begin_ = in.at();
  k.num_connections_ = static_cast<int>(count);
  // They must be sorted, without repeats, so that Find can search by halving.
  uint64_t previous = 0;
  for (uint32_t i = 0; i < count; ++i) {
    const uint32_t offset = in.at() + i * layout::kConnectionBytes;
    const KinConnection c = k.connection(static_cast<int>(i));
    const VerifyError error = CheckConnection(c, bytes + offset, k.num_connectors_, offset);
    if (error.message != nullptr) return error;
    const uint64_t key = KeyOf(c);
    if (i > 0 && key <= previous) return {Reason("connections are not in order"), offset};
    previous = key;
  }
  k.GroupLinks();
  *out = k;
  return {};
}

}  // namespace morphbus::vm
