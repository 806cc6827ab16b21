// Bifurcations between two values of a parameter: bisection on the itinerary, then the event's equation.
import type { Core, Parameters, Triple } from "./core.ts";
import type { Mark, MarkJob } from "./jobs.ts";
import { digits, doubled, eventName } from "./itinerary.ts";
import { doubling } from "./multipliers.ts";

interface Side {
  value: number;
  word: string;
  end: Triple;
}

const NARROW = 1e-9; // of the first interval: two events nearer than that are not told apart
const MOST = 6; // events looked for between two columns

/** A run that was not finished says nothing of the motion. */
class Unfinished extends Error {}

export function marksBetween(core: Core, job: MarkJob): Mark[] {
  try {
    return marksIn(core, job);
  } catch (error) {
    if (!(error instanceof Unfinished)) throw error;
    const [low, high] = job.from < job.to ? [job.from, job.to] : [job.to, job.from];
    const open = { name: "left open: a run was not finished", exact: false, before: "", after: "" };
    return [{ ...open, value: (low + high) / 2, doubt: (high - low) / 2 }];
  }
}

function marksIn(core: Core, job: MarkJob): Mark[] {
  const marks: Mark[] = [];
  // From where the pass came, so that a motion that coexists with another is followed as it was.
  const first = side(core, job, job.from, job.start, "");
  const second = side(core, job, job.to, first.end, "");
  const [low, high] = job.from < job.to ? [first, second] : [second, first];
  split(core, job, low, high, marks, 0);
  return marks;
}

/** The motion's word at a value; "" where it has not become periodic. */
function side(core: Core, job: MarkJob, value: number, start: Triple, expected: string): Side {
  core.prepare({ ...job.base, [job.x]: value });
  core.start(start);
  let column = core.column(job.periods);
  // Next to a bifurcation a motion settles slowly.
  for (let tries = 0; tries < 3 && !column.multiple && column.stop === "done"; tries++) {
    core.start(column.end);
    column = core.column(4 * job.periods);
  }
  if (column.stop !== "done") throw new Unfinished();
  const word = column.multiple ? digits(column.fields) : expected;
  return { value, word, end: column.end };
}

function split(core: Core, job: MarkJob, low: Side, high: Side, marks: Mark[], depth: number): void {
  if (low.word === high.word || marks.length >= MOST) return;
  const width = high.value - low.value;
  const found = depth >= 4 || width < NARROW ? solved(core, job, low, high) : null;
  if (found) {
    marks.push(found);
    return;
  }
  const middle = low.value + width / 2;
  if (depth > 40 || width <= NARROW * Math.abs(job.to - job.from) || middle <= low.value || middle >= high.value) {
    marks.push({
      value: middle,
      doubt: width / 2,
      exact: false,
      name: low.word && high.word ? "jump to another motion" : "end of a periodic motion",
      before: low.word,
      after: high.word,
    });
    return;
  }
  const between = side(core, job, middle, job.from < job.to ? low.end : high.end, "");
  if (between.word === "" && (low.word === "" || high.word === "")) {
    // On one side nothing periodic: the last periodic motion is looked for.
    if (low.word === "") split(core, job, between, high, marks, depth + 1);
    else split(core, job, low, between, marks, depth + 1);
    return;
  }
  split(core, job, low, between, marks, depth + 1);
  split(core, job, between, high, marks, depth + 1);
}

/** The one event that turns one side's word into the other's, solved for. */
function solved(core: Core, job: MarkJob, low: Side, high: Side): Mark | null {
  const sides = [low, high].sort((a, b) => b.word.length - a.word.length);
  if (!low.word || !high.word) return null;
  if (doubled(high.word, low.word) || doubled(low.word, high.word)) return flip(core, job, low, high);
  for (const from of sides) {
    const event = shortest(core, job, from, low, high);
    if (event) return event;
  }
  return null;
}

function settle(core: Core, job: MarkJob, from: Side): number[] | null {
  core.prepare(parametersAt(job, from.value));
  core.start(from.end);
  if (core.settle(job.periods) !== "done") return null;
  const steady = core.steady();
  if (!steady.multiple) return null;
  if (core.record(2 * steady.multiple + 1) !== "done") return null;
  return core.closed()?.converged ? core.durations() : null;
}

const parametersAt = (job: MarkJob, value: number): Parameters => ({ ...job.base, [job.x]: value });

/** A segment whose duration vanishes between the two sides, the shortest ones tried first. */
function shortest(core: Core, job: MarkJob, from: Side, low: Side, high: Side): Mark | null {
  const durations = settle(core, job, from);
  if (!durations) return null;
  const order = durations.map((_, i) => i).sort((a, b) => (durations[a] ?? 0) - (durations[b] ?? 0));
  const slack = 1e-12 * Math.max(1, Math.abs(high.value));
  for (const i of order.slice(0, 4)) {
    const event = core.bifurcation(i, job.x);
    if (!event || event.value < low.value - slack || event.value > high.value + slack) continue;
    const [before, during, after] = event.fields;
    return {
      value: event.value,
      doubt: 4 * Math.max(event.residual, 2 ** -53 * Math.abs(event.value)),
      exact: true,
      name: eventName(before, during, after, event.force, event.state[1], job.base.f_b),
      before: low.word,
      after: high.word,
    };
  }
  return null;
}

/** A period doubling: the root of det(M + I) along the orbit of the shorter word. */
function flip(core: Core, job: MarkJob, low: Side, high: Side): Mark | null {
  const short = low.word.length < high.word.length ? low : high;
  if (!settle(core, job, short)) return null;
  const test = (value: number): number => {
    core.prepare(parametersAt(job, value));
    const matrix = core.follow();
    return matrix ? doubling(matrix) : NaN;
  };
  const width = high.value - low.value;
  // A motion still settling shows the longer word on the wrong side of its birth.
  let [a, b] = [low.value - 4 * width, high.value + 4 * width];
  if (short === high) [a, b] = [b, a];
  let [at, beyond] = [test(a), test(b)];
  if (!(at * beyond < 0)) return null;
  for (let k = 0; k < 100 && Math.abs(b - a) > 2 ** -52 * Math.abs(a); k++) {
    const middle = (a + b) / 2;
    const value = test(middle);
    if (Number.isNaN(value)) return null;
    if (value * at > 0) [a, at] = [middle, value];
    else [b, beyond] = [middle, value];
  }
  return { value: (a + b) / 2, doubt: 1e-11, exact: true, name: "period doubling", before: low.word, after: high.word };
}

