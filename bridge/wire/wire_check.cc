#include <string>
#include <type_traits>

#include "bridge/wire/codec.h"
#include "bridge/wire/wire_limits.h"
#include "bridge/wire/wire_reader.h"

namespace morphbus::bridge {

template <class M>
Result<void> CheckWire(const uint8_t* data, size_t size) {
  // The end of a log stands in a file and lists every channel; all else travels as one datagram.
  if (!std::is_same_v<M, morphbus::log_end_t> && size > kMaxPayloadBytes) {
    return Fail("the message has " + std::to_string(size) + " bytes, more than " +
                std::to_string(kMaxPayloadBytes));
  }
  // Every field is read once, in order; the bytes must end where the fields do.
  WireReader reader(M::getTypeName(), data, size);
  reader.SkipFingerprint();
  Walk(reader, layout::As<M>());
  if (reader.ok()) reader.ExpectEnd();
  if (reader.ok()) return {};
  return Fail(reader.failure());
}

// Every type that travels on a channel of its own, or stands in a log. The others are parts of
// these, and are checked with them.
template Result<void> CheckWire<morphbus::sensors_t>(const uint8_t*, size_t);
template Result<void> CheckWire<morphbus::world_t>(const uint8_t*, size_t);
template Result<void> CheckWire<morphbus::sim_clock_t>(const uint8_t*, size_t);
template Result<void> CheckWire<morphbus::transform_t>(const uint8_t*, size_t);
template Result<void> CheckWire<morphbus::actuator_t>(const uint8_t*, size_t);
template Result<void> CheckWire<morphbus::status_t>(const uint8_t*, size_t);
template Result<void> CheckWire<morphbus::resend_t>(const uint8_t*, size_t);
template Result<void> CheckWire<morphbus::progress_t>(const uint8_t*, size_t);
template Result<void> CheckWire<morphbus::totals_t>(const uint8_t*, size_t);
template Result<void> CheckWire<morphbus::verdict_t>(const uint8_t*, size_t);
template Result<void> CheckWire<morphbus::leave_t>(const uint8_t*, size_t);
template Result<void> CheckWire<morphbus::admit_t>(const uint8_t*, size_t);
template Result<void> CheckWire<morphbus::replay_batch_t>(const uint8_t*, size_t);
template Result<void> CheckWire<morphbus::replay_follow_t>(const uint8_t*, size_t);
template Result<void> CheckWire<morphbus::hello_t>(const uint8_t*, size_t);
template Result<void> CheckWire<morphbus::health_t>(const uint8_t*, size_t);
template Result<void> CheckWire<morphbus::info_part_t>(const uint8_t*, size_t);
template Result<void> CheckWire<morphbus::control_t>(const uint8_t*, size_t);
template Result<void> CheckWire<morphbus::control_answer_t>(const uint8_t*, size_t);
template Result<void> CheckWire<morphbus::log_end_t>(const uint8_t*, size_t);

}  // namespace morphbus::bridge
