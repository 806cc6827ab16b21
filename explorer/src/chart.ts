// A chart of motions over two parameters or starts, coarse to fine: a cell is run where its corners differ.
import type { Cell } from "./core.ts";
import type { Axis } from "./fields.ts";
import { digits } from "./itinerary.ts";
import type { Pool } from "./pool.ts";
import { parameters } from "./state.ts";
import type { State } from "./state.ts";

const COARSE = 16;
const CHUNK = 48; // cells of a job

export interface Region {
  /** What cells of one colour have in common. */
  key: string;
  word: string;
  multiple: number;
  cell: Cell;
}

export class Chart {
  size = 0;
  regions: Region[] = [];
  /** By cell: the region's number, -1 unknown, -2 not periodic, -3 left open. */
  of = new Int32Array(0);
  progressions = new Float64Array(0);
  x: Axis = "alpha";
  y: Axis = "gamma";
  xs: readonly [number, number] = [0, 1];
  ys: readonly [number, number] = [0, 1];
  step = 0; // what is drawn stands for so many cells
  computed = 0;
  coarse = 0; // milliseconds to the first whole picture
  took = 0;
  private run_: Uint8Array = new Uint8Array(0); // whether a cell was run itself
  private numbers = new Map<string, number>();
  private jobs = new Set<number>();
  private started = 0;
  private state: State | null = null;

  constructor(
    private readonly pool: Pool,
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
    this.x = state.c_x as Axis;
    this.y = state.c_y as Axis;
    this.xs = [state.c_x0, state.c_x1];
    this.ys = [state.c_y0, state.c_y1];
    this.regions = [];
    this.numbers.clear();
    this.of = new Int32Array(n * n).fill(-1);
    this.progressions = new Float64Array(n * n).fill(NaN);
    this.run_ = new Uint8Array(n * n);
    this.computed = this.coarse = this.took = 0;
    this.started = performance.now();
    this.step = 0;
    this.level(COARSE);
  }

  /** Middles of cells along both axes. */
  place(i: number, j: number): readonly [number, number] {
    const along = ([low, high]: readonly [number, number], k: number): number => low + ((high - low) * (k + 0.5)) / this.size;
    return [along(this.xs, i), along(this.ys, j)];
  }

  /** The nearest cell of the present grid that was run. */
  at(i: number, j: number): number {
    if (this.run_[j * this.size + i] || this.step <= 1) return j * this.size + i;
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
    for (const j of nodes)
      for (const i of nodes) {
        const k = j * this.size + i;
        if (this.run_[k]) continue;
        const same = before ? this.agreed(i, j, before) : null;
        if (same === null) wanted.push([i, j] as const);
        else {
          this.of[k] = this.of[same] ?? -1;
          this.progressions[k] = this.between(i, j, before);
          this.run_[k] = 1;
        }
      }
    const after = (): void => {
      this.step = step;
      if (!this.coarse) this.coarse = performance.now() - this.started;
      if (step > 1) this.level(step >> 1);
      else this.took = performance.now() - this.started;
      this.changed();
    };
    if (wanted.length) this.give(wanted, after);
    else after();
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

  /** A corner of the cell's square on the grid before, if all four are alike; else null. */
  private agreed(i: number, j: number, step: number): number | null {
    const [i0, j0] = [Math.floor(i / step) * step, Math.floor(j / step) * step];
    const [i1, j1] = [Math.min(i0 + step, this.size - 1), Math.min(j0 + step, this.size - 1)];
    const corners = [j0 * this.size + i0, j0 * this.size + i1, j1 * this.size + i0, j1 * this.size + i1];
    const [first = 0] = corners;
    return this.of[first] !== -1 && corners.every((k) => this.of[k] === this.of[first]) ? first : null;
  }

  private give(wanted: readonly (readonly [number, number])[], after: () => void): void {
    const state = this.state;
    if (!state) return;
    const base = parameters(state);
    let left = Math.ceil(wanted.length / CHUNK);
    for (let from = 0; from < wanted.length; from += CHUNK) {
      const part = wanted.slice(from, from + CHUNK);
      const places = part.map(([i, j]) => this.place(i, j));
      const ask = { kind: "cells", base, start: [state.x_r, state.v_r, state.v_c], x: this.x, y: this.y, places, periods: state.c_periods } as const;
      const job = this.pool.give({ ...ask, start: [...ask.start] }, (answer) => {
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
    this.run_[k] = 1;
    this.progressions[k] = cell.stop === "done" && cell.multiple ? cell.progression : NaN;
    this.of[k] = cell.stop !== "done" ? -3 : cell.multiple ? this.number(cell) : -2;
  }

  private number(cell: Cell): number {
    const word = digits(cell.fields);
    // Motions of one itinerary that coexist differ in how far they go.
    const basin = this.state?.c_by === "attractor" || ["x_r", "v_r", "v_c"].includes(this.x);
    const key = basin ? `${word}@${cell.progression.toFixed(6)}` : word;
    const known = this.numbers.get(key);
    if (known !== undefined) return known;
    const number = this.regions.push({ key, word, multiple: cell.multiple, cell }) - 1;
    this.numbers.set(key, number);
    return number;
  }
}
