// The C library as WebAssembly: the same map, the same certificates, the same 106 bits as elsewhere.
import { PARAMETERS } from "./fields.ts";
import type { Parameter } from "./fields.ts";
import type { Matrix } from "./multipliers.ts";

export type Parameters = Record<Parameter, number>;
export type Triple = readonly [number, number, number];

/** Why a run came back: the C library's `capsule_stop`. */
export const STOPS = ["done", "full", "open", "stopped", "refused"] as const;
export type Stop = (typeof STOPS)[number];
/** How a segment ended: the C library's `capsule_outcome`. */
export const OUTCOMES = ["regular", "graze", "corner", "sliding tangency", "never", "undecided", "end"] as const;

interface Exports {
  memory: WebAssembly.Memory;
  _initialize(): void;
  numbers_at(): number;
  given_at(): number;
  digest(): number;
  prepare(): void;
  start(x_r: number, v_r: number, v_c: number, phase: number): void;
  settle(periods: number): number;
  steady(tolerance: number): number;
  record(periods: number): number;
  count(): number;
  why_open(): number;
  where(): void;
  segments(): number;
  points(step: number): number;
  closed(): number;
  follow(): number;
  bifurcation(zero: number, free: number): number;
  along(pin: number, at: number, free: number): number;
  orbit_start(): void;
  orbit_within(): void;
  durations(): number;
  column(periods: number, tolerance: number): number;
  cell(periods: number): number;
}

export interface Segment {
  field: number;
  source: number;
  target: number;
  outcome: string;
  wide: boolean;
  startTurn: number;
  endTurn: number;
  startAngle: number;
  endAngle: number;
  start: Triple;
  end: Triple;
  duration: number;
  position: number;
  advance: number;
}

export interface Steady {
  /** Excitation periods of the motion; 0 if it is not periodic. */
  periodNumber: number;
  advance: number;
  switches: number;
  /** The field at the end of the run, if it is proved never to be left. */
  never: number;
  /** Whether Newton's method led to it, from a run that settles slowly. */
  byNewton: boolean;
}

export interface Closed {
  /** Whether Newton's method closed the orbit. */
  converged: boolean;
  matrix: Matrix;
  advance: number;
  residual: number;
  first: number;
  switches: number;
  work: number;
  damperLoss: number;
  frictionLoss: number;
}

export interface Event {
  value: number;
  state: Triple;
  force: number;
  fields: readonly [number, number, number];
  residual: number;
}

export interface Column {
  stop: Stop;
  periodNumber: number;
  progression: number;
  work: number;
  stick: number;
  contact: number;
  states: Triple[];
  impacts: number[];
  fields: number[];
  matrix: Matrix | null;
  end: Triple;
}

export interface Cell {
  stop: Stop;
  periodNumber: number;
  /** Per period; NaN where a motion never leaves a field in which the capsule drifts. */
  progression: number;
  fields: number[];
  /** Mean of the motion's states at phase 0. */
  mean: Triple;
}

export const POINT = 7; // numbers of a point: segment, time, x_r, v_r, v_c, x_c, P

export class Core {
  private readonly c: Exports;
  private readonly numbers: Float64Array;
  private readonly given: Float64Array;
  /** When a run is given up, by the clock. */
  private deadline = Infinity;

  private constructor(exports: Exports) {
    this.c = exports;
    this.numbers = new Float64Array(exports.memory.buffer, exports.numbers_at(), 1 << 17);
    this.given = new Float64Array(exports.memory.buffer, exports.given_at(), PARAMETERS.length);
  }

  static async load(code: WebAssembly.Module): Promise<Core> {
    let core: Core | undefined;
    const late = (): number => (core && performance.now() > core.deadline ? 1 : 0);
    const instance = await WebAssembly.instantiate(code, { page: { late } });
    const exports = instance.exports as unknown as Exports;
    exports._initialize();
    core = new Core(exports);
    return core;
  }

  /** Digest of what the library's kernels were generated from. */
  digest(): string {
    const bytes = new Uint8Array(this.c.memory.buffer, this.c.digest(), 32);
    return new TextDecoder().decode(bytes.subarray(0, bytes.indexOf(0)));
  }

  /** Gives runs up that take longer than so many milliseconds from now. */
  limit(milliseconds: number): void {
    this.deadline = performance.now() + milliseconds;
  }

  prepare(p: Parameters): void {
    PARAMETERS.forEach((name, i) => (this.given[i] = p[name]));
    this.c.prepare();
  }

  start([x_r, v_r, v_c]: Triple, phase = 0): void {
    this.c.start(x_r, v_r, v_c, phase);
  }

  settle(periods: number): Stop {
    return stop(this.c.settle(periods));
  }

  record(periods: number): Stop {
    return stop(this.c.record(periods));
  }

  whyOpen(): string {
    return OUTCOMES[this.c.why_open()] ?? "undecided";
  }

  steady(tolerance = 1e-9): Steady {
    this.c.steady(tolerance);
    const [periodNumber = 0, advance = 0, switches = 0, field = 0, never = 0, byNewton = 0] = this.numbers;
    return { periodNumber, advance, switches, never: never ? field : 0, byNewton: byNewton !== 0 };
  }

  where(): { state: Triple; position: number; periods: number } {
    this.c.where();
    const [x = 0, v = 0, w = 0, , position = 0, periods = 0] = this.numbers;
    return { state: [x, v, w], position, periods };
  }

  segments(): Segment[] {
    const size = this.c.segments();
    return Array.from({ length: this.c.count() }, (_, i) => {
      const n = (k: number): number => this.numbers[i * size + k] ?? NaN;
      return {
        field: n(0),
        source: n(1),
        target: n(2),
        outcome: OUTCOMES[n(3)] ?? "undecided",
        wide: n(4) !== 0,
        startTurn: n(6),
        endTurn: n(7),
        startAngle: n(8),
        endAngle: n(9),
        start: [n(10), n(11), n(12)],
        end: [n(13), n(14), n(15)],
        duration: n(16),
        position: n(17),
        advance: n(18),
      };
    });
  }

  /** Points of the recorded segments, `POINT` numbers each; valid until the next call. */
  points(step: number): Float64Array {
    return this.numbers.subarray(0, POINT * this.c.points(step));
  }

  closed(): Closed | null {
    const done = this.c.closed();
    if (!done) return null;
    const n = (k: number): number => this.numbers[k] ?? NaN;
    return {
      converged: done > 0,
      matrix: [...this.numbers.subarray(0, 9)],
      advance: n(9),
      residual: n(10),
      first: n(11),
      work: n(12),
      damperLoss: n(13),
      frictionLoss: n(14),
      switches: n(15),
    };
  }

  /** The monodromy matrix of the orbit that `closed` left, followed to the prepared parameters. */
  follow(): Matrix | null {
    return this.c.follow() ? [...this.numbers.subarray(0, 9)] : null;
  }

  /** The orbit along its branch at which part `pin` of its start is `at`: the parameter's value and the monodromy. */
  along(pin: number, at: number, free: Parameter): { value: number; matrix: Matrix } | null {
    if (!this.c.along(pin, at, PARAMETERS.indexOf(free))) return null;
    return { value: this.numbers[9] ?? NaN, matrix: [...this.numbers.subarray(0, 9)] };
  }

  /** Where the orbit starts: x_r, v_r, v_c and the forcing angle. */
  orbitStart(): number[] {
    this.c.orbit_start();
    return [...this.numbers.subarray(0, 4)];
  }

  /** State and forcing angle within the orbit's first segment, off every switch. */
  orbitWithin(): number[] {
    this.c.orbit_within();
    return [...this.numbers.subarray(0, 4)];
  }

  durations(): number[] {
    const n = this.c.durations();
    return [...this.numbers.subarray(0, n)];
  }

  bifurcation(zero: number, free: Parameter): Event | null {
    if (!this.c.bifurcation(zero, PARAMETERS.indexOf(free))) return null;
    const [value = NaN, x = 0, v = 0, w = 0, force = 0, before = 0, during = 0, after = 0, residual = NaN] = this.numbers;
    return { value, state: [x, v, w], force, fields: [before, during, after], residual };
  }

  column(periods: number): Column {
    const end = stop(this.c.column(periods, 1e-9));
    const n = this.numbers;
    const at = (k: number): number => n[k] ?? NaN;
    const [states, impacts, itinerary] = [HEAD, HEAD + 3 * STATES, HEAD + 3 * STATES + IMPACTS];
    return {
      stop: end,
      periodNumber: at(1),
      progression: at(4),
      work: at(5),
      stick: at(6),
      contact: at(7),
      states: Array.from({ length: at(8) }, (_, i): Triple => [at(states + 3 * i), at(states + 3 * i + 1), at(states + 3 * i + 2)]),
      impacts: [...n.subarray(impacts, impacts + at(9))],
      fields: at(1) && !at(10) && at(3) ? [at(3)] : fieldsOf(n.subarray(itinerary, itinerary + at(10))),
      matrix: at(14) ? [...n.subarray(itinerary + ITINERARY_ROOM, itinerary + ITINERARY_ROOM + 9)] : null,
      end: [at(11), at(12), at(13)],
    };
  }

  cell(periods: number): Cell {
    const end = stop(this.c.cell(periods));
    const n = this.numbers;
    const [, periodNumber = 0, never = 0, progression = 0, count = 0, x = 0, v = 0, w = 0] = n;
    const fields = !count && never ? [never] : fieldsOf(n.subarray(CELL_HEAD, CELL_HEAD + count));
    return { stop: end, periodNumber: never && !periodNumber ? 1 : periodNumber, progression, fields, mean: [x, v, w] };
  }
}

// As in core/sweep.c.
const HEAD = 16;
const CELL_HEAD = 8;
const STATES = 32;
const IMPACTS = 1024;
const ITINERARY_ROOM = 4096;

const stop = (code: number): Stop => STOPS[code] ?? "refused";
const fieldsOf = (codes: Float64Array): number[] => Array.from(codes, (code) => code % 16);
