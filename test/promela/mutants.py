"""Wrong protocols: each is the model with other texts in places that it has once, and Spin must find what is wrong with it.

A mutant is a name, the configuration that shows it, and pairs of an old text and the new one in its place.
"""

_FRESH = 'memory[me] = Answer(me, k, expected_sensors[k], memory[me], ExpectedMate(me, 0, k - 1), ExpectedMate(me, 1, k - 1));' \
         ' assert(memory[me] == Expected(me, k)); Send(ACTUATOR(me), k)'
_SAVE = 'saved_tick[i] = tick[i] + 1;\n        saved_memory[i] = memory[i];\n'
_TAKE_MATE = 'ExpectedMate(i, 0, tick[i] - 1), ExpectedMate(i, 1, tick[i] - 1));\n     if'
_TAKE_NEWEST = 'ExpectedMate(i, 0, tick[i] - 1), (Has(Heard(i, 1), tick[i]) -> ExpectedMate(i, 1, tick[i]) : ' \
               'ExpectedMate(i, 1, tick[i] - 1)));\n     if'

_ACKNOWLEDGE = ':: k == END || k == LEAVE_ALONE -> SayTotals(me)'

ROW = {'MODULES': 2, 'LOGGER': 0, 'TICKS': 3, 'FAULTS': 1}
RECORDED = {'MODULES': 1, 'LOGGER': 1, 'TICKS': 4, 'FAULTS': 1}
PARTING = {'MODULES': 2, 'LOGGER': 1, 'TICKS': 3, 'FAULTS': 1, 'LOSE': 2}

MUTANTS = [
    ('the sim steps with an answer missing', ROW,
     [('(phase == RUN && answered == Members(sim_tick))', '(phase == RUN && answered != 0)')]),
    ('the sim takes an old answer for one to this tick', ROW,
     [('phase == RUN && k == sim_tick ->', 'phase == RUN && k != NOTHING ->')]),
    ('a module takes doubled SENSORS for those of the next tick', ROW,
     [(':: k == tick[me] && !Has(told, me) -> sensed', ':: k != NOTHING && !Has(told, me) -> sensed')]),
    ('an answer that is asked for is computed again', ROW,
     [('Send(ACTUATOR(me), k) :: else', _FRESH + ' :: else')]),
    ('the state is saved after it was said', ROW,
     [(_SAVE, 'skip;\n'),
      (':: SayActuator(i); NextTick(i)',
       ':: SayActuator(i); if :: MayDie(i) -> Die(i) :: saved_tick[i] = tick[i] + 1; saved_memory[i] = memory[i]; NextTick(i) fi')]),
    ('a process goes on from an older state', ROW,
     [('saved_memory[i] = memory[i];\n', 'saved_memory[i] = (tick[i] > 0 -> Expected(i, tick[i] - 1) : 0);\n')]),
    ('what a neighbour says in this tick is taken for what it said in the last', ROW,
     [(_TAKE_MATE, _TAKE_NEWEST)]),
    ('a module asks its neighbour for the wrong tick', ROW,
     [('Send(ASK_TRANSFORM(Mate(me, side), 1 - side), tick[me] - 1);', 'Send(ASK_TRANSFORM(Mate(me, side), 1 - side), tick[me]);')]),
    ('answers are kept for too short', ROW,
     [('(k) + KEPT >= (next)', '(k) + 1 >= (next)')]),
    ('the sim asks for an answer, and does not repeat SENSORS', ROW,
     [('Send(SENSORS(i), sim_tick);\n       Note', 'Note')]),
    ('HELLO is said once', ROW,
     [('Runs(me) && phase == START &&', 'false && Runs(me) && phase == START &&')]),
    ('a module leaves when it has acknowledged END', ROW,
     [(_ACKNOWLEDGE, ':: k == END -> SayTotals(me); stage[me] = LEFT\n       :: k == LEAVE_ALONE -> SayTotals(me)')]),
    ('END is called clean without the totals of all', ROW,
     [('phase == ENDING && acknowledged == EVERYBODY -> Conclude()', 'phase == ENDING -> Conclude()'),
      ('clean = (acknowledged == EVERYBODY)', 'clean = true')]),
    ('the window is not looked at', RECORDED,
     [('#define WindowOpen (sim_tick + 2 <= log_ticks + KEPT)', '#define WindowOpen true')]),
    ('the logger acknowledges ticks that it lacks', RECORDED,
     [('Send(PROGRESS, whole)\n       :: else\n', 'Send(PROGRESS, existing)\n       :: else\n')]),
    ('END is called clean though the log lacks something', {'MODULES': 1, 'LOGGER': 1, 'TICKS': 1, 'FAULTS': 2, 'DEATHS': 1},
     [('(!LOGGER || log_whole);', 'true;')]),
    ('what a module was told of the end is not saved', ROW,
     [('Heard(i, 1) = 0;\n  stage', 'Heard(i, 1) = 0;\n  told = Without(told, i);\n  stage')]),
    ('what a module was told of the end is saved after it is acknowledged', ROW,
     [('told = With(told, i);\n  if', 'if'), ('vouched = With(vouched, i)\n  fi', 'vouched = With(vouched, i);\n'
                                         '     if :: MayDie(i) -> Die(i) :: told = With(told, i) fi\n  fi')]),
    ('a module is lost before the logger has all that it said', PARTING,
     [('Parting && LoggerHas(LOSE) && Runs(i)', 'Parting && Runs(i)')]),
    ('a module that is lost leaves when it has acknowledged that', PARTING,
     [(_ACKNOWLEDGE, ':: k == END -> SayTotals(me)\n       :: k == LEAVE_ALONE -> SayTotals(me); stage[me] = LEFT')]),
    ('the sim goes on though the module that is lost has not acknowledged it', PARTING,
     [('AllAnswered && WindowOpen && !Parting &&', 'AllAnswered && WindowOpen &&')]),
    ('a neighbour waits for the module that is lost', PARTING,
     [('#define HasTransform(i, side) (!Mated(i, side, tick[i])', '#define HasTransform(i, side) (!HasMate(i, side)')]),
]
