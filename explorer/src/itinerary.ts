// Itineraries: segments as the paper writes them, and where a cycle is begun to be written.

import { FIELDS } from "../../generated/capsule/page/model.ts";

export const touches = (field: number): boolean => (FIELDS[field]?.contact ?? 0) > 0;
export const drift = (field: number): number => FIELDS[field]?.drift ?? NaN;
export const sticks = (field: number): boolean => drift(field) === 0;

const DRIFTS = [0, 1, -1]; // in the order of the paper
const SURFACES = ["rest", "forward", "backward"];
const surface = (of: number): string => SURFACES[DRIFTS.indexOf(of)] ?? "";

/** A field in words. */
export const meaning = (field: number): string =>
  `${touches(field) ? "contact" : "no contact"}, the capsule ${sticks(field) ? "sticks" : `drifts ${surface(drift(field))}`}`;

const rank = (field: number): number => DRIFTS.indexOf(drift(field)) + (touches(field) ? 0 : DRIFTS.length);

/** Index of the segment at which the paper begins a cycle: that with the least sequence of ranks. */
export function cyclicStart(fields: readonly number[]): number {
  const ranks = fields.map(rank);
  const n = ranks.length;
  let best = 0;
  for (let i = 1; i < n; i++)
    if (before(ranks, i, best)) best = i;
  return best;
}

/** Whether ranks[i:] + ranks[:i] is less than ranks[j:] + ranks[:j]. */
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

/** The digits of a cycle's fields from the segment at which it is begun to be written. */
export function digits(fields: readonly number[]): string {
  return rotated(fields, cyclicStart(fields)).join("");
}

export const spelled = (itinerary: string): string => [...itinerary].map((digit) => `F${digit}`).join(" ");

/** Whether one itinerary is the other one twice. */
export const doubled = (long: string, short: string): boolean =>
  short !== "" && long === short + short;

/** Type and line of a bifurcation, by the fields before, at and after its segment of no duration. */
export function eventName(before: number, during: number, after: number, force: number, v_r: number, f_b: number): string {
  if (touches(before) !== touches(after)) {
    const inside = Math.abs(force) < f_b * (1 - 1e-9);
    const bound = Math.abs(Math.abs(force) - f_b) < 1e-9 * f_b;
    const line = bound ? (force > 0 ? "O1" : "O2") : inside ? (v_r > 0 ? "L6" : "L7") : v_r > 0 ? "L5" : force < 0 ? "L8" : "L10";
    return `boundary-intersection crossing on ${line}`;
  }
  if (touches(during) !== touches(before)) return "grazing on L9";
  const line = `L${(force > 0 ? 1 : 2) + (touches(during) ? 2 : 0)}`;
  const [b, d, a] = [drift(before), drift(during), drift(after)];
  if (b === a) return `${b ? "grazing-sliding" : "adding-sliding"} on ${line}`;
  if (d === 0 && a === -b) return `crossing-sliding on ${line}`;
  if (d === -b && a === 0) return `switching-sliding on ${line}`;
  return `change from ${surface(b)} to ${surface(a)} on ${line}`;
}
