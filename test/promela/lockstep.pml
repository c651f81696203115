/* The lockstep protocol of a run (lcmtypes/README.md, "Lockstep"), stated anew and apart from its code, for the model checker Spin.

A simulator (Sim) and modules go through a run tick by tick. In tick k the sim says SENSORS(k), each module computes its answer from
that, from its own memory, and from what its neighbours said in tick k-1 (TRANSFORM), and says TRANSFORM(k) and ACTUATOR(k). When the sim
has the ACTUATOR(k) of all modules, the robot moves, and tick k+1 begins. A logger, if there is one, records all that is said, and the
sim never is more than a window ahead of what the logger has. Messages may be lost, doubled and reordered; a module may be killed at any
moment, and another process then goes on from the state that it saved. Nothing of this may change what anybody says. A module may be
lost on purpose before some tick: from then on the run goes on without it.

The modules are docked in a row: 0 - 1 - 2. Every step of a process is one atomic step. The members of a run are split into several Promela
processes, one for each of whom they speak with; they share their state, which is global.

What is left out, and which figures were seen, is said in docs/lockstep-model.md. test/promela/check runs all of it. */

/* ---- The configuration, which test/promela/check sets by -D. */

#ifndef MODULES
#define MODULES 2    /* 1 to 3; with the sim, and perhaps the logger, 2 to 4 participants */
#endif
#ifndef LOGGER
#define LOGGER 0     /* 1: a logger takes part */
#endif
#ifndef TICKS
#define TICKS 3      /* ticks of the run */
#endif
#ifndef KEPT
#define KEPT 2       /* ticks whose messages everybody keeps, and the window between sim and logger */
#endif
#ifndef FAULTS
#define FAULTS 3     /* so many things go wrong, of these kinds in any order: a message is lost; a message comes once more, whenever that
                        may be; something is asked for though it is still under way; a module's process is killed */
#endif
#ifndef DEATHS
#define DEATHS 0     /* so many killed processes, at most, are never started again */
#endif
#ifndef LOSE
#define LOSE 99      /* the tick before which the last module of two or more is lost on purpose; 99: never */
#endif

/* Sets of ticks are bits of a number; traces of real runs have more ticks than a byte has bits. */
#ifdef TRACE
#define SET int
#else
#define SET byte
#endif
#define Has(set, n) ((((set) >> (n)) & 1) != 0)
#define With(set, n) ((set) | (1 << (n)))
#define Without(set, n) ((set) & ~(1 << (n)))

#define ALL ((1 << MODULES) - 1)                      /* all modules */
#define LEAVER (MODULES - 1)                          /* the module that is lost on purpose, if one is */
#define TakesPart(i, k) ((i) != LEAVER || (k) < LOSE) /* module i is still in the run in tick k */
#define Members(k) ((k) < LOSE -> ALL : Without(ALL, LEAVER))
#define LOG MODULES                                   /* the logger's number among the members of the run */
#define EVERYBODY (ALL | (LOGGER << LOG))

/* Neighbours by side: 0 is the one before, 1 the one after. */
#define HasMate(i, side) ((side) == 0 && (i) > 0 || (side) == 1 && (i) < MODULES - 1)
#define Mate(i, side) ((i) + 2 * (side) - 1)
/* In tick k, for who is lost is connected to nobody any more. */
#define Mated(i, side, k) (HasMate(i, side) && TakesPart(i, k) && TakesPart(Mate(i, side), k))

/* ---- The network: net[link] is the set of messages that are under way on a link, by the number that they bear. A message that is under
way twice counts once. Every receiver of a message has a link of its own, so that each may miss it for itself. Whichever of them comes
next, comes: they have no order. */

/* To module i, by tick. */
#define SENSORS(i) (i)
#define ASK_ACTUATOR(i) (MODULES + (i))
#define TRANSFORM(i, side) ((2 + (side)) * MODULES + (i))      /* from its neighbour on that side */
#define ASK_TRANSFORM(i, side) ((4 + (side)) * MODULES + (i))
#define ASK_RECORD(i) (6 * MODULES + (i))                      /* from the logger */
#define FAREWELL(i) (7 * MODULES + (i))                        /* not by tick: */
#define END 0
#define LEAVE 1                                                /* the run is over for all */
#define LEAVE_ALONE 2                                          /* the run goes on without module i */
#define TO_MODULES (8 * MODULES)                               /* so many links lead to modules; link l to module l % MODULES */
/* To the sim. */
#define ACTUATOR(i) (TO_MODULES + (i))
#define REPORT(i) (TO_MODULES + MODULES + (i))                 /* from module i or from LOG, not by tick: */
#define HELLO 0
#define TOTALS 1
#define VERDICT_HEARD 2
#define PROGRESS (TO_MODULES + 2 * MODULES + 1)                /* from the logger, by the number of ticks that it has */
#define ASK_SIM_RECORD (PROGRESS + 1)                          /* from the logger, by tick */
/* To the logger. */
#define RECORD(i) (PROGRESS + 2 + (i))                         /* what module i says in a tick; of LOG: what the sim does */
#define POLL (PROGRESS + 3 + MODULES)                          /* from the sim, by tick: how far is the logger? */
#define TO_LOGGER (POLL + 1)                                   /* from the sim, not by tick; END and LEAVE, and: */
#define VERDICT 2
#define LINKS (TO_LOGGER + 1)

SET net[LINKS];
byte faults = FAULTS, deaths = DEATHS;

#define UnderWay(link, n) Has(net[link], n)
#define Send(link, n) net[link] = With(net[link], n)

/* ---- What is said. A payload is a number that depends on all that it must depend on, and hardly equals that of other inputs. Expected
payloads are those of a run in which nothing goes wrong; init computes them once. Whatever is said is compared with them when it is
said, so that the network need not carry payloads: whoever receives one has the expected one. */

hidden byte expected_answer[MODULES * TICKS];
hidden byte expected_sensors[TICKS + 1];
#define Expected(i, k) expected_answer[(i) * TICKS + (k)]
#define ExpectedMate(i, side, k) (Mated(i, side, (k) + 1) && (k) >= 0 -> Expected(Mate(i, side), k) : 0)

#define Answer(i, k, sensors, memory, before, after) \
  ((3 * (memory) + 5 * (sensors) + 7 * (before) + 11 * (after) + 13 * (k) + (i) + 1) % 251)

/* ---- The state of the modules, by number. */

#define RUNS 0        /* takes part */
#define DEAD 1        /* was killed; another process will go on */
#define LOST 2        /* was killed, and nobody goes on */
#define LEFT 3        /* the run is over for it */
#define FORSAKEN 4    /* it gave up after a long silence: the sim has gone without a word */
byte stage[MODULES];
byte tick[MODULES];          /* the tick that it computes next */
byte memory[MODULES];        /* what its program remembers: here its last payload */
bool sensed[MODULES];        /* it has SENSORS(tick) */
SET heard[2 * MODULES];      /* TRANSFORMs that it has of a side, of this tick and the one before */
byte saved_tick[MODULES];    /* What outlives the process. */
byte saved_memory[MODULES];
byte told;                   /* Of which modules this outlives it: they have heard END or LEAVE_ALONE. */
byte vouched;                /* members that have acknowledged it: for assertions alone */
#define Heard(i, side) heard[2 * (i) + (side)]
#define Runs(i) (stage[i] == RUNS)
#define Keeps(next, k) ((k) < (next) && (k) + KEPT >= (next))
#define HasTransform(i, side) (!Mated(i, side, tick[i]) || tick[i] == 0 || Has(Heard(i, side), tick[i] - 1))

/* ---- The state of the sim. */

#define START 0
#define RUN 1
#define ENDING 2         /* END is out */
#define CONCLUDING 3     /* the logger must still hear how the run ended */
#define DONE 4
byte phase;
byte sensors = 1;        /* what the robot senses now */
byte sim_tick;           /* the tick that is out; of END, the one after the last */
byte greeted, answered, acknowledged;    /* members that have said HELLO, answered this tick, acknowledged END or LEAVE_ALONE */
byte log_ticks;          /* ticks that the logger has, as far as the sim knows */
bool log_whole;          /* the logger has said in TOTALS that it lacks nothing */
bool clean;              /* how the run ended: the verdict */
#if LOGGER
#define WindowOpen (sim_tick + 2 <= log_ticks + KEPT)
#define LoggerHas(ticks) (log_ticks >= (ticks))
#else
#define WindowOpen true
#define LoggerHas(ticks) true
#endif
#define AllAnswered (phase == RUN && answered == Members(sim_tick))
/* The next tick is the first one without a module, which has not acknowledged that. */
#define Parting (AllAnswered && sim_tick + 1 == LOSE && !Has(acknowledged, LEAVER))

/* ---- The state of the logger. */

#define IS_ENDED 1       /* it has acknowledged END */
byte log_stage;          /* RUNS, IS_ENDED or LEFT */
SET recorded[MODULES + 1];
byte whole;              /* it has all of so many ticks, from the first */
byte existing;           /* so many ticks are over, as far as it knows */
bool log_told;           /* it has heard END */
bool log_clean;          /* what its END says */

/* The run is over for everybody. */
#define OutOfRun(i) (stage[i] >= LOST)
#if MODULES == 1
#define AllOut OutOfRun(0)
#elif MODULES == 2
#define AllOut (OutOfRun(0) && OutOfRun(1))
#else
#define AllOut (OutOfRun(0) && OutOfRun(1) && OutOfRun(2))
#endif
#define Over (phase == DONE && AllOut && (!LOGGER || log_stage == LEFT))

/* Liveness: every run ends. No fairness is asked for: all that could go on for ever without leading anywhere (faults, hasty requests) is
bounded, and requests that are not hasty are made where nothing else can help. */
#ifdef LIVENESS
ltl ends { <> Over }
#endif

/* ---- Traces. Of a recorded run test/promela/trace.py makes trace.inc: for each speaker the row of what it said. The model may then only say
what the log has next, and accepts the log if it can go through all of it and end as it did. Nothing is lost or doubled then, for a log
cannot show that; whatever was asked for may be asked for, killed processes are killed at some time, and what has become useless is thrown
away at once, for it changes nothing. Logs are taken without the logger's own part, and
of two modules. */

#define SIM MODULES               /* the speakers are the modules and the sim */
/* What is said, besides HELLO and TOTALS: */
#define SAYS_TICK 2               /* the sim: CLOCK, SENSORS and WORLD; a module: TRANSFORM and ACTUATOR */
#define SAYS_END 3
#define ASKS(whom) (4 + (whom))   /* the sim a module, a module its neighbour on a side */
#define Event(what, n) (64 * (what) + (n))
#ifdef TRACE
#include "trace.inc"
hidden int event[EVENTS];
short place[MODULES + 1];
byte restarts[MODULES];
#define May(who, what, n) (event[place[who]] == Event(what, n))
#define Note(who, what, n) if :: May(who, what, n) -> place[who]++ :: else fi
#define MayFail false
#define MayBeHasty true
#define CountHaste skip
#define MayDie(i) (restarts[i] > 0)
#define CountDeath(i) restarts[i]--
#define DropBefore(link, n) net[link] = net[link] & ~((1 << ((n) > 0 -> (n) : 0)) - 1)
#else
#define May(who, what, n) true
#define Note(who, what, n) skip
#define MayFail (faults > 0)
#define MayBeHasty (faults > 0)
#define CountHaste faults--
#define MayDie(i) (faults > 0)
#define CountDeath(i) faults--
#define DropBefore(link, n) skip
#endif

/* ---- The network at work. */

/* Any message of a link comes, and stays under way if it is to come once more; or it is lost at this last moment, which is as good as
earlier, and n is NOTHING. */
#define NOTHING 255
inline Receive(link, n) {
  n = 0;
  do
  :: UnderWay(link, n) -> break
  :: (net[link] >> n) > 1 -> n++
  od;
  if
  :: net[link] = Without(net[link], n)
  :: MayFail -> faults--
  :: MayFail -> faults--; net[link] = Without(net[link], n); n = NOTHING
  fi
}

#include "module.pml"
#include "sim.pml"
#include "logger.pml"

/* Safety: where nothing can happen any more, the run is over. */
proctype Still() {
#ifdef TRACE
  Over && place[SIM] == LAST(SIM) && place[0] == LAST(0) && place[MODULES - 1] == LAST(MODULES - 1) && clean == CLEAN &&
  restarts[0] + restarts[MODULES - 1] == 0 ->
accepted:
  assert(false)
#else
  timeout -> assert(Over)
#endif
}

init {
  byte i;
  byte k;
  int sum;
  d_step {
    for (k : 0 .. TICKS - 1) {
      expected_sensors[k] = sensors;
      sum = 2 * sensors + 1;
      for (i : 0 .. MODULES - 1) {
        Expected(i, k) = Answer(i, k, expected_sensors[k], (k > 0 -> Expected(i, k - 1) : 0),
                                ExpectedMate(i, 0, k - 1), ExpectedMate(i, 1, k - 1));
        sum = sum + (TakesPart(i, k) -> (i + 3) * Expected(i, k) : 0)
      }
      sensors = sum % 251
    }
    expected_sensors[TICKS] = sensors;
    sensors = expected_sensors[0];
    k = 0;
    sum = 0;
    i = 0
  }
#ifdef TRACE
  d_step { FILL }
#endif
  atomic {
    run Patience();
#ifndef LIVENESS
    run Still();
#endif
#if LOGGER
    run SimWithLogger();
    run Logger();
    run LoggerWith(LOG);
#endif
    do
    :: i < MODULES ->
       run SimWith(i);
       run Module(i);
       if :: HasMate(i, 0) -> run Side(i, 0) :: else fi;
       if :: HasMate(i, 1) -> run Side(i, 1) :: else fi;
#if LOGGER
       run LoggerWith(i);
#endif
       i++
    :: else -> break
    od;
    i = 0
  }
}
