// The motion at a state of the page: its transient, the steady motion, and all that is shown of it.
import type { Core, Segment, Stop } from "./core.ts";
import { POINT } from "./core.ts";
import { cyclicStart, globalMap, rotated } from "./itinerary.ts";
import { multipliers } from "./multipliers.ts";
import type { Complex } from "./multipliers.ts";
import { PLAIN_UNITS, unitsOf } from "./device.ts";
import type { Units } from "./device.ts";
import { parameters, startOf } from "./state.ts";
import type { State } from "./state.ts";
import type { Parameters, Triple } from "./core.ts";

export interface Motion {
  parameters: Parameters;
  /** In which it is shown; all numbers here are without units. */
  units: Units;
  period: number; // of the excitation
  stop: Stop;
  /** Outcome that was undecided, if the run ended early. */
  why: string;
  /** Excitation periods of the motion; 0 where it has not become periodic. */
  periodNumber: number;
  progression: number; // per excitation period
  velocity: number;
  work: number; // per excitation period
  damperLoss: number;
  frictionLoss: number;
  multipliers: Complex[] | null;
  /** One period of the motion as the paper begins it, or the last periods of the run. */
  cycle: Segment[];
  globalMap: string;
  /** Drawn part: `turns` excitation periods from phase 0 on. */
  turns: number;
  segments: Segment[];
  points: Float64Array; // POINT numbers each
  wide: number; // how many of the switches drawn 106 bits decided
  passed: number; // periods before what is drawn
  byNewton: boolean; // whether Newton's method led to it
  end: Triple; // state at phase 0 where the drawing begins
}

const PER_PERIOD = 240; // points
const UNSETTLED = 8; // periods drawn of a motion that is not periodic
export const PATIENCE = 1500; // milliseconds for a run on the main thread

/** Runs the map from the state's start, and takes the motion that it has come to. */
export function motionAt(core: Core, state: State): Motion {
  const p = parameters(state);
  core.limit(PATIENCE);
  core.prepare(p);
  const { x_r, v_r, v_c, phase } = startOf(state);
  core.start([x_r, v_r, v_c], phase);
  const ended = core.settle(state.periods);
  const steady = ended === "done" ? core.steady() : { periodNumber: 0, advance: 0, switches: 0, never: 0, byNewton: false };
  const resting = !steady.periodNumber && steady.never ? 1 : steady.periodNumber;
  const begin = core.where();
  const turns = ended === "done" ? resting || UNSETTLED : 0;
  const units = state.units === "device" ? unitsOf(state) : PLAIN_UNITS;
  return taken(core, p, units, ended, steady.never && !steady.switches ? 1 : resting, turns, begin.state, begin.periods, steady.byNewton);
}

function taken(core: Core, p: Parameters, units: Units, ended: Stop, periodNumber: number, turns: number, begin: Triple, passed: number, byNewton: boolean): Motion {
  const period = (2 * Math.PI) / p.omega;
  const base = { parameters: p, units, period, periodNumber, turns, end: begin, passed, byNewton };
  const again = turns ? core.record(periodNumber ? 2 * turns + 1 : turns) : "done";
  const stop = ended !== "done" ? ended : again === "full" ? "done" : again;
  const closed = periodNumber && stop === "done" ? core.closed() : null;
  const all = core.segments();
  const cycle = closed ? rotated(closed.cycle, cyclicStart(closed.cycle.map((s) => s.field))) : all;
  const drawn = turns ? core.record(turns) : "done"; // continues: the same motion, from phase 0
  const segments = core.segments();
  const points = core.points(period / PER_PERIOD);
  shift(points, segments);
  const total = segments.reduce((sum, s) => sum + s.advance, 0);
  const progression = closed ? closed.advance / periodNumber : turns ? total / turns : 0;
  const per = periodNumber || 1;
  return {
    ...base,
    stop: stop === "done" && drawn !== "done" && drawn !== "full" ? drawn : stop,
    why: stop === "open" ? core.whyOpen() : "",
    progression,
    velocity: progression / period,
    work: closed ? closed.work / per : NaN,
    damperLoss: closed ? closed.damperLoss / per : NaN,
    frictionLoss: closed ? closed.frictionLoss / per : NaN,
    multipliers: closed?.converged ? multipliers(closed.matrix) : null,
    cycle,
    globalMap: closed ? globalMap(cycle) : resting(segments, periodNumber),
    segments,
    points,
    wide: segments.filter((s) => s.wide).length,
  };
}

/** A field that is never left is a motion of one segment. */
function resting(segments: readonly Segment[], periodNumber: number): string {
  const only = segments[0];
  return periodNumber && only && segments.every((s) => s.field === only.field)
    ? `Id_{Σ${only.field},F${only.field},Σ${only.field}}`
    : "";
}

/** Times from 0 and positions from 0 at the beginning of what is drawn. */
function shift(points: Float64Array, segments: readonly Segment[]): void {
  const first = segments[0];
  if (!first) return;
  const [time, place] = [points[1] ?? 0, first.position];
  for (let i = 0; i < points.length; i += POINT) {
    points[i + 1] = (points[i + 1] ?? 0) - time;
    points[i + 5] = (points[i + 5] ?? 0) - place;
  }
}
