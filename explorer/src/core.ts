// The C library as WebAssembly: the same map, the same certificates, the same 106 bits as elsewhere.
import { FIELDS } from "../../generated/page/model.ts";
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
  why_open(): number;
  where(): void;
  segments(): number;
  points(step: number): number;
  closed(): number;
  follow(): number;
  hold(unknown: number, at: number, free: number, keep: number): number;
  orbit_within(): void;
  unknowns(): number;
  attain(periods: number, early: number): number;
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

  private get omega(): number {
    return this.given[PARAMETERS.indexOf("omega")] ?? NaN;
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
    return Array.from({ length: this.c.segments() }, (_, i) => {
      const n = (k: number): number => this.numbers[i * SEGMENT + k] ?? NaN;
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
    if (!this.c.hold(pin, at, PARAMETERS.indexOf(free), 1)) return null;
    return { value: this.numbers[9] ?? NaN, matrix: [...this.numbers.subarray(0, 9)] };
  }

  /** Where the orbit starts: x_r, v_r, v_c and the forcing angle. */
  orbitStart(): number[] {
    return this.unknowns().slice(0, 4);
  }

  /** State and forcing angle within the orbit's first segment, off every switch. */
  orbitWithin(): number[] {
    this.c.orbit_within();
    return [...this.numbers.subarray(0, 4)];
  }

  durations(): number[] {
    return this.unknowns().slice(4);
  }

  private unknowns(): number[] {
    const n = this.c.unknowns();
    return [...this.numbers.subarray(0, n)];
  }

  bifurcation(zero: number, free: Parameter): Event | null {
    if (!this.c.hold(4 + zero, 0, PARAMETERS.indexOf(free), 0)) return null;
    const [value = NaN, residual = NaN, , x = 0, v = 0, w = 0, force = 0, before = 0, during = 0, after = 0] = this.numbers.subarray(9);
    return { value, state: [x, v, w], force, fields: [before, during, after], residual };
  }

  column(periods: number): Column {
    const { stop, cycle, before, periodNumber, never, advance, work, ...rest } = this.attain(periods, false);
    const sum = (count: (s: Segment) => number): number => cycle.reduce((total, s) => total + count(s), 0);
    const time = sum((s) => s.duration);
    const share = (of: (field: number) => boolean): number =>
      cycle.length ? sum((s) => (of(s.field) ? s.duration : 0)) / time : never ? Number(of(never)) : NaN;
    const turns = (time * this.omega) / (2 * Math.PI);
    return {
      ...rest,
      stop,
      periodNumber,
      progression: periodNumber && cycle.length ? advance / periodNumber : cycle.length ? sum((s) => s.advance) / turns : resting(never),
      work: cycle.length ? work / turns : NaN,
      stick: share(sticks),
      contact: share(touches),
      impacts: cycle.filter((s, i) => touches(s.field) && !touches((cycle[i - 1] ?? before)?.field ?? 0)).map((s) => s.start[1]),
      fields: periodNumber ? fieldsOf(cycle, never) : [],
    };
  }

  cell(periods: number): Cell {
    const { stop, cycle, periodNumber, never, advance, states } = this.attain(periods, true);
    const last = states.slice(-Math.max(1, periodNumber)).reverse();
    const mean = (k: 0 | 1 | 2): number => last.reduce((sum, state) => sum + state[k] / last.length, 0);
    return {
      stop,
      periodNumber: never && !periodNumber ? 1 : periodNumber,
      progression: periodNumber ? advance / periodNumber : resting(never),
      fields: fieldsOf(cycle, never),
      mean: [mean(0), mean(1), mean(2)],
    };
  }

  /** The motion that a run comes to, and one cycle of its segments with the one before. */
  private attain(periods: number, early: boolean) {
    const end = stop(this.c.attain(periods, Number(early)));
    const n = (k: number): number => this.numbers[k] ?? NaN;
    const [periodNumber = 0, never = 0, advance = 0, x = 0, v = 0, w = 0, rows = 0, first = 0, count = 0, work = 0] = this.numbers;
    const states = Array.from({ length: rows }, (_, i): Triple => [n(HEAD + 3 * i), n(HEAD + 3 * i + 1), n(HEAD + 3 * i + 2)]);
    const matrix: Matrix | null = n(10) ? [...this.numbers.subarray(11, HEAD)] : null;
    const segments = count > 0 ? this.segments() : [];
    const [cycle, before] = [segments.slice(first, first + count), segments[first - 1]];
    return { stop: end, periodNumber, never, advance, work, states, matrix, cycle, before, end: [x, v, w] as Triple };
  }
}

const HEAD = 20; // as in core/sweep.c
const SEGMENT = 21; // as in core/run.c
const touches = (field: number): boolean => FIELDS[field]?.contact ?? false;
const sticks = (field: number): boolean => FIELDS[field]?.drift === 0;
/** Progression of a motion that never leaves a field. */
const resting = (never: number): number => (sticks(never) ? 0 : NaN);
const fieldsOf = (cycle: readonly Segment[], never: number): number[] =>
  !cycle.length && never ? [never] : cycle.map((s) => s.field);

const stop = (code: number): Stop => STOPS[code] ?? "refused";
