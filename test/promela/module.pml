/* A module of the lockstep protocol; part of lockstep.pml. */

inline Die(i) {
  CountDeath(i);
  tick[i] = saved_tick[i];
  memory[i] = saved_memory[i];
  sensed[i] = false;
  Heard(i, 0) = 0;
  Heard(i, 1) = 0;
  stage[i] = DEAD
}

/* Neighbours get TRANSFORM. Nobody ever says anything else in a tick than in the run without faults. */
inline SayTransform(i) {
  assert(memory[i] == Expected(i, tick[i]));
  if :: HasMate(i, 0) -> Send(TRANSFORM(Mate(i, 0), 1), tick[i]) :: else fi;
  if :: HasMate(i, 1) -> Send(TRANSFORM(Mate(i, 1), 0), tick[i]) :: else fi
}

/* Last comes ACTUATOR, for the sim goes on once it has this. */
inline SayActuator(i) {
  assert(memory[i] == Expected(i, tick[i]));
  Send(ACTUATOR(i), tick[i]);
  if :: LOGGER -> Send(RECORD(i), tick[i]) :: else fi
}

/* The next tick begins with nothing but what neighbours have said already, who may be quicker. */
inline NextTick(i) {
  if
  :: tick[i] > 0 -> Heard(i, 0) = Without(Heard(i, 0), tick[i] - 1); Heard(i, 1) = Without(Heard(i, 1), tick[i] - 1)
  :: else
  fi;
  tick[i]++;
  sensed[i] = false;
  DropBefore(SENSORS(i), tick[i]);
  DropBefore(TRANSFORM(i, 0), tick[i] - 1);
  DropBefore(TRANSFORM(i, 1), tick[i] - 1);
  /* What the logger lacks is still kept, and no module is ahead of the sim. */
  assert(!LOGGER || whole + KEPT >= tick[i]);
  assert(tick[i] <= sim_tick + 1)
}

/* Once all inputs are there the tick is computed, saved, and then said; the process may be killed between any two of these. That it is one
step hides nothing: nobody else sees anything of it but the messages, which come when they come. */
#define HasInputs(i) (sensed[i] && HasTransform(i, 0) && HasTransform(i, 1))
inline TryCompute(i) {
  if
  :: HasInputs(i) && !Has(told, i) && May(i, SAYS_TICK, tick[i]) ->
     memory[i] = Answer(i, tick[i], expected_sensors[tick[i]], memory[i],
                        ExpectedMate(i, 0, tick[i] - 1), ExpectedMate(i, 1, tick[i] - 1));
     if
     :: MayDie(i) -> Die(i)
     :: saved_tick[i] = tick[i] + 1;
        saved_memory[i] = memory[i];
        Note(i, SAYS_TICK, tick[i]);
        if
        :: MayDie(i) -> Die(i)
        :: SayTransform(i);
           if
           :: MayDie(i) -> Die(i)
           :: SayActuator(i); NextTick(i)
           fi
        fi
     fi
  :: else
  fi
}

/* That it was told is saved before it is acknowledged. */
inline SayTotals(i) {
  told = With(told, i);
  if
  :: MayDie(i) -> Die(i)
  :: Send(REPORT(i), TOTALS);
     Note(i, TOTALS, tick[i]);
     vouched = With(vouched, i)
  fi
}

/* The present tick lacks the TRANSFORM of the neighbour on a side; nothing is under way that could bring it. */
#define LacksMate(i, side) (Runs(i) && sensed[i] && !HasTransform(i, side))
#define MateInVain(i, side) (Runs(Mate(i, side)) && !UnderWay(TRANSFORM(i, side), tick[i] - 1) && \
                             !UnderWay(ASK_TRANSFORM(Mate(i, side), 1 - (side)), tick[i] - 1))

/* A module and its neighbour on one side. */
proctype Side(byte me, side) {
  byte k;
end:
  do
  /* A TRANSFORM counts for this tick or for the next one; an older one is a repetition. */
  :: atomic {
       Runs(me) && net[TRANSFORM(me, side)] != 0 ->
       Receive(TRANSFORM(me, side), k);
       if :: k != NOTHING && k + 1 >= tick[me] -> Heard(me, side) = With(Heard(me, side), k) :: else fi;
       k = 0;
       TryCompute(me)
     }
  /* What the neighbour asks for is sent again if it is kept, and never computed again. */
  :: atomic {
       Runs(me) && net[ASK_TRANSFORM(me, side)] != 0 ->
       Receive(ASK_TRANSFORM(me, side), k);
       if :: Keeps(tick[me], k) -> Send(TRANSFORM(Mate(me, side), 1 - side), k) :: else fi;
       k = 0
     }
  /* It asks where the neighbour's message was lost; or too soon. */
  :: d_step {
       LacksMate(me, side) && (MateInVain(me, side) || MayBeHasty) && May(me, ASKS(side), tick[me] - 1) ->
       if :: MateInVain(me, side) :: else -> CountHaste fi;
       Send(ASK_TRANSFORM(Mate(me, side), 1 - side), tick[me] - 1);
       Note(me, ASKS(side), tick[me] - 1)
     }
  od
}

proctype Module(byte me) {
  byte k;
  d_step { Send(REPORT(me), HELLO); Note(me, HELLO, 0) };
end:
  do
  /* HELLO is said again until the sim has heard it. */
  :: d_step { Runs(me) && phase == START && !Has(greeted, me) && !UnderWay(REPORT(me), HELLO) -> Send(REPORT(me), HELLO) }
  /* SENSORS of another tick than the one to compute are a repetition. Of the tick that a module takes no part in they say that the sim
     has heard its acknowledgement; so does every later one. */
  :: atomic {
       Runs(me) && net[SENSORS(me)] != 0 ->
       Receive(SENSORS(me), k);
       if
       :: k != NOTHING && Has(told, me) && !TakesPart(me, k) ->
          assert(!LOGGER || whole >= LOSE);    /* The logger wants nothing of it again. */
          stage[me] = LEFT
       :: k == tick[me] && !Has(told, me) -> sensed[me] = true
       :: else
       fi;
       k = 0;
       TryCompute(me)
     }
  /* Answers that the sim or the logger asks for are kept, and sent again. */
  :: atomic {
       Runs(me) && net[ASK_ACTUATOR(me)] != 0 ->
       Receive(ASK_ACTUATOR(me), k);
       if :: Keeps(tick[me], k) -> Send(ACTUATOR(me), k) :: else fi;
       k = 0
     }
  :: atomic {
       Runs(me) && net[ASK_RECORD(me)] != 0 ->
       Receive(ASK_RECORD(me), k);
       if :: Keeps(tick[me], k) -> Send(RECORD(me), k) :: else fi;
       k = 0
     }
  /* END and LEAVE_ALONE are acknowledged each time that they come. Only who has heard one of them believes that the run is over. */
  :: atomic {
       Runs(me) && net[FAREWELL(me)] != 0 ->
       Receive(FAREWELL(me), k);
       if
       :: k == END || k == LEAVE_ALONE -> SayTotals(me)
       :: k == LEAVE && Has(told, me) -> stage[me] = LEFT
       :: else
       fi;
       k = 0
     }
  /* Who misses LEAVE leaves after a silence, and who has not even heard END gives up, which happens in no run that ends well. */
  :: d_step {
       Runs(me) && phase == DONE && net[FAREWELL(me)] == 0 ->
       if
       :: Has(told, me) -> stage[me] = LEFT
       :: else -> assert(!clean); stage[me] = FORSAKEN
       fi
     }
  /* The process is killed between two messages, and what it had not saved is gone. */
  :: d_step { Runs(me) && MayDie(me) -> Die(me) }
  /* Another one goes on where it was, in silence but at the start and the end; or none does. Of what was under way to the dead one,
     anything may have come to it and be lost. */
  :: atomic {
       stage[me] == DEAD ->
       for (k : 0 .. TO_MODULES / MODULES - 1) {
         if :: net[k * MODULES + me] != 0 -> net[k * MODULES + me] = 0 :: skip fi
       }
       k = 0;
       stage[me] = RUNS;
       if :: tick[me] == 0 -> Send(REPORT(me), HELLO) :: else fi;
       if :: Has(told, me) -> SayTotals(me) :: else fi
     }
  :: d_step { stage[me] == DEAD && deaths > 0 -> deaths--; stage[me] = LOST }
  od
}
