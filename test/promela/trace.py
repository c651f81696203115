"""Makes of a recorded run what the model in lockstep.pml is to follow: for each speaker, in order, what it said.

A log holds every message once, those of the run's hash in an order that the messages alone decide, which agrees with the order in which
they were said; requests are put where the tick in their header belongs. What others than the sim and the modules say, STATUS, and what the
logger asks for are left out. The log is read by the end-to-end tests' own reader, without the help of the programs under test.
"""
import collections

HELLO, TOTALS, TICK, END, ASKS = 0, 1, 2, 3, 4  # As in lockstep.pml.
ORDER = ('CLOCK', 'SENSORS', 'WORLD', 'TRANSFORM', 'ACTUATOR')  # In which a log has what a speaker says in a tick.
SIM = 'SIM'


class Trace:
    """What a log shows of a run of a row of modules m1, m2, ..., each docked to the next."""

    def __init__(self, support, path):
        self.rows = collections.defaultdict(list)
        self.contents = {}  # (speaker, topic, number): the bytes, without what differs from run to run.
        self.clean = False
        # Messages of a tick that a speaker says in lockstep, and of each what there is of the present tick.
        self._parts, self._there = 0, collections.defaultdict(list)
        asked = collections.defaultdict(list)
        for _, _, channel, data in support.each_event(path):
            name, topic = channel.split('/')[1:] if channel.count('/') == 2 else ('', channel.split('/')[1])
            if topic not in ('CLOCK', 'SENSORS', 'WORLD', 'TRANSFORM', 'ACTUATOR', 'RESEND', 'HELLO', 'TOTALS', 'END'):
                continue
            message = support.decode(data)
            if topic in ORDER:
                self.contents[name, topic, message.header.sequence] = support.content(data)
                self._take_tick(name, topic, message)
            elif topic == 'RESEND':
                asked[message.sender, message.header.tick].append(message)
            elif topic in ('HELLO', 'TOTALS'):
                event = (HELLO, 0) if topic == 'HELLO' else (TOTALS, message.last_tick + 1)
                if message.process != 'LOG' and event not in self.rows[message.process]:
                    self.rows[message.process].append(event)
            elif topic == 'END':
                self.clean = message.clean
        self.modules = sorted({name for name, topic, _ in self.contents if topic == 'ACTUATOR'})
        for speaker in [SIM, *self.modules]:
            self.rows[speaker] = list(self._in_order(speaker, asked))

    def _take_tick(self, name, topic, message):
        """A tick of a speaker is there once the last of its messages is, if all came one after the other and in their order."""
        tick, row = message.header.tick, self.rows[name]
        if topic == 'CLOCK':
            self._parts = 1 + message.num_sensors_parts + message.num_world_parts
            if message.phase == message.PHASE_END:
                row.append((END, tick))
                return
        there = self._there[name]
        if there and there[0][0] != tick:
            there.clear()
        there.append((tick, ORDER.index(topic), message.header.sequence))
        if len(there) == (self._parts if name == SIM else 2) and there == sorted(set(there)):
            row.append((TICK, tick))

    def _in_order(self, speaker, asked):
        """HELLO, the ticks with the requests before or, of the sim, behind them, END and TOTALS."""
        row = self.rows[speaker]
        yield from (event for event in row if event[0] == HELLO)
        for event in row:
            if event[0] == TICK:
                requests = [(ASKS + self._place(speaker, m.channel), n) for m in asked[speaker, event[1]]
                            if m.channel.split('/')[-1] in ('ACTUATOR', 'TRANSFORM')
                            for n in range(m.first_sequence, m.last_sequence + 1)]
                yield from [event, *requests] if speaker == SIM else [*requests, event]
        yield from (event for event in row if event[0] in (END, TOTALS))

    def _place(self, speaker, channel):
        """Which module the sim asks, or on which side a module the neighbour that it asks."""
        other = self.modules.index(channel.split('/')[1])
        return other if speaker == SIM else int(other > self.modules.index(speaker))

    def include(self, reference, restarts):
        """The file trace.inc. A tick whose bytes are not those of the reference becomes one that the model never says. `restarts`: how
        often each module's process was killed, which messages do not show."""
        other = {(name, number if topic not in ('SENSORS', 'WORLD') else -1) for (name, topic, number), data in self.contents.items()
                 if reference.contents.get((name, topic, number)) != data}
        events, lasts, fill = [], [], []
        for number, speaker in enumerate([*self.modules, SIM]):
            fill.append(f'place[{number}] = {len(events)}')
            for what, n in self.rows[speaker]:
                wrong = what in (TICK, END) and not {(speaker, n), (speaker, -1)}.isdisjoint(other)
                events.append(-1 if wrong else 64 * what + n)
            lasts.append(len(events))
            events.append(-1)
        fill += [f'event[{i}] = {event}' for i, event in enumerate(events)]
        fill += [f'restarts[{i}] = {restarts.get(name, 0)}' for i, name in enumerate(self.modules)]
        lines = [f'#define EVENTS {len(events)}', f'#define CLEAN {int(self.clean)}',
                 f'#define LAST(who) ((who) == 0 -> {lasts[0]} : ((who) == {len(lasts) - 1} -> {lasts[-1]} : {lasts[-2]}))',
                 f'#define FILL {"; ".join(fill)}']
        return '\n'.join(lines) + '\n'
