// Bifurcations between two values of a parameter: bisection on the itinerary, then the event's equation.
import type { Core, Parameters, Triple } from "./core.ts";
import type { Mark, MarkJob } from "./jobs.ts";
import { digits, doubled, eventName, numbers } from "./itinerary.ts";
import { smooth } from "./smooth.ts";

export interface Side {
  value: number;
  itinerary: string;
  end: Triple;
}

const NARROW = 1e-9; // of the first interval: two events nearer than that are not told apart
export const MOST = 24; // events looked for between two columns
const EARLY = 0.25; // of the first interval: how far beside a smooth bifurcation runs may still not settle
const SETTLED = 1e-3; // of the first interval: no wider than that, what is between the sides is one event
const LONG = 50; // times the periods of a column: after so many a motion is no transient any more

/** Functions of the library that the search uses. */
export type Runner = Pick<Core, "prepare" | "start" | "column" | "settle" | "steady" | "record" | "closed" | "follow" | "along" | "orbitStart" | "orbitWithin" | "segments" | "durations" | "bifurcation">;

/** An unfinished run gives no information on the motion. */
class Unfinished extends Error {}

export function marksBetween(core: Runner, job: MarkJob): Mark[] {
  const marks: Mark[] = [];
  const open = (why: string): Mark => {
    // The search goes upwards: results so far count, the rest of the interval is open.
    const high = Math.max(job.from, job.to);
    const low = Math.max(Math.min(job.from, job.to), ...marks.map((mark) => mark.value));
    return { name: `left open: ${why}`, exact: false, before: "", after: "", start: job.start, value: (low + high) / 2, doubt: (high - low) / 2 };
  };
  try {
    search(core, job, marks);
    return marks.length < MOST ? joined(core, job, marks) : [...marks, open(`more than ${MOST} events are here`)];
  } catch (error) {
    if (!(error instanceof Unfinished)) throw error;
    return [...marks, open("a run was not finished")];
  }
}

function search(core: Runner, job: MarkJob, marks: Mark[]): void {
  // From where the pass came, so that a motion that coexists with another is followed as it was.
  const first = side(core, job, job.from, job.start);
  const second = side(core, job, job.to, first.end);
  const [low, high] = job.from < job.to ? [first, second] : [second, first];
  split(core, job, low, high, marks, 0);
}

/** The motion's itinerary at a value; "" where it has not become periodic. */
function side(core: Runner, job: MarkJob, value: number, start: Triple, patience = 4): Side {
  core.prepare(parametersAt(job, value));
  core.start(start);
  let column = core.column(job.periods);
  // Next to a bifurcation a motion settles slowly.
  for (let tries = 0; tries < 3 && !column.periodNumber && column.stop === "done"; tries++) {
    core.start(column.end);
    column = core.column(patience * job.periods);
  }
  if (column.stop !== "done") throw new Unfinished();
  return { value, itinerary: column.periodNumber ? digits(column.fields) : "", end: column.end };
}

function split(core: Runner, job: MarkJob, low: Side, high: Side, marks: Mark[], depth: number): void {
  if (low.itinerary === high.itinerary || marks.length >= MOST) return;
  const width = high.value - low.value;
  const middle = low.value + width / 2;
  const last = depth > 40 || width <= NARROW * Math.abs(job.to - job.from) || middle <= low.value || middle >= high.value;
  const found = (depth >= 4 && low.itinerary && high.itinerary) || last ? solved(core, job, low, high) : null;
  if (found) {
    marks.push(found);
    return;
  }
  if (last) {
    const name = low.itinerary && high.itinerary ? "jump to another motion" : "end of a periodic motion";
    marks.push({ value: middle, doubt: width / 2, exact: false, name, before: low.itinerary, after: high.itinerary, start: low.end });
    return;
  }
  const between = side(core, job, middle, job.from < job.to ? low.end : high.end);
  if (between.itinerary === "" && (low.itinerary === "" || high.itinerary === "")) {
    // On one side nothing periodic: the last periodic motion is looked for.
    if (low.itinerary === "") split(core, job, between, high, marks, depth + 1);
    else split(core, job, low, between, marks, depth + 1);
    return;
  }
  split(core, job, low, between, marks, depth + 1);
  split(core, job, between, high, marks, depth + 1);
}

/** Between the end of one motion and the start of another there may be a long way. */
function joined(core: Runner, job: MarkJob, marks: Mark[]): Mark[] {
  const kept = [...marks].sort((a, b) => a.value - b.value);
  for (let i = 0; i + 1 < kept.length; i++) {
    const [one, other] = [kept[i], kept[i + 1]];
    if (!one || !other || one.after || other.before || !one.before || !other.after) continue;
    const up = job.from < job.to;
    const arrived = side(core, job, (one.value + other.value) / 2, one.start, LONG);
    if (arrived.itinerary !== (up ? other.after : one.before)) continue;
    // The mark at which the way merely took too long is none.
    const event = up ? one : other;
    kept.splice(i, 2, { ...event, before: one.before, after: other.after, name: event.exact ? event.name : "jump to another motion" });
  }
  return kept;
}

/** The one event between two sides, solved for along the orbit of one of them. */
function solved(core: Runner, job: MarkJob, low: Side, high: Side): Mark | null {
  const marked = (event: { value: number; doubt: number; name: string }): Mark => ({ ...event, exact: true, before: low.itinerary, after: high.itinerary, start: low.end });
  const sides = [low, high].filter((one) => one.itinerary).sort((a, b) => numbers(b.itinerary).length - numbers(a.itinerary).length);
  const settled = (from: Side): boolean => settle(core, job, from);
  const width = high.value - low.value;
  if (doubled(high.itinerary, low.itinerary) || doubled(low.itinerary, high.itinerary)) {
    // A motion still settling shows the longer itinerary on the wrong side of its birth.
    const early = Math.max(4 * width, width <= SETTLED * Math.abs(job.to - job.from) ? EARLY * Math.abs(job.to - job.from) : 0);
    const found = smooth(core, job, sides[1] ?? low, [low.value - early, high.value + early], settled, ["period doubling"]);
    return found && marked(found);
  }
  const slack = 1e-12 * Math.max(1, Math.abs(high.value));
  const range = [low.value - slack, high.value + slack] as const;
  for (const from of sides) {
    const found = shortest(core, job, from, range);
    if (found) return marked(found);
  }
  if (width > SETTLED * Math.abs(job.to - job.from)) return null;
  // The motion that is lost ends smoothly. As it settles slowly there, its end seemed to come before.
  const early = Math.max(width, EARLY * Math.abs(job.to - job.from));
  for (const from of sides) {
    const found = smooth(core, job, from, [low.value - early, high.value + early], settled);
    if (found) return marked(found);
  }
  return null;
}

/** Runs a side's motion once more, and closes its orbit. */
function settle(core: Runner, job: MarkJob, from: Side): boolean {
  core.prepare(parametersAt(job, from.value));
  core.start(from.end);
  if (core.settle(job.periods) !== "done") return false;
  const { periodNumber } = core.steady();
  return periodNumber > 0 && core.record(2 * periodNumber + 1) === "done" && core.closed()?.converged === true;
}

const parametersAt = (job: MarkJob, value: number): Parameters => ({ ...job.base, [job.x]: value });

/** A segment whose duration vanishes between the two sides, the shortest ones tried first. */
function shortest(core: Runner, job: MarkJob, from: Side, [low, high]: readonly [number, number]): { value: number; doubt: number; name: string } | null {
  if (!settle(core, job, from)) return null;
  const durations = core.durations();
  const order = durations.map((_, i) => i).sort((a, b) => (durations[a] ?? 0) - (durations[b] ?? 0));
  for (const i of order.slice(0, 4)) {
    const event = core.bifurcation(i, job.x);
    if (!event || event.value < low || event.value > high) continue;
    const [before, during, after] = event.fields;
    return {
      value: event.value,
      doubt: 4 * Math.max(event.residual, 2 ** -53 * Math.abs(event.value)),
      name: eventName(before, during, after, event.force, event.state[1], parametersAt(job, event.value)),
    };
  }
  return null;
}
