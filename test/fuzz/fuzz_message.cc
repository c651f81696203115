// Any bytes as a message of each wire type: accepted and re-encodable, or refused; never a crash.
// The first byte of the input picks the type; if the rest lacks a right CRC and fingerprint, the
// message is tried once more with both mended, so that the checks behind them are reached.

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <morphbus/actuator_t.hpp>
#include <morphbus/admit_t.hpp>
#include <morphbus/control_answer_t.hpp>
#include <morphbus/control_t.hpp>
#include <morphbus/health_t.hpp>
#include <morphbus/hello_t.hpp>
#include <morphbus/info_part_t.hpp>
#include <morphbus/leave_t.hpp>
#include <morphbus/log_end_t.hpp>
#include <morphbus/progress_t.hpp>
#include <morphbus/replay_batch_t.hpp>
#include <morphbus/replay_follow_t.hpp>
#include <morphbus/resend_t.hpp>
#include <morphbus/sensors_t.hpp>
#include <morphbus/sim_clock_t.hpp>
#include <morphbus/status_t.hpp>
#include <morphbus/totals_t.hpp>
#include <morphbus/transform_t.hpp>
#include <morphbus/verdict_t.hpp>
#include <morphbus/world_t.hpp>
#include <vector>

#include "bridge/wire/codec.h"
#include "bridge/wire/held_state.h"
#include "bridge/wire/own_sensors.h"
#include "bridge/wire/vm_codec.h"

namespace {

using namespace morphbus;  // The wire types' package.

template <class M>
void TryOne(const std::vector<uint8_t>& bytes) {
  M message;
  if (!bridge::Decode(bytes.data(), bytes.size(), bridge::Expectation{}, &message)) return;
  std::vector<uint8_t> again;
  bridge::Encode(message, &again);
  // Encode leaves the hash with the run's key, which the CRC covers, to the bus that sends.
  std::vector<uint8_t> unsealed = bytes;
  std::fill(unsealed.begin() + bridge::kAuthOffset, unsealed.begin() + bridge::kContentOffset, 0);
  bridge::PatchCrc(unsealed.data(), unsealed.size());
  if (again != unsealed) __builtin_trap();
  if constexpr (std::is_same_v<M, transform_t>) {
    vm::NeighbourMessage neighbour;
    bridge::FromTransform(message, &neighbour);
  }
  if constexpr (std::is_same_v<M, status_t>) (void)bridge::JoinHeld(message.inspections);
  if constexpr (std::is_same_v<M, sensors_t>) {
    // Read for the first module of the part, and for one that is not in it.
    sensors_t own;
    const int first = message.modules.empty() ? 1 : message.modules[0].module_id;
    for (const int module : {first, 65535}) {
      if (!bridge::DecodeOwnSensors(bytes.data(), bytes.size(), {}, static_cast<uint16_t>(module),
                                    &own))
        __builtin_trap();
      if (own.num_modules > 1 || own.num_requests != message.num_requests) __builtin_trap();
    }
  }
}

template <class M>
void Try(std::vector<uint8_t> bytes) {
  TryOne<M>(bytes);
  if (bytes.size() < bridge::kContentOffset + 4) return;
  const auto fingerprint = static_cast<uint64_t>(M::getHash());
  for (size_t i = 0; i < 8; ++i) bytes[i] = static_cast<uint8_t>(fingerprint >> (56 - 8 * i));
  const int32_t protocol = header_t::PROTOCOL;
  for (size_t i = 0; i < 4; ++i) {
    bytes[bridge::kContentOffset + i] =
        static_cast<uint8_t>(static_cast<uint32_t>(protocol) >> (24 - 8 * i));
  }
  bridge::PatchCrc(bytes.data(), bytes.size());
  TryOne<M>(bytes);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size < 1) return 0;
  const std::vector<uint8_t> bytes(data + 1, data + size);
  switch (data[0] % 20) {
    case 0:
      Try<sim_clock_t>(bytes);
      break;
    case 1:
      Try<sensors_t>(bytes);
      break;
    case 2:
      Try<world_t>(bytes);
      break;
    case 3:
      Try<transform_t>(bytes);
      break;
    case 4:
      Try<actuator_t>(bytes);
      break;
    case 5:
      Try<status_t>(bytes);
      break;
    case 6:
      Try<hello_t>(bytes);
      break;
    case 7:
      Try<totals_t>(bytes);
      break;
    case 8:
      Try<health_t>(bytes);
      break;
    case 9:
      Try<info_part_t>(bytes);
      break;
    case 10:
      Try<log_end_t>(bytes);
      break;
    case 11:
      Try<resend_t>(bytes);
      break;
    case 12:
      Try<progress_t>(bytes);
      break;
    case 13:
      Try<verdict_t>(bytes);
      break;
    case 14:
      Try<leave_t>(bytes);
      break;
    case 15:
      Try<admit_t>(bytes);
      break;
    case 16:
      Try<replay_batch_t>(bytes);
      break;
    case 17:
      Try<replay_follow_t>(bytes);
      break;
    case 18:
      Try<control_t>(bytes);
      break;
    default:
      Try<control_answer_t>(bytes);
      break;
  }
  return 0;
}
