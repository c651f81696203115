/* The simulator of the lockstep protocol; part of lockstep.pml. */

/* The tick goes out to all modules and to the logger. */
inline SayTick() {
  for (n : 0 .. MODULES - 1) {
    Send(SENSORS(n), sim_tick);
    DropBefore(ACTUATOR(n), sim_tick);
    DropBefore(ASK_ACTUATOR(n), sim_tick);
    DropBefore(ASK_TRANSFORM(n, 0), sim_tick - 1);
    DropBefore(ASK_TRANSFORM(n, 1), sim_tick - 1)
  }
  Note(SIM, SAYS_TICK, sim_tick);
  if :: LOGGER -> Send(RECORD(LOG), sim_tick) :: else fi;
  n = 0
}

inline SayEnd() {
  Note(SIM, SAYS_END, sim_tick);
  for (n : 0 .. MODULES - 1) { Send(FAREWELL(n), END) }
  if :: LOGGER -> Send(TO_LOGGER, END) :: else fi;
  n = 0;
  phase = ENDING
}

/* The robot moves: the next SENSORS follow from the answers. Of a module that has not answered, or takes no part any more, there is
none. */
inline Advance() {
  sum = 2 * sensors + 1;
  for (n : 0 .. MODULES - 1) {
    assert(saved_tick[n] > sim_tick || !TakesPart(n, sim_tick));    /* Nobody's answer was taken that was not given. */
    sum = sum + (Has(answered, n) -> (n + 3) * Expected(n, sim_tick) : 0)
  }
  sensors = sum % 251;
  sum = 0;
  n = 0;
  sim_tick++;
  answered = 0;
  assert(sensors == expected_sensors[sim_tick]);
  /* The logger is not further behind than everybody keeps. */
  assert(!LOGGER || sim_tick + 1 <= log_ticks + KEPT)
}

/* Once all answers are there, the logger is not too far behind, and who is to be lost has acknowledged that, the tick is over. */
inline TryAdvance() {
  if
  :: AllAnswered && WindowOpen && !Parting &&
     May(SIM, (sim_tick + 1 < TICKS -> SAYS_TICK : SAYS_END), sim_tick + 1) ->
     Advance();
     if :: sim_tick == TICKS -> SayEnd() :: else -> SayTick() fi
  :: else
  fi
}

/* All have acknowledged END, or those that have not are silent for good: how did the run end? It is called clean only if everybody agrees
that all of it was said and recorded. */
inline Conclude() {
  clean = (acknowledged == EVERYBODY) && (!LOGGER || log_whole);
  assert(!clean || (sim_tick == TICKS && vouched == EVERYBODY));
  assert(!clean || !LOGGER || whole == TICKS);
  if
  :: LOGGER && Has(acknowledged, LOG) -> Send(TO_LOGGER, VERDICT); phase = CONCLUDING
  :: else -> Finish()
  fi
}

/* LEAVE is said once. */
inline Finish() {
  for (n : 0 .. MODULES - 1) { Send(FAREWELL(n), LEAVE) }
  if :: LOGGER -> Send(TO_LOGGER, LEAVE) :: else fi;
  n = 0;
  phase = DONE
}

/* What follows from HELLO (all are there: tick 0 begins) and from TOTALS. */
inline TryBegin() {
  if :: phase == START && greeted == EVERYBODY -> phase = RUN; SayTick() :: else fi
}
inline TryConclude() {
  if :: phase == ENDING && acknowledged == EVERYBODY -> Conclude() :: else fi
}

/* The present tick lacks the answer of module i, and nothing is under way that could bring it. */
#define LacksAnswer(i) (phase == RUN && TakesPart(i, sim_tick) && !Has(answered, i))
#define AnswerInVain(i) (Runs(i) && !(tick[i] == sim_tick && sensed[i]) && !UnderWay(ACTUATOR(i), sim_tick) && \
                         !UnderWay(SENSORS(i), sim_tick) && !UnderWay(ASK_ACTUATOR(i), sim_tick))

/* The sim and module i. */
proctype SimWith(byte i) {
  byte k;
  byte n;
  int sum;
end:
  do
  /* A later or an older answer than that of this tick is a repetition. */
  :: atomic {
       net[ACTUATOR(i)] != 0 ->
       Receive(ACTUATOR(i), k);
       if :: phase == RUN && k == sim_tick -> answered = With(answered, i) :: else fi;
       k = 0;
       TryAdvance()
     }
  :: atomic {
       net[REPORT(i)] != 0 ->
       Receive(REPORT(i), k);
       if
       :: k == HELLO && (phase == START || phase == ENDING) -> greeted = With(greeted, i); TryBegin()
       :: k == TOTALS && phase == ENDING -> acknowledged = With(acknowledged, i); TryConclude()
       :: k == TOTALS && i == LEAVER && Parting -> acknowledged = With(acknowledged, i); TryAdvance()
       :: else
       fi;
       k = 0
     }
  /* Who is to be lost is told so once the logger has all that it said, until it acknowledges that. */
  :: d_step {
       i == LEAVER && Parting && LoggerHas(LOSE) && Runs(i) && !UnderWay(FAREWELL(i), LEAVE_ALONE) && !UnderWay(REPORT(i), TOTALS) ->
       Send(FAREWELL(i), LEAVE_ALONE)
     }
  /* It asks where messages were lost, or too soon, and says SENSORS again, which the module may lack. */
  :: d_step {
       LacksAnswer(i) && (AnswerInVain(i) || MayBeHasty) && May(SIM, ASKS(i), sim_tick) ->
       if :: AnswerInVain(i) :: else -> CountHaste fi;
       Send(ASK_ACTUATOR(i), sim_tick);
       Send(SENSORS(i), sim_tick);
       Note(SIM, ASKS(i), sim_tick)
     }
  /* END is repeated for who has not acknowledged it. */
  :: d_step {
       phase == ENDING && !Has(acknowledged, i) && Runs(i) && !UnderWay(FAREWELL(i), END) && !UnderWay(REPORT(i), TOTALS) ->
       Send(FAREWELL(i), END)
     }
  od
}

/* A member keeps silent for good: a module that nobody goes on for, of which nothing is under way any more; or one that lacks what such a
neighbour said. */
#define MateLost(i, side) (LacksMate(i, side) && stage[Mate(i, side)] == LOST && !UnderWay(TRANSFORM(i, side), tick[i] - 1))
#define SilentAnswer(i) (TakesPart(i, sim_tick) && !Has(answered, i) && (stage[i] == LOST && !UnderWay(ACTUATOR(i), sim_tick) || MateLost(i, 0) || MateLost(i, 1)))
#define SilentHello(i) (stage[i] == LOST && !Has(greeted, i) && !UnderWay(REPORT(i), HELLO))
#if LOGGER
/* Of member p the logger lacks the first tick that it has not whole, though it is over; of who is lost it will never get it. */
#define Lacks(p, k) ((k) < existing && TakesPart(p, k) && !Has(recorded[p], k))
#define GoneForGood(p) (p != LOG && stage[p] == LOST && Lacks(p, whole) && !UnderWay(RECORD(p), whole))
/* The sim waits for the logger: the window is closed, or a module must not leave before. */
#define WaitsForLogger (AllAnswered && (!WindowOpen || Parting && !LoggerHas(LOSE)))
#define SilentLogger (WaitsForLogger && (Any(GoneForGood)))
#else
#define SilentLogger false
#endif
#define SilentLeaver (Parting && LoggerHas(LOSE) && stage[LEAVER] == LOST && !UnderWay(REPORT(LEAVER), TOTALS))
#define SilentTotals(i) (Has(acknowledged, i) || stage[i] == LOST && !UnderWay(REPORT(i), TOTALS))
#if MODULES == 1
#define Any(Silent) Silent(0)
#define Each(Silent) Silent(0)
#elif MODULES == 2
#define Any(Silent) (Silent(0) || Silent(1))
#define Each(Silent) (Silent(0) && Silent(1))
#else
#define Any(Silent) (Silent(0) || Silent(1) || Silent(2))
#define Each(Silent) (Silent(0) && Silent(1) && Silent(2))
#endif

/* The sim's patience: who keeps silent for too long ends the run; one that has not begun still gets its first tick. */
proctype Patience() {
  byte n;
end:
  do
  :: d_step { phase == RUN && (Any(SilentAnswer) || SilentLogger || SilentLeaver) -> SayEnd() }
  :: d_step { phase == START && Any(SilentHello) -> SayTick(); SayEnd() }
  :: d_step {
       phase == ENDING && acknowledged != EVERYBODY && Each(SilentTotals) && (!LOGGER || Has(acknowledged, LOG)) ->
       Conclude()
     }
  od
}
