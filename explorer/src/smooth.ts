// Smooth bifurcations of an orbit: the root of a test function of its multipliers along its branch.
import type { MarkJob } from "./jobs.ts";
import type { Runner, Side } from "./marks.ts";
import { digits, numbers } from "./itinerary.ts";
import { TESTS } from "./multipliers.ts";
import type { Matrix } from "./multipliers.ts";

const REACHES = [1e-9, 1e-6, 1e-4, 1e-2]; // of the interval: how far off the second orbit is, from which a branch is known
const BIRTH = 1e-10;
const PERIODS = 18; // no motion that the library finds is longer

interface Place {
  at: number; // the part of the start that is held
  value: number; // of the parameter
  matrix: Matrix;
}

/** The bifurcation in a range at which the orbit of `from` ends, of the names given; null where there is none. */
export function smooth(
  core: Runner,
  job: MarkJob,
  from: Side,
  [low, high]: readonly [number, number],
  settle: (from: Side) => boolean,
  names: readonly string[] = TESTS.map(({ name }) => name),
): { value: number; doubt: number; name: string } | null {
  for (const reach of REACHES)
    for (const test of TESTS) {
      if (!names.includes(test.name) || !settle(from)) continue;
      // Away from the event the orbit is sure to be there.
      const away = from.value <= (low + high) / 2 ? -1 : 1;
      const pair = twoPlaces(core, job, from, away * reach * Math.abs(job.to - job.from));
      const found = pair && root(core, job, pair, test.at);
      if (!found || found.value < low || found.value > high || !passes(core, job, from, found.value)) continue;
      // At a period doubling the parameter has an extremum along the doubled orbit: known to half the digits only.
      if (test.name === "fold" && halved(core.durations())) return { value: found.value, doubt: found.doubt + BIRTH, name: "period doubling" };
      return { ...found, name: test.name };
    }
  return null;
}

/** True if the map itself passes exactly the orbit's segments there. */
function passes(core: Runner, job: MarkJob, from: Side, value: number): boolean {
  const p = { ...job.base, [job.x]: value };
  const [x = 0, v = 0, w = 0, angle = 0] = core.orbitWithin();
  const turn = 2 * Math.PI;
  core.prepare(p);
  core.start([x, v, w], Math.min((((angle % turn) + turn) % turn) / p.omega, (turn / p.omega) * (1 - 2 ** -52)));
  const n = numbers(from.itinerary).length;
  const stop = core.record(PERIODS);
  const run = core.segments().slice(0, n).map(({ field }) => field);
  return (stop === "done" || stop === "full") && run.length === n && digits(run) === from.itinerary;
}

/** True if an orbit is another one twice: the start of a doubled branch. */
function halved(durations: readonly number[]): boolean {
  const half = durations.length / 2;
  return Number.isInteger(half) && durations.every((one, i) => Math.abs(one - (durations[(i + half) % (2 * half)] ?? NaN)) < 1e-3 * (1 + one));
}

/** The orbit where it was found and a step off, and the part of the start that moves most between. */
function twoPlaces(core: Runner, job: MarkJob, from: Side, step: number): { pin: number; places: [Place, Place] } | null {
  const begun = core.orbitStart();
  const here = core.follow();
  const value = from.value + step;
  core.prepare({ ...job.base, [job.x]: value });
  const there = here && core.follow();
  if (!here || !there) return null;
  const starts = core.orbitStart();
  const moved = starts.map((one, i) => Math.abs(one - (begun[i] ?? NaN)));
  const pin = moved.indexOf(Math.max(...moved));
  if (!((moved[pin] ?? 0) > 0)) return null;
  return { pin, places: [{ at: starts[pin] ?? NaN, value, matrix: there }, { at: begun[pin] ?? NaN, value: from.value, matrix: here }] };
}

/** The secant method along the branch; a step on which the orbit is lost is halved. */
function root(core: Runner, job: MarkJob, { pin, places }: { pin: number; places: [Place, Place] }, test: (m: Matrix) => number): { value: number; doubt: number } | null {
  let [before, now] = places;
  for (let k = 0; k < 60; k++) {
    const [f, g] = [test(before.matrix), test(now.matrix)];
    const slope = (g - f) / (now.at - before.at);
    const reach = 8 * Math.abs(now.at - before.at);
    let step = Math.max(-reach, Math.min(reach, -g / slope));
    if (!Number.isFinite(step)) return null;
    const rounding = 4 * 2 ** -53 * Math.max(1, Math.abs(now.at));
    if (Math.abs(step) <= rounding) return { value: now.value, doubt: doubtOf(before, now, step) };
    let next: ReturnType<Runner["along"]> = null;
    for (let tries = 0; tries < 6 && !next; tries++, step /= 2) {
      next = core.along(pin, now.at + step, job.x);
      if (next) break;
    }
    if (!next) return null;
    const place = { at: now.at + step, ...next };
    if (Math.abs(test(place.matrix)) >= Math.abs(g) && Math.abs(g) < 1e-9) return { value: now.value, doubt: doubtOf(before, now, step) };
    [before, now] = [now, place];
  }
  return null;
}

/** Change of the parameter along the branch by the last step, and by rounding. */
function doubtOf(before: Place, now: Place, step: number): number {
  const slope = Math.abs((now.value - before.value) / (now.at - before.at)) || 0;
  return 8 * 2 ** -53 * Math.abs(now.value) + 4 * slope * Math.abs(step);
}
