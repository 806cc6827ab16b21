// A chart of motions over two parameters or starts, coarse to fine: a cell is run where the corners of its
// square differ, and in the end wherever a cell that was not run lies beside one of another colour.
import type { Cell } from "./core.ts";
import { extent } from "./draw/axes.ts";
import type { Axis } from "./fields.ts";
import { digits } from "./itinerary.ts";
import type { Pool } from "./pool.ts";
import { ofStarts, parameters, startOf } from "./state.ts";
import type { State } from "./state.ts";

const COARSE = 16;
const CHUNK = 48; // cells of a job
const STEEP = 0.15; // of all progressions' spread: corners that differ by more are not interpolated between
const SAME = 1e-5; // relative: what two cells' motions may differ by and be one attractor

export interface Region {
  itinerary: string;
  periodNumber: number;
  /** The motion of the first cell that was found in it. */
  cell: Cell;
  /** True for one attractor, and not all motions of its itinerary. */
  alone: boolean;
}

/** Source of the workers' jobs. */
export type Giver = Pick<Pool, "give" | "cancel">;

export class Chart {
  size = 0;
  regions: Region[] = [];
  /** By cell: the region's number, -1 unknown, -2 not periodic, -3 undecided. */
  of = new Int32Array(0);
  progressions = new Float64Array(0);
  /** Text beside its axes, which have no units even for a device. */
  plainly = "";
  x: Axis = "alpha";
  y: Axis = "gamma";
  xs: readonly [number, number] = [0, 1];
  ys: readonly [number, number] = [0, 1];
  step = 0; // what is drawn stands for so many cells
  computed = 0;
  coarse = 0; // milliseconds to the first whole picture
  took = 0;
  /** By cell: 0 not known, 1 run itself, 2 taken from the corners of its square. */
  known: Uint8Array = new Uint8Array(0);
  private numbers = new Map<string, number[]>();
  private ranks: number[] = [];
  private jobs = new Set<number>();
  private started = 0;
  private spread = 0; // of all progressions so far
  private state: State | null = null;

  constructor(
    private readonly pool: Giver,
    private readonly changed: () => void,
  ) {}

  get running(): boolean {
    return this.jobs.size > 0;
  }

  cancel(): void {
    for (const job of this.jobs) this.pool.cancel(job);
    this.jobs.clear();
    this.changed();
  }

  run(state: State): void {
    this.cancel();
    const n = (this.size = state.c_size);
    this.state = state;
    this.plainly = state.units === "device" ? ", dimensionless" : "";
    this.x = state.c_x as Axis;
    this.y = state.c_y as Axis;
    this.xs = [state.c_x0, state.c_x1];
    this.ys = [state.c_y0, state.c_y1];
    this.regions = [];
    this.numbers.clear();
    this.ranks = [];
    this.of = new Int32Array(n * n).fill(-1);
    this.progressions = new Float64Array(n * n).fill(NaN);
    this.known = new Uint8Array(n * n);
    this.computed = this.coarse = this.took = 0;
    this.started = performance.now();
    this.step = 0;
    this.level(COARSE);
  }

  /** A region's place by its area in the last whole picture, 0 for the largest: so it is coloured, as in the figures. */
  rank(region: number): number {
    return this.ranks[region] ?? region;
  }

  private order(): void {
    const counts = new Array<number>(this.regions.length).fill(0);
    for (const region of this.of) if (region >= 0) counts[region] = (counts[region] ?? 0) + 1;
    const itinerary = (region: number): string => this.regions[region]?.itinerary ?? "";
    const order = counts.map((_, region) => region).sort((a, b) => (counts[b] ?? 0) - (counts[a] ?? 0) || (itinerary(a) < itinerary(b) ? -1 : itinerary(a) > itinerary(b) ? 1 : 0));
    order.forEach((region, place) => (this.ranks[region] = place));
  }

  /** Middles of cells along both axes. */
  place(i: number, j: number): readonly [number, number] {
    const along = ([low, high]: readonly [number, number], k: number): number => low + ((high - low) * (k + 0.5)) / this.size;
    return [along(this.xs, i), along(this.ys, j)];
  }

  /** The cell at a place between the ends of the axes. */
  cell([x, y]: readonly [number, number]): readonly [number, number] {
    const along = ([low, high]: readonly [number, number], value: number): number =>
      Math.max(0, Math.min(this.size - 1, Math.floor(((value - low) / (high - low)) * this.size)));
    return [along(this.xs, x), along(this.ys, y)];
  }

  /** The nearest cell of the present grid that is known. */
  at(i: number, j: number): number {
    if (this.known[j * this.size + i] || this.step <= 1) return j * this.size + i;
    return this.node(j) * this.size + this.node(i);
  }

  private node(k: number): number {
    const low = Math.floor(k / this.step) * this.step;
    const high = Math.min(low + this.step, this.size - 1);
    return k - low <= high - k ? low : high;
  }

  private nodes(step: number): number[] {
    const found = [];
    for (let k = 0; k < this.size - 1; k += step) found.push(k);
    return [...found, this.size - 1];
  }

  private level(step: number): void {
    const wanted = [];
    const nodes = this.nodes(step);
    const before = this.step; // of the level before, 0 at first
    const [low, high] = extent(this.progressions.filter(Number.isFinite));
    this.spread = high - low;
    for (const j of nodes)
      for (const i of nodes) {
        const k = j * this.size + i;
        if (this.known[k]) continue;
        const same = before ? this.agreed(i, j, before) : null;
        if (same === null) wanted.push([i, j] as const);
        else {
          this.of[k] = this.of[same] ?? -1;
          this.progressions[k] = this.between(i, j, before);
          this.known[k] = 2;
        }
      }
    const after = (): void => {
      this.step = step;
      this.order();
      if (!this.coarse) this.coarse = performance.now() - this.started;
      if (step > 1) this.level(step >> 1);
      else this.borders();
      this.changed();
    };
    if (wanted.length) this.give(wanted, after);
    else after();
  }

  /** Runs what lies beside a cell of another colour and was not run, until there is no such cell. */
  private borders(): void {
    const n = this.size;
    const wanted = [];
    for (let j = 0; j < n; j++)
      for (let i = 0; i < n; i++) {
        const k = j * n + i;
        const beside = [i > 0 ? k - 1 : k, i < n - 1 ? k + 1 : k, j > 0 ? k - n : k, j < n - 1 ? k + n : k];
        if (this.known[k] === 2 && beside.some((other) => this.of[other] !== this.of[k])) wanted.push([i, j] as const);
      }
    if (wanted.length) this.give(wanted, () => this.borders());
    else {
      this.order();
      this.took = performance.now() - this.started;
    }
    this.changed();
  }

  /** The progression at a cell, linear in both directions between the corners of its square. */
  private between(i: number, j: number, step: number): number {
    const [i0, j0] = [Math.floor(i / step) * step, Math.floor(j / step) * step];
    const [i1, j1] = [Math.min(i0 + step, this.size - 1), Math.min(j0 + step, this.size - 1)];
    const at = (x: number, y: number): number => this.progressions[y * this.size + x] ?? NaN;
    const [right, up] = [i1 > i0 ? (i - i0) / (i1 - i0) : 0, j1 > j0 ? (j - j0) / (j1 - j0) : 0];
    const below = at(i0, j0) + right * (at(i1, j0) - at(i0, j0));
    return below + up * (at(i0, j1) + right * (at(i1, j1) - at(i0, j1)) - below);
  }

  /** A corner of the cell's square on the grid before, if all four are alike, their progressions among it; else null. */
  private agreed(i: number, j: number, step: number): number | null {
    const [i0, j0] = [Math.floor(i / step) * step, Math.floor(j / step) * step];
    const [i1, j1] = [Math.min(i0 + step, this.size - 1), Math.min(j0 + step, this.size - 1)];
    const corners = [j0 * this.size + i0, j0 * this.size + i1, j1 * this.size + i0, j1 * this.size + i1];
    const [first = 0] = corners;
    if (this.of[first] === -1 || corners.some((k) => this.of[k] !== this.of[first])) return null;
    const values = corners.map((k) => this.progressions[k] ?? NaN).filter(Number.isFinite);
    const [low, high] = values.length ? extent(values) : [0, 0];
    return high - low > STEEP * this.spread ? null : first;
  }

  private give(wanted: readonly (readonly [number, number])[], after: () => void): void {
    const state = this.state;
    if (!state) return;
    const base = parameters(state);
    let left = Math.ceil(wanted.length / CHUNK);
    for (let from = 0; from < wanted.length; from += CHUNK) {
      const part = wanted.slice(from, from + CHUNK);
      const places = part.map(([i, j]) => this.place(i, j));
      const { x_r, v_r, v_c, phase } = startOf(state);
      const start = { state: [x_r, v_r, v_c] as const, phase };
      const job = this.pool.give({ kind: "cells", base, start, x: this.x, y: this.y, places, periods: state.c_periods }, (answer) => {
        if ("cells" in answer) {
          answer.cells.forEach((cell, k) => this.take(part[k] ?? [0, 0], cell));
          this.computed += answer.cells.length;
          this.changed();
        }
        if (!("done" in answer)) return;
        this.jobs.delete(job);
        if (--left === 0) after();
      });
      this.jobs.add(job);
    }
  }

  private take([i, j]: readonly [number, number], cell: Cell): void {
    const k = j * this.size + i;
    this.known[k] = 1;
    this.progressions[k] = cell.stop === "done" && cell.periodNumber ? cell.progression : NaN;
    this.of[k] = cell.stop !== "done" ? -3 : cell.periodNumber ? this.number(cell) : -2;
  }

  private number(cell: Cell): number {
    const itinerary = digits(cell.fields);
    const alone = this.state?.c_by === "attractor" && ofStarts(this.state);
    const known = this.numbers.get(itinerary) ?? [];
    for (const number of known) if (!alone || near(this.regions[number]?.cell, cell)) return number;
    const number = this.regions.push({ itinerary, periodNumber: cell.periodNumber, cell, alone }) - 1;
    this.numbers.set(itinerary, [...known, number]);
    return number;
  }
}

/** True if two motions of one system agree: equal itinerary, period number and mean state at phase 0. */
function near(one: Cell | undefined, other: Cell): boolean {
  return one?.periodNumber === other.periodNumber
    && one.mean.every((value, k) => Math.abs(value - (other.mean[k] ?? NaN)) <= SAME * (1 + Math.abs(value)));
}
