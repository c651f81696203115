"""Random programs whose roles every module of the robot can take. Each is a few parts, of all that a program can do: waves, messages
to neighbours and to all, shared fields, chance, timers, events, faults, labels, roles that depend on neighbours, and docking."""
from cases.modules import TYPES

DIRECTIONS = ('$NORTH', '$SOUTH', '$EAST', '$WEST', '$UP', '$DOWN')
AXES = ('$NORTH_SOUTH', '$UP_DOWN', '$EAST_WEST')
# Numbers that `--set` and `control set` may give other values: name, first value, range.
PARAMETERS = (('gain', 20.0, 5, 60), ('rest', 2, 1, 9), ('beat', 0.1, 0.02, 1))


def on_type(kind):
    """The concrete role of a module type that asks for nothing, and what the parts need of its joints."""
    module = TYPES[kind]
    name = f'On{kind.capitalize()}'
    joints = [(joint.upper(), sort) for joint, sort in module.joints.items()]
    lines = [f'role {name} extends Any {{']

    def function(signature, statements):
        lines.append(f'  function {signature} {{')
        lines.extend(f'    {statement}' for statement in statements)
        lines.append('  }')

    def move(joint, sort, blocking):
        unit, value = ('Millimetres', 'abs(degrees)') if sort == 'prismatic' else ('Degrees', 'degrees')
        return f'self.jointSet{unit}{"" if blocking else "NonBlocking"}(self.{joint}, {value});'

    if joints:
        function('bend(float degrees)', [move(joint, sort, False) for joint, sort in joints])
        # The last joint only, so that the others go on with their wave.
        function('go(float degrees)', [move(*joints[-1], True)])
        turning = [f'self.turnContinuous(self.{joint}, speed);' for joint, sort in joints if sort == 'continuous']
        function('spin(float speed)', turning or ['bend(speed / 3);'])
        joint, sort = joints[0]
        function('here()', [f'return self.joint{"Millimetres" if sort == "prismatic" else "Degrees"}(self.{joint});'])
        function('effort()', [f'return self.jointEffort(self.{joint});'])
    function('feel()', [f'return {" + ".join(module.sensors)};' if module.sensors else 'return 0.25;'])
    hooks = [hook.upper() for hook in module.hooks]
    function('hook(bool out)', [f'self.{hook}.SET_EXTENDED(out);' for hook in hooks[:2]] or ['holding = out;'])
    lines.append('}')
    return name, '\n'.join(lines)


def wave(chance):
    return f'''  behavior wave() {{
    bend(gain * sin({chance.whole(60, 720)} * self.time + {chance.whole(0, 90)} * self.hops));
    self.sleepcs(rest);
  }}'''


def gossip(chance):
    direction = chance.one((*DIRECTIONS, '$ANY'))
    return f'''  behavior gossip() {{
    if (self.connected({direction}, $Any) == 1) {{
      count = (self.connected({direction}, $Any).count + {chance.whole(1, 5)}) % 1000;
      level = self.connected({direction}, $Any).level * 0.5 + 0.25;
    }} else {{
      count = (count + 1) % 1000;
    }}
    self.sleepcs({chance.whole(1, 6)});
  }}'''


def rumour(chance):
    # Without asking first: where there is no such neighbour, or several, it ends by a fault.
    direction = chance.one((*DIRECTIONS, '$ANY'))
    return f'''  behavior rumour() {{
    self.sleepcs({chance.whole(1, 40)});
    level = self.connected({direction}, $Any).level + 0.125;
  }}'''


def luck(chance):
    return f'''  behavior luck() {{
    level = random(0, 1);
    self.sleepcs(1 + floor(random(0, {chance.whole(1, 9)})));
    if (random(0, 1) < 0.3) Any.poke(1 + count % 3, level);
  }}'''


def call(chance):
    direction = chance.one((*DIRECTIONS, '$ANY', '$ANY'))
    return f'''  behavior call() {{
    self.connected({direction}, $Any).poke(count % 7, here());
    self.sleepcs({chance.whole(1, 30)});
  }}'''


def conduct(chance):
    return f'''  behavior conduct() {{
    if (self.hops == {chance.whole(0, 2)}) {{
      Any.poke({chance.whole(1, 9)}, gain);
      Any.step({chance.whole(-40, 40)});
    }}
    self.sleepcs({chance.whole(5, 40)});
  }}'''


def strides(chance):
    return f'''  behavior strides() {{
    go({chance.whole(5, 40)});
    self.sleepcs(rest);
    go({chance.whole(-40, -5)});
  }}'''


def spinning(chance):
    return f'''  behavior spinning() {{
    spin({chance.whole(20, 120)});
    self.sleepcs({chance.whole(2, 40)});
    spin(0);
    self.sleepcs({chance.whole(1, 20)});
  }}'''


def feedback(chance):
    # What the physics does decides what is said, which decides what the physics does.
    return f'''  behavior feedback() {{
    level = effort() + feel() / 100;
    if (level * {chance.whole(1, 9)} > here() / 50) {{
      bend(gain);
      count = (count + 1) % 1000;
    }} else {{
      bend(-gain);
    }}
    self.sleepcs({chance.whole(8, 20)});
  }}'''


def sums(chance):
    return f'''  behavior sums() {{
    var sum = level;
    for (var i = 1; i <= {chance.whole(5, 60)}; i += 1) {{
      sum = sum / 2 + sin(sum * i) + atan2(i, sum + 2) / 90 + sqrt(abs(sum));
      if (sum > 50) break;
    }}
    level = sum;
    self.sleepcs({chance.whole(1, 5)});
  }}'''


def blink(chance):
    return f'''  handler blink() every beat{chance.one(("", " early"))} {{
    blinks += 1;
    if (blinks % {chance.whole(1, 12)} == 0) print("blinks", blinks, "at", self.ms, here());
  }}'''


def second(chance):
    return f'''  handler on_timer() every {chance.between(0.05, 0.6):.2f} {{
    count = (count + {chance.whole(1, 50)}) % 1000;
  }}'''


def events(chance):
    return f'''  handler on_connect() {{
    print("docked, neighbours:", sizeof(self.connected));
    count = (count + 100) % 1000;
  }}
  handler on_disconnect(){chance.one(("", " early"))} {{
    level = 0.0 - level;
    print("parted", count);
  }}
  handler on_stall() {{
    stalls += 1;
    print("stalled", stalls, here());
  }}'''


def letting_go(chance):
    return f'''  behavior letting_go() {{
    self.sleepcs({chance.whole(10, 80)});
    hook(false);
    self.sleepcs({chance.whole(2, 30)});
    hook(true);
    self.sleepcs({chance.whole(5, 30)});
  }}'''


def dividing(chance):
    # Some day the divisor is 0, and that ends the behavior.
    return f'''  behavior dividing() {{
    self.sleepcs({chance.whole(1, 20)});
    print("quotient", 1000 / ((count + {chance.whole(0, 9)}) % {chance.whole(2, 9)}));
  }}'''


PARTS = {wave: 5, gossip: 5, rumour: 1, luck: 4, call: 4, conduct: 3, strides: 3, spinning: 3, feedback: 3, sums: 2, blink: 3,
         second: 2, events: 3, letting_go: 2, dividing: 1}

ANY = '''abstract role Any extends Module {{
  shared count = {count};
  shared level = {level};
  blinks = 0;
  stalls = 0;
  holding = true;
  function bend(float degrees) {{
  }}
  function go(float degrees) {{
  }}
  function spin(float speed) {{
  }}
  function here() {{
    return 0.0;
  }}
  function effort() {{
    return 0.0;
  }}
  function feel() {{
    return 0.0;
  }}
  function hook(bool out) {{
    holding = out;
  }}
  startup begin() {{
    level = level + self.hops;
    {startup}
  }}
  command poke(int n, float x) {{
    count = (count + n) % 1000;
    level = x / 2;
    {poked}
  }}
  command step(float degrees) {{
    {step}
  }}
{parts}
}}'''


def specials(chance, kind, base):
    """Roles that only some modules take: by what hangs on them, and which roles that plays."""
    module = TYPES[kind]
    joint = next((name.upper() for name in module.joints), None)
    ends = f'{base}End'
    found = []
    if chance.happens(0.5):
        elbow = f'  label elbow = self.{joint};\n' if joint else ''
        label = chance.one(('', f'  label tip = self.links({chance.whole(0, 2)});\n', elbow))
        found.append(f'role {ends} extends {base} {{\n  require self.connected <= {chance.whole(1, 2)};\n{label}'
                     f'  count = {chance.whole(100, 200)};\n}}')
        if chance.happens(0.6):
            where = chance.one((*DIRECTIONS, '$ANY'))
            found.append(f'role {base}Next extends {base} {{\n  require self.connected({where}, ${ends}) >= 1;\n'
                         f'  command step(float degrees) {{\n    bend(degrees * 0.5);\n  }}\n}}')
    if chance.happens(0.3) and joint:
        found.append(f'role {base}Along extends {base} {{\n  require self.{joint}.AXIS == {chance.one(AXES)};\n'
                     f'  startup align() {{\n    print("lies along", self.connected({chance.one(DIRECTIONS)}) == 1);\n  }}\n}}')
    return found


def random_program(chance, robot):
    """The source of a program for all module types of a robot."""
    parts = []
    while len(parts) < 5 and (len(parts) < 2 or chance.happens(0.6)):
        part = chance.weighted(PARTS)
        if part not in parts:
            parts.append(part)
    lines = [f'param {name} = {value} in [{least}, {most}];' for name, value, least, most in PARAMETERS]
    lines.append(ANY.format(
        count=chance.whole(0, 9), level=f'{chance.between(0, 1):.3f}',
        startup=chance.one(('self.sleepcs(3);', 'bend(gain / 2);', 'go(gain / 4);', 'print("begins", self.hops);')),
        poked=chance.one(('', 'print("poked", n, x);', 'self.sleepcs(n);', 'bend(x);')),
        step=chance.one(('bend(degrees);', 'go(degrees);', 'go(degrees);\n    go(-degrees);')),
        parts='\n'.join(part(chance) for part in parts)))
    for kind in sorted(set(robot.modules.values())):
        base, text = on_type(kind)
        lines += [text, *specials(chance, kind, base)]
    return '\n\n'.join(lines) + '\n', [part.__name__ for part in parts]
