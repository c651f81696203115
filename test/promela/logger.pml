/* The logger of the lockstep protocol, and what the simulator has to do with it; part of lockstep.pml. */

#if LOGGER
/* ---- The sim with the logger. */

#define PollInVain (log_stage != LEFT && net[POLL] == 0 && net[PROGRESS] == 0 && (whole > log_ticks || existing <= sim_tick))

proctype SimWithLogger() {
  byte n;
  byte k;
  int sum;
end:
  do
  :: atomic {
       net[PROGRESS] != 0 ->
       Receive(PROGRESS, k);
       if :: k != NOTHING && k > log_ticks -> log_ticks = k :: else fi;
       k = 0;
       TryAdvance()
     }
  :: atomic {
       net[ASK_SIM_RECORD] != 0 ->
       Receive(ASK_SIM_RECORD, k);
       if :: Keeps(sim_tick + 1, k) -> Send(RECORD(LOG), k) :: else fi;
       k = 0
     }
  :: atomic {
       net[REPORT(LOG)] != 0 ->
       Receive(REPORT(LOG), k);
       if
       :: k == HELLO && (phase == START || phase == ENDING) -> greeted = With(greeted, LOG); TryBegin()
       :: k == TOTALS && phase == ENDING -> acknowledged = With(acknowledged, LOG); log_whole = (whole == sim_tick); TryConclude()
       :: k == VERDICT_HEARD && phase == CONCLUDING -> Finish()
       :: else
       fi;
       k = 0
     }
  /* Too far ahead of the logger, the sim asks how far that is; it tells so that all of this tick exists. */
  :: d_step { WaitsForLogger && PollInVain -> Send(POLL, sim_tick) }
  :: d_step {
       phase == ENDING && !Has(acknowledged, LOG) && log_stage != LEFT && !UnderWay(TO_LOGGER, END) &&
       !UnderWay(REPORT(LOG), TOTALS) && (!log_told || log_stage == IS_ENDED) ->
       Send(TO_LOGGER, END)
     }
  :: d_step { phase == CONCLUDING && !UnderWay(TO_LOGGER, VERDICT) && !UnderWay(REPORT(LOG), VERDICT_HEARD) -> Send(TO_LOGGER, VERDICT) }
  od
}

/* ---- The logger. */

#define RecordedOf(i, k) (Has(recorded[i], k) || !TakesPart(i, k))
#if MODULES == 1
#define RecordedAll(k) (Has(recorded[LOG], k) && RecordedOf(0, k))
#elif MODULES == 2
#define RecordedAll(k) (Has(recorded[LOG], k) && RecordedOf(0, k) && RecordedOf(1, k))
#else
#define RecordedAll(k) (Has(recorded[LOG], k) && RecordedOf(0, k) && RecordedOf(1, k) && RecordedOf(2, k))
#endif
/* How far nothing is missing, after something came; each tick more is acknowledged. */
inline CountWhole() {
  do
  :: RecordedAll(whole) -> whole++; Send(PROGRESS, whole)
  :: else -> break
  od
}
inline SayLogTotals() {
  Send(REPORT(LOG), TOTALS);
  vouched = With(vouched, LOG);
  log_stage = IS_ENDED
}

/* Nothing is under way that could bring what member p said in tick k. */
#define GapInVain(p, k) (!UnderWay(RECORD(p), k) && (p == LOG -> !UnderWay(ASK_SIM_RECORD, k) : Runs(p) && !UnderWay(ASK_RECORD(p), k)))

/* Records what member p of the run says; LOG stands for the sim. */
proctype LoggerWith(byte p) {
  byte k;
end:
  do
  :: atomic {
       log_stage == RUNS && net[RECORD(p)] != 0 ->
       Receive(RECORD(p), k);
       if
       :: k != NOTHING ->
          recorded[p] = With(recorded[p], k);
          if :: k > existing -> existing = k :: else fi;
          CountWhole()
       :: else
       fi;
       k = 0
     }
  /* What it lacks of the first tick that is not whole it asks for. */
  :: d_step {
       log_stage == RUNS && Lacks(p, whole) && (GapInVain(p, whole) || MayBeHasty) ->
       if :: GapInVain(p, whole) :: else -> CountHaste fi;
       if :: p == LOG -> Send(ASK_SIM_RECORD, whole) :: else -> Send(ASK_RECORD(p), whole) fi
     }
  /* Who could send it is dead: END is acknowledged without it. */
  :: d_step { log_stage == RUNS && log_told && GoneForGood(p) -> SayLogTotals() }
  od
}

proctype Logger() {
  byte k;
  Send(REPORT(LOG), HELLO);
end:
  do
  :: d_step { phase == START && !Has(greeted, LOG) && !UnderWay(REPORT(LOG), HELLO) -> Send(REPORT(LOG), HELLO) }
  :: atomic {
       log_stage != LEFT && net[POLL] != 0 ->
       Receive(POLL, k);
       if
       :: k != NOTHING ->
          if :: k + 1 > existing -> existing = k + 1 :: else fi;
          Send(PROGRESS, whole)
       :: else
       fi;
       k = 0
     }
  :: atomic {
       log_stage != LEFT && net[TO_LOGGER] != 0 ->
       Receive(TO_LOGGER, k);
       if
       :: k == END && log_stage == IS_ENDED -> SayLogTotals()
       :: k == END && log_stage == RUNS -> log_told = true; existing = (sim_tick > existing -> sim_tick : existing)
       :: k == VERDICT && log_stage == IS_ENDED ->
          log_clean = clean;
          Send(REPORT(LOG), VERDICT_HEARD)
       :: k == LEAVE -> assert(log_clean == clean); log_stage = LEFT
       :: else
       fi;
       k = 0
     }
  /* END is acknowledged once nothing is missing. */
  :: d_step { log_stage == RUNS && log_told && whole >= sim_tick -> SayLogTotals() }
  /* LEAVE was lost. */
  :: d_step { log_stage != LEFT && phase == DONE && net[TO_LOGGER] == 0 -> assert(log_clean == clean); log_stage = LEFT }
  od
}
#endif
