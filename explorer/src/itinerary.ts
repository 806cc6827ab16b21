// Itineraries: segments as the paper writes them, and where a cycle is begun to be written.

import { MODEL, PULSES, bound } from "./scene.ts";
import type { Parameter } from "./scene.ts";

const { FIELDS } = MODEL;
export const contact = (field: number): number => FIELDS[field]?.contact ?? 0;
export const touches = (field: number): boolean => contact(field) > 0;
export const drift = (field: number): number => FIELDS[field]?.drift ?? NaN;
const level = (field: number): number => FIELDS[field]?.level ?? 0;
export const sticks = (field: number): boolean => drift(field) === 0;

const DRIFTS = [0, 1, -1]; // in the order of the paper
const SURFACES = ["rest", "forward", "backward"];
const surface = (of: number): string => SURFACES[DRIFTS.indexOf(of)] ?? "";

const SIDES = MODEL.SPRINGS.length > 1 ? ["no contact", "contact in front", "contact behind"] : ["no contact", "contact"];

/** Description of a field. */
export const meaning = (field: number): string =>
  `${SIDES[contact(field)] ?? ""}, the capsule ${sticks(field) ? "sticks" : `drifts ${surface(drift(field))}`}${PULSES.length ? `, the drive is ${level(field) ? "low" : "high"}` : ""}`;

/** Contact comes first, and of it rest, then forward and backward drift. */
function rank(field: number): number {
  const side = (contact(field) + SIDES.length - 1) % SIDES.length;
  return (side * DRIFTS.length + DRIFTS.indexOf(drift(field))) * 2 + level(field);
}

/** Index of the segment at which the paper begins a cycle: that with the least sequence of ranks. */
export function cyclicStart(fields: readonly number[]): number {
  const ranks = fields.map(rank);
  const n = ranks.length;
  let best = 0;
  for (let i = 1; i < n; i++)
    if (before(ranks, i, best)) best = i;
  return best;
}

/** True if ranks[i:] + ranks[:i] is less than ranks[j:] + ranks[:j]. */
function before(ranks: readonly number[], i: number, j: number): boolean {
  const n = ranks.length;
  for (let k = 0; k < n; k++) {
    const difference = (ranks[(i + k) % n] ?? 0) - (ranks[(j + k) % n] ?? 0);
    if (difference) return difference < 0;
  }
  return false;
}

export function rotated<T>(items: readonly T[], by: number): T[] {
  return [...items.slice(by), ...items.slice(0, by)];
}

/** Description of the edge of the drive that ends a field's segment before another's; "" for no edge. */
export const edgeOf = (field: number, next: number): string =>
  level(field) === level(next) ? "" : `${level(next) ? "fall" : "rise"} of the drive`;

export interface Step {
  field: number;
  source: number;
  target: number;
}

export const localMap = (s: Step): string => `P_{Σ${s.target},F${s.field},Σ${s.source}}`;

/** A motion as a composition of local maps, right to left. */
export function globalMap(steps: readonly Step[]): string {
  const only = steps[0];
  if (steps.length === 1 && only) return localMap(only).replace("P", "Id");
  return [...steps].reverse().map(localMap).join(" ∘ ");
}

// Numbers of fields are one digit each in a scene with few of them.
const BETWEEN = MODEL.MODES.length > 9 ? " " : "";
export const written = (fields: readonly number[]): string => fields.join(BETWEEN);
/** The numbers of the fields of an itinerary that is written. */
export const numbers = (itinerary: string): string[] => (itinerary ? itinerary.split(BETWEEN) : []);

/** A cycle's fields from the segment at which it is begun to be written. */
export const digits = (fields: readonly number[]): string => written(rotated(fields, cyclicStart(fields)));

export const spelled = (itinerary: string): string => numbers(itinerary).map((number) => `F${number}`).join(" ");

/** True if one itinerary is the other one twice. */
export const doubled = (long: string, short: string): boolean =>
  short !== "" && long === short + BETWEEN + short;

/** The name of a line or corner point on a stop, or beside it, at rest or not. */
const place = (v_c: number, gap: number, v_r: number, level: number): string => MODEL.PLACES[[v_c, gap, v_r, level].join()] ?? "";

/** Of a pull at rest: 2 (-2) on its bound forward (backward), 3 (-3) beyond it, 0 within. */
function levelOf(pull: number, p: Record<Parameter, number>): number {
  const way = pull > 0 ? 1 : -1;
  const over = Math.abs(pull) - bound(p, way);
  return way * (Math.abs(over) < 1e-9 * bound(p, way) ? 2 : over > 0 ? 3 : 0) || 0;
}

/** Type and line of a bifurcation, by the fields before, at and after its segment of no duration. */
export function eventName(before: number, during: number, after: number, pull: number, v_r: number, p: Record<Parameter, number>): string {
  const edge = edgeOf(before, during) || edgeOf(during, after);
  if (edge) return `edge: a switch at the ${edge}`;
  const stop = (contact(before) || contact(during) || contact(after)) === 2 ? -2 : 0;
  if (contact(before) !== contact(after)) return `boundary-intersection crossing on ${place(0, stop, Math.sign(v_r), levelOf(pull, p))}`;
  if (contact(during) !== contact(before)) return `grazing on ${place(1, stop, 0, 0)}`;
  const line = place(0, [-1, 1, -3][contact(during)] ?? 0, 0, pull > 0 ? 2 : -2);
  const [b, d, a] = [drift(before), drift(during), drift(after)];
  if (b === a) return `${b ? "grazing-sliding" : "adding-sliding"} on ${line}`;
  if (d === 0 && a === -b) return `crossing-sliding on ${line}`;
  if (d === -b && a === 0) return `switching-sliding on ${line}`;
  return `change from ${surface(b)} to ${surface(a)} on ${line}`;
}
