#include "vm/space/bodies.h"

#include <initializer_list>

namespace morphbus::vm {

namespace {

/// By which a table is sorted: the module, then its joint.
uint32_t KeyOf(const BodyRecord& record) {
  return static_cast<uint32_t>(record.module) << 8 | record.joint;
}

/// Where a joint stands, or would stand, in the table. The search begins at `near` if that is not
/// beyond it: for joints in order all searches together pass through the table once.
int LowerBound(const BodyTable& table, uint32_t key, int near = 0) {
  int i = near > 0 && near <= table.num && KeyOf(table.records[near - 1]) < key ? near : 0;
  while (i < table.num && KeyOf(table.records[i]) < key) ++i;
  return i;
}

/// Takes a record out and closes the gap.
void Remove(BodyTable* table, int at) {
  for (int i = at; i + 1 < table->num; ++i) table->records[i] = table->records[i + 1];
  --table->num;
}

/// Joints that touch the body now.
int CountLive(const BodyTable& table) {
  int live = 0;
  for (int i = 0; i < table.num; ++i) live += table.records[i].live;
  return live;
}

/// Frees a place by forgetting the joint that has been gone for longest; false if all are live.
bool ForgetOne(BodyTable* table) {
  int oldest = -1;
  for (int i = 0; i < table->num; ++i) {
    const BodyRecord& record = table->records[i];
    if (record.live != 0) continue;
    if (oldest < 0 || record.stamp < table->records[oldest].stamp) oldest = i;
  }
  if (oldest >= 0) Remove(table, oldest);
  return oldest >= 0;
}

/// Accepts news of a joint; false if there is no room for it. `*near` is a place from which its own
/// is searched (LowerBound), and becomes that place.
bool Accept(const BodyRecord& news, BodyTable* table, int* near) {
  // Old news, which other ways around a loop bring again and again, changes nothing.
  int at = LowerBound(*table, KeyOf(news), *near);
  *near = at;
  const bool known = at < table->num && KeyOf(table->records[at]) == KeyOf(news);
  if (known && news.stamp <= table->records[at].stamp) return true;
  // Joints that touch the body are limited by one capacity, all records by another.
  if (!known || table->records[at].live == 0) {
    if (CountLive(*table) == kMaxBodyJoints) return false;
  }
  // A new joint gets its place in the order, if need be that of one which is gone.
  if (!known) {
    if (table->num == kMaxBodyRecords) {
      if (!ForgetOne(table)) return false;
      at = LowerBound(*table, KeyOf(news));
    }
    for (int i = table->num; i > at; --i) table->records[i] = table->records[i - 1];
    ++table->num;
  }
  table->records[at] = news;
  return true;
}

/// Stamps the own joints with this tick: no other module knows better that they are there. Sets the
/// bits of bodies without room in `overflow`.
void AddOwnJoints(Context& context, uint32_t* overflow) {
  for (int j = 0; j < context.kinematics.num_joints(); ++j) {
    const KinJoint& joint = context.kinematics.joint(j);
    if (joint.kind == JointKind::kFixed) continue;
    BodyRecord own;
    own.module = context.config.module_id;
    own.joint = static_cast<uint8_t>(j);
    own.live = 1;
    own.stamp = own.refreshed_tick = static_cast<int32_t>(context.state.tick);
    for (const int link : {joint.link_a, joint.link_b}) {
      const int body = context.kinematics.BodyLink(link);
      int near = 0;
      if (!Accept(own, &context.state.bodies[body], &near)) *overflow |= 1u << body;
    }
  }
}

/// Takes what the neighbour on connector c says of the body that we share with it.
void MergeMessage(Context& context, int c, const NeighbourMessage& message, uint32_t* overflow) {
  const NeighbourRecord& neighbour = context.state.neighbours[c];
  if (!neighbour.linked) return;
  const int body = context.kinematics.BodyLink(context.kinematics.connector(c).link);
  const int64_t tick = context.state.tick;
  // What a neighbour says of a body is in the order of our table.
  int near = 0;
  for (int i = 0; i < message.num_body_entries; ++i) {
    const BodyEntry& entry = message.body_entries[i];
    if (entry.link != neighbour.neighbour_body_link || entry.joint >= kMaxJoints) continue;
    // Stamps too old to be remembered, or from a clock that runs ahead, are not believed.
    if (entry.stamp <= tick - kBodyMemoryTicks || entry.stamp > tick + kMaxTickAhead) continue;
    // Of our own joints we know best.
    if (entry.module == context.config.module_id &&
        entry.joint >= context.kinematics.num_joints()) {
      continue;
    }
    BodyRecord news;
    news.module = entry.module;
    news.joint = entry.joint;
    news.live = 1;
    // A body that is told in turns brings news of each joint only so often.
    const int turns = message.body_turns > 1 ? 2 * message.body_turns : 0;
    const int grace = context.config.grace_ticks + turns;
    news.grace_ticks = static_cast<uint8_t>(grace < 255 ? grace : 255);
    news.stamp = static_cast<int32_t>(entry.stamp);
    news.refreshed_tick = static_cast<int32_t>(tick);
    if (!Accept(news, &context.state.bodies[body], &near)) *overflow |= 1u << body;
  }
}

/// Joints without news for too long are gone; their records go when no old news can be under way.
void Age(int64_t tick, BodyTable* table) {
  for (int i = table->num - 1; i >= 0; --i) {
    BodyRecord& record = table->records[i];
    if (tick - record.refreshed_tick > record.grace_ticks) record.live = 0;
    if (record.live == 0 && record.stamp <= tick - kBodyMemoryTicks) Remove(table, i);
  }
}

/// True if the joint touches the body now.
bool IsLive(const BodyTable& table, uint32_t key) {
  const int at = LowerBound(table, key);
  return at < table.num && KeyOf(table.records[at]) == key && table.records[at].live != 0;
}

}  // namespace

void UpdateBodies(Context& context, const Inbox& inbox) {
  // The own joints come first, so that a full table never lacks them.
  uint32_t overflow = 0;
  AddOwnJoints(context, &overflow);
  for (int c = 0; c < context.kinematics.num_connectors(); ++c) {
    if (inbox.from[c] != nullptr) MergeMessage(context, c, *inbox.from[c], &overflow);
  }
  // A body with too many joints is told of once, until it has room again.
  for (int i = 0; i < context.kinematics.num_links(); ++i) {
    BodyTable& table = context.state.bodies[i];
    Age(context.state.tick, &table);
    const bool full = (overflow >> i & 1u) != 0;
    if (full && !table.overflow_told) {
      Report(context, {.code = FaultCode::kTooManyBodyJoints,
                       .link = static_cast<int8_t>(i),
                       .limit = kMaxBodyJoints});
    }
    table.overflow_told = full;
  }
}

int DegreeOf(const Context& context, int link) {
  return CountLive(context.state.bodies[context.kinematics.BodyLink(link)]);
}

int AdjacentOf(const Context& context, int joint) {
  const KinJoint& j = context.kinematics.joint(joint);
  const BodyTable& a = context.state.bodies[context.kinematics.BodyLink(j.link_a)];
  const BodyTable& b = context.state.bodies[context.kinematics.BodyLink(j.link_b)];
  // The union of both bodies' joints, less the joint itself, which touches both.
  int joints = CountLive(a);
  for (int i = 0; i < b.num; ++i) {
    const BodyRecord& record = b.records[i];
    if (record.live != 0 && !IsLive(a, KeyOf(record))) ++joints;
  }
  return joints - 1;
}

void AddBodies(const Context& context, Digest* digest) {
  for (int i = 0; i < context.kinematics.num_links(); ++i) {
    const BodyTable& table = context.state.bodies[i];
    for (int k = 0; k < table.num; ++k) {
      if (table.records[k].live != 0) digest->Add(int64_t{KeyOf(table.records[k])});
    }
    // Marks where one body ends, so that a joint that moves to the next one shows.
    digest->Add(-1);
  }
}

void FillBodies(const Context& context, int room, NeighbourMessage* message) {
  // Only bodies that reach to a neighbour are of use to it.
  message->body_turns = 1;
  message->num_body_entries = 0;
  uint32_t docked = 0;
  for (int i = 0; i < message->num_docked; ++i) docked |= 1u << message->docked[i].body_link;
  int total = 0;
  for (int i = 0; i < context.kinematics.num_links(); ++i) {
    if ((docked >> i & 1u) != 0) total += CountLive(context.state.bodies[i]);
  }
  if (total == 0 || room <= 0) return;
  if (room > kMaxMessageBodyEntries) room = kMaxMessageBodyEntries;
  // What does not fit into one message is told in turns, as many as it takes.
  const int turns = (total + room - 1) / room;
  const int first =
      static_cast<int>(static_cast<uint32_t>(context.state.tick) % static_cast<uint32_t>(turns)) *
      room;
  message->body_turns = static_cast<uint8_t>(turns);
  int at = 0;
  for (int i = 0; i < context.kinematics.num_links(); ++i) {
    if ((docked >> i & 1u) == 0) continue;
    const BodyTable& table = context.state.bodies[i];
    for (int k = 0; k < table.num; ++k) {
      const BodyRecord& record = table.records[k];
      if (record.live == 0) continue;
      // Entries are counted through all bodies; this turn has those from `first` on.
      const bool now = at >= first && at < first + room;
      ++at;
      if (!now) continue;
      BodyEntry& entry = message->body_entries[message->num_body_entries++];
      entry.link = static_cast<uint8_t>(i);
      entry.joint = record.joint;
      entry.module = record.module;
      entry.stamp = record.stamp;
    }
  }
}

}  // namespace morphbus::vm
