#include "bridge/bus/channel_filter.h"

#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <string_view>
#include <utility>

#include "bridge/bus/lcm_datagrams.h"

namespace morphbus::bridge {
namespace {

constexpr uint32_t kMagicOffset = 8;     // After the UDP header.
constexpr uint32_t kChannelOffset = 16;  // After LCM's magic and sequence number.

/// With more instructions than this, names are told apart by a hash instead of one by one. The
/// kernel makes of a load some thirteen instructions of its own, of eight bytes each, and others
/// one or two. Twice the memory of such a program, for the old one goes when the new one is there,
/// is within what kernels before 6.8 give a socket (net.core.optmem_max, 20480 bytes).
constexpr size_t kMostInstructions = 160;

/// Topics whose names are told apart by a hash, and how many names are worth it.
constexpr size_t kMostTopics = 3;
constexpr size_t kManyNames = 8;

/// Of a name that is longer than this nothing is told apart: it passes. Hashing it all would take
/// more memory than there is.
constexpr size_t kLongestHashed = 24;

/// FNV-1a (Fowler, Noll, Vo) with 32 bits, which needs no table and two instructions a byte.
constexpr uint32_t kHashBasis = 2166136261, kHashPrime = 16777619;

/// The highest bits of a hash are mixed best: five choose one of 32 words, five more a bit in it.
constexpr uint32_t kWordShift = 27, kBitShift = 22, kLowestFive = 31;

/// Instruction: load 1, 2 or 4 bytes at an offset from the UDP header, in network order.
sock_filter Load(uint16_t width, uint32_t offset) {
  return BPF_STMT(static_cast<uint16_t>(BPF_LD | width | BPF_ABS), offset);
}

/// Instruction: pass so many bytes of the packet; 0 drops it.
sock_filter Return(uint32_t bytes) { return BPF_STMT(BPF_RET | BPF_K, bytes); }

/// Instruction: skip so many instructions, depending on whether what was loaded is `value`.
sock_filter JumpIfEqual(uint32_t value, uint8_t if_equal, uint8_t if_not) {
  return BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, value, if_equal, if_not);
}

/// The text's bytes from `at`, as many as a load takes, as a number in network order.
uint32_t NumberAt(const char* text, size_t at, size_t bytes) {
  uint32_t value = 0;
  for (size_t i = 0; i < bytes; ++i) value = value << 8 | static_cast<uint8_t>(text[at + i]);
  return value;
}

/// Instruction: the accumulator becomes the result of an operation with a number.
sock_filter Compute(uint16_t operation, uint32_t number) {
  return BPF_STMT(static_cast<uint16_t>(BPF_ALU | operation | BPF_K), number);
}

/// The same with the index register.
sock_filter ComputeWithIndex(uint16_t operation) {
  return BPF_STMT(static_cast<uint16_t>(BPF_ALU | operation | BPF_X), 0);
}

/// Instruction: skip so many instructions.
sock_filter Jump(size_t instructions) {
  return BPF_STMT(BPF_JMP | BPF_JA, static_cast<uint32_t>(instructions));
}

/// Appends: if the channel begins with the prefix, and somewhere behind it the suffix begins, pass;
/// else drop.
void AppendPattern(const ChannelPattern& pattern, std::vector<sock_filter>* program) {
  const auto prefix = static_cast<uint32_t>(pattern.prefix.size());
  for (uint32_t at = 0; at < prefix; ++at) {
    program->push_back(Load(BPF_B, kChannelOffset + at));
    program->push_back(JumpIfEqual(NumberAt(pattern.prefix.c_str(), at, 1), 1, 0));
    program->push_back(Return(0));
  }
  // The name between them has a length from 1 on; a packet that ends before is dropped.
  const uint32_t suffix = NumberAt(pattern.suffix.c_str(), 0, 4);
  for (uint32_t name = 1; prefix + name + pattern.suffix.size() <= kMaxChannelName; ++name) {
    program->push_back(Load(BPF_W, kChannelOffset + prefix + name));
    program->push_back(JumpIfEqual(suffix, 0, 1));
    program->push_back(Return(UINT32_MAX));
  }
}

/// Bytes at the channel's place, as one load takes them.
struct Chunk {
  uint16_t width;
  uint32_t offset, value;
};

/// The first `size` bytes of the text in chunks of 4, 2, 1.
std::vector<Chunk> ChunksOf(const char* text, size_t size) {
  std::vector<Chunk> chunks;
  for (size_t at = 0; at < size;) {
    const size_t bytes = size - at >= 4 ? 4 : (size - at >= 2 ? 2 : 1);
    const uint16_t width = bytes == 4 ? BPF_W : (bytes == 2 ? BPF_H : BPF_B);
    chunks.push_back(
        {width, kChannelOffset + static_cast<uint32_t>(at), NumberAt(text, at, bytes)});
    at += bytes;
  }
  return chunks;
}

/// Whether only some of the channel's messages are of interest.
bool IsConditional(const Interest& interest) { return interest.width == 1 || interest.width == 2; }

/// Appends: if the bytes at the channel's place are the channel and a NUL, pass what of it is of
/// interest and drop the rest; else fall through.
void AppendChannel(const ChannelInterest& wanted, std::vector<sock_filter>* program) {
  const std::string& channel = wanted.channel;
  const Interest& interest = wanted.interest;
  const bool conditional = IsConditional(interest);
  // Never beyond the NUL, since a load past the packet rejects it.
  const size_t size = channel.size() + 1;
  const std::vector<Chunk> chunks = ChunksOf(channel.c_str(), size);
  // At most 64 / 4 + 2 chunks of two instructions: the jumps fit into 8 bits.
  const size_t tail = conditional ? 4 : 1;
  for (size_t i = 0; i < chunks.size(); ++i) {
    // To behind this channel's last instruction.
    const size_t after = 2 * (chunks.size() - i - 1) + tail;
    program->push_back(Load(chunks[i].width, chunks[i].offset));
    program->push_back(JumpIfEqual(chunks[i].value, 0, static_cast<uint8_t>(after)));
  }
  if (conditional) {
    // A payload that is too short for the number drops the packet here, as it should.
    const auto payload = kChannelOffset + static_cast<uint32_t>(size);
    program->push_back(Load(interest.width == 2 ? BPF_H : BPF_B, payload + interest.offset));
    program->push_back(
        JumpIfEqual(interest.value, interest.unless ? 0 : 1, interest.unless ? 1 : 0));
    program->push_back(Return(0));
  }
  program->push_back(Return(UINT32_MAX));
}

/// Names of one topic of a run as the bits of their hashes: a name that is in has its bit set, and
/// of a thousand others so many seem to be in as there are bits set.
struct NameSet {
  uint32_t topic = 0;  ///< The topic's first four characters, its NUL among them if it has three.
  std::array<uint32_t, 32> words = {};

  void Add(std::string_view name) {
    uint32_t hash = kHashBasis;
    for (const char c : name) hash = (hash ^ static_cast<uint8_t>(c)) * kHashPrime;
    words[hash >> kWordShift] |= uint32_t{1} << (hash >> kBitShift & kLowestFive);
  }
};

/// Channels RUN/NAME/TOPIC of one run, by topics of which there are many names.
struct ManyNames {
  std::string prefix;  ///< The run's name with its slash; empty if there is nothing in it.
  std::vector<NameSet> sets;
  size_t longest = 0;  ///< Of the names in the sets, characters.
};

/// Appends: if the accumulator is the set's topic and the index register the hash of a name in it,
/// pass; else fall through, with the accumulator as it was if it is another topic.
void AppendSet(const NameSet& set, std::vector<sock_filter>* program) {
  std::vector<sock_filter> steps = {BPF_STMT(BPF_MISC | BPF_TXA, 0), Compute(BPF_RSH, kWordShift)};
  // There are no tables: the word is found by comparing. Three instructions for each.
  const auto used = static_cast<size_t>(
      std::count_if(set.words.begin(), set.words.end(), [](uint32_t word) { return word != 0; }));
  size_t left = 3 * used;
  for (uint32_t i = 0; i < set.words.size(); ++i) {
    if (set.words[i] == 0) continue;
    left -= 3;
    steps.push_back(JumpIfEqual(i, 0, 2));
    steps.push_back(BPF_STMT(BPF_LD | BPF_IMM, set.words[i]));
    steps.push_back(Jump(left + 1));
  }
  // None of the set's words is the hash's: no such name is in the set.
  steps.push_back(Return(0));
  // The word is in the accumulator; its bit decides that the hash's next five bits name.
  steps.push_back(BPF_STMT(BPF_ST, 0));
  steps.push_back(BPF_STMT(BPF_MISC | BPF_TXA, 0));
  steps.push_back(Compute(BPF_RSH, kBitShift));
  steps.push_back(Compute(BPF_AND, kLowestFive));
  steps.push_back(BPF_STMT(BPF_MISC | BPF_TAX, 0));
  steps.push_back(BPF_STMT(BPF_LD | BPF_MEM, 0));
  steps.push_back(ComputeWithIndex(BPF_RSH));
  steps.push_back(Compute(BPF_AND, 1));
  steps.push_back(JumpIfEqual(1, 0, 1));
  steps.push_back(Return(UINT32_MAX));
  steps.push_back(Return(0));
  // At most 110 instructions, so that the jump fits into 8 bits.
  program->push_back(JumpIfEqual(set.topic, 0, static_cast<uint8_t>(steps.size())));
  program->insert(program->end(), steps.begin(), steps.end());
}

/// Appends: if the channel is of this run, and of a topic with many names, pass those names and
/// drop others; else fall through.
void AppendManyNames(const ManyNames& many, std::vector<sock_filter>* program) {
  const auto prefix = static_cast<uint32_t>(many.prefix.size());
  std::vector<sock_filter> sets;
  for (const NameSet& set : many.sets) AppendSet(set, &sets);
  // The hash goes byte by byte up to the slash, behind which the topic begins.
  std::vector<sock_filter> hash = {BPF_STMT(BPF_LDX | BPF_IMM, kHashBasis)};
  constexpr size_t kStepsAByte = 7;
  const auto steps = static_cast<uint32_t>(std::min(many.longest, kLongestHashed)) + 1;
  for (uint32_t i = 0; i < steps; ++i) {
    const uint32_t at = kChannelOffset + prefix + i;
    hash.push_back(Load(BPF_B, at));
    hash.push_back(JumpIfEqual('/', 0, 2));
    hash.push_back(Load(BPF_W, at + 1));
    // To behind the last byte's steps and the jump that follows them.
    hash.push_back(Jump(kStepsAByte * (steps - i - 1) + 4));
    hash.push_back(ComputeWithIndex(BPF_XOR));
    hash.push_back(Compute(BPF_MUL, kHashPrime));
    hash.push_back(BPF_STMT(BPF_MISC | BPF_TAX, 0));
  }
  hash.push_back(many.longest > kLongestHashed ? Return(UINT32_MAX) : Jump(sets.size()));
  // Of another run nothing is hashed.
  const std::vector<Chunk> chunks = ChunksOf(many.prefix.c_str(), prefix);
  for (size_t i = 0; i < chunks.size(); ++i) {
    program->push_back(Load(chunks[i].width, chunks[i].offset));
    program->push_back(JumpIfEqual(chunks[i].value, 1, 0));
    program->push_back(Jump(3 * (chunks.size() - i - 1) + hash.size() + sets.size()));
  }
  program->insert(program->end(), hash.begin(), hash.end());
  program->insert(program->end(), sets.begin(), sets.end());
}

/// Takes out of `channels` those of which there are many in one run and topic.
ManyNames TakeManyNames(std::vector<ChannelInterest>* channels) {
  // The channels by run and topic; what is not called RUN/NAME/TOPIC stays as it is.
  std::map<std::string, std::map<uint32_t, std::vector<std::string>>> names;
  const auto split = [](const ChannelInterest& channel, std::string* prefix, uint32_t* topic) {
    const std::string& text = channel.channel;
    const size_t first = text.find('/');
    const size_t last = text.rfind('/');
    // Of a topic four bytes are looked at; the last of them may be its NUL.
    if (IsConditional(channel.interest) || first == last || text.size() - last < 4) return false;
    if (text.find('/', first + 1) != last) return false;
    *prefix = text.substr(0, first + 1);
    *topic = NumberAt(text.c_str(), last + 1, 4);
    return true;
  };
  std::string prefix;
  uint32_t topic = 0;
  for (const ChannelInterest& channel : *channels) {
    if (!split(channel, &prefix, &topic)) continue;
    const std::string& text = channel.channel;
    names[prefix][topic].push_back(text.substr(prefix.size(), text.rfind('/') - prefix.size()));
  }
  // A bus with this many channels has them of one run.
  ManyNames many;
  size_t most = 0;
  for (const auto& [run, topics] : names) {
    size_t count = 0;
    for (const auto& [word, members] : topics) count += members.size();
    if (count > most) most = count, many.prefix = run;
  }
  // The topics with the most names go into sets; those with few are compared one by one, which
  // costs less.
  std::vector<std::pair<size_t, uint32_t>> sizes;
  for (const auto& [word, members] : names[many.prefix]) {
    if (members.size() >= kManyNames) sizes.emplace_back(members.size(), word);
  }
  std::sort(sizes.rbegin(), sizes.rend());
  sizes.resize(std::min(sizes.size(), kMostTopics));
  for (const auto& [size, word] : sizes) {
    NameSet& set = many.sets.emplace_back();
    set.topic = word;
    // The longest name decides over how many bytes the program hashes: a filter has no loops.
    for (const std::string& name : names[many.prefix][word]) {
      set.Add(name);
      many.longest = std::max(many.longest, name.size());
    }
  }
  // What a set tells is not compared once more.
  std::erase_if(*channels, [&](const ChannelInterest& channel) {
    return split(channel, &prefix, &topic) && prefix == many.prefix &&
           std::any_of(many.sets.begin(), many.sets.end(),
                       [&](const NameSet& set) { return set.topic == topic; });
  });
  return many;
}

/// The program for these channels, in order of length, for those of many names, and the pattern.
std::vector<sock_filter> Assemble(const std::vector<ChannelInterest>& channels,
                                  const ManyNames& many, const ChannelPattern& pattern) {
  std::vector<sock_filter> program = {Load(BPF_W, kMagicOffset), JumpIfEqual(kLcmShortMagic, 1, 0),
                                      Return(0)};
  for (const ChannelInterest& channel : channels) AppendChannel(channel, &program);
  // What the rest drops for its size has had its turn by name.
  if (!many.sets.empty()) AppendManyNames(many, &program);
  if (!pattern.prefix.empty() && pattern.suffix.size() >= 4) AppendPattern(pattern, &program);
  program.push_back(Return(0));
  return program;
}

}  // namespace

std::vector<sock_filter> BuildChannelFilter(std::vector<ChannelInterest> channels,
                                            const ChannelPattern& pattern) {
  // Short names first: comparing with a name never reads beyond packets of names at least as long,
  // so no packet is rejected for its size before its own name had its turn.
  std::sort(channels.begin(), channels.end(),
            [](const ChannelInterest& a, const ChannelInterest& b) {
              const size_t size = a.channel.size();
              return size != b.channel.size() ? size < b.channel.size() : a.channel < b.channel;
            });
  std::vector<sock_filter> program = Assemble(channels, {}, pattern);
  if (program.size() > kMostInstructions) {
    // What the pattern passes anyway needs no other place.
    std::erase_if(channels, [&](const ChannelInterest& channel) {
      return !pattern.prefix.empty() && channel.channel.starts_with(pattern.prefix) &&
             channel.channel.ends_with(pattern.suffix);
    });
    const ManyNames many = TakeManyNames(&channels);
    program = Assemble(channels, many, pattern);
  }
  if (program.size() > BPF_MAXINSNS) program.clear();
  return program;
}

bool AttachFilter(int fd, const std::vector<sock_filter>& program) {
  const auto attach = [&] {
    sock_fprog description = {};
    description.len = static_cast<uint16_t>(program.size());
    description.filter = const_cast<sock_filter*>(program.data());
    return setsockopt(fd, SOL_SOCKET, SO_ATTACH_FILTER, &description, sizeof description) == 0;
  };
  if (!program.empty() && attach()) return true;
  // Without the earlier one there may be room. It must not stay in any case, for it drops what is
  // wanted now; if there is none this fails, which is what we want.
  const int unused = 0;
  setsockopt(fd, SOL_SOCKET, SO_DETACH_FILTER, &unused, sizeof unused);
  return program.empty() || attach();
}

}  // namespace morphbus::bridge
