// The C library as WebAssembly: the same map, the same certificates, the same 106 bits as elsewhere.
import { contact, sticks, touches } from "./itinerary.ts";
import type { Matrix } from "./multipliers.ts";
import { MODEL, OUTCOMES, PARAMETERS, STOPS } from "./scene.ts";
import type { Parameter } from "./scene.ts";

const { SEGMENT_SIZE, motionAt, segmentAt, stateAt } = MODEL;

export type Parameters = Record<Parameter, number>;
export type Triple = readonly [number, number, number];

export type Stop = (typeof STOPS)[number];

interface Exports {
  memory: WebAssembly.Memory;
  _initialize(): void;
  numbers_at(): number;
  given_at(): number;
  state_at(): number;
  motion_at(): number;
  segments_at(): number;
  unknowns_at(): number;
  digest(): number;
  prepare(): void;
  start(x_r: number, v_r: number, v_c: number, phase: number): void;
  settle(periods: number): number;
  motion(tolerance: number): number;
  record(periods: number): number;
  recorded(): number;
  passed(): number;
  why_open(): number;
  strobes(most: number): number;
  evaluate(segment: number, times: number): void;
  energies(first: number, after: number): void;
  take(first: number): number;
  solve(held: number, at: number, free: number, keep: number): number;
  orbit_within(): void;
  attain(periods: number, early: number): number;
}

export type Segment = ReturnType<typeof segmentAt>;

export interface Steady {
  /** Excitation periods of the motion; 0 if it is not periodic. */
  periodNumber: number;
  advance: number;
  switches: number;
  /** The field at the end of the run, if it is proved never to be left. */
  never: number;
  /** True if found by Newton's method, from a run that settles slowly. */
  byNewton: boolean;
}

export interface Closed {
  /** True if Newton's method converged. */
  converged: boolean;
  matrix: Matrix;
  advance: number;
  residual: number;
  /** The segments of one period of the motion. */
  cycle: Segment[];
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
const MOST_POINTS = 18_724;
const MOST_PIECES = 4096; // of a segment
// As in core/:
const NUMBERS = 1 << 17;
const STROBES = 32;
const LONGEST_ITINERARY = 256;
const DURATION = 4; // unknowns of an orbit before the segments' durations
const MATRIX = 9;

export class Core {
  private readonly c: Exports;
  private readonly memory: DataView;
  private readonly numbers: Float64Array;
  private readonly unknowns: Float64Array;
  private readonly given: Float64Array;
  /** Segments of the orbit that was taken last. */
  private orbitSegments = 0;
  /** When a run is given up, by the clock. */
  private deadline = Infinity;

  private constructor(exports: Exports) {
    this.c = exports;
    this.memory = new DataView(exports.memory.buffer);
    this.numbers = new Float64Array(exports.memory.buffer, exports.numbers_at(), NUMBERS);
    this.unknowns = new Float64Array(exports.memory.buffer, exports.unknowns_at(), DURATION + LONGEST_ITINERARY);
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
    const byNewton = this.c.motion(tolerance) !== 0;
    const { period_number, advance, switches, never, field } = this.motion();
    return { periodNumber: period_number, advance, switches, never: never ? field : 0, byNewton };
  }

  where(): { state: Triple; position: number; periods: number } {
    const { x_r, v_r, v_c, position } = stateAt(this.memory, this.c.state_at());
    return { state: [x_r, v_r, v_c], position, periods: this.c.passed() };
  }

  private motion() {
    return motionAt(this.memory, this.c.motion_at());
  }

  segments(): Segment[] {
    const begin = this.c.segments_at();
    return Array.from({ length: this.c.recorded() }, (_, i) => segmentAt(this.memory, begin + i * SEGMENT_SIZE));
  }

  /** Points of the recorded segments no further apart than `step`, both ends among them: `POINT` numbers each. */
  points(step: number): Float64Array {
    const rows: number[] = [];
    this.segments().forEach((s, i) => {
      const begin = (s.start_period * 2 * Math.PI + s.start_angle) / this.omega;
      const pieces = 1 + Math.min(Math.ceil(s.duration / step), MOST_PIECES);
      const count = Math.min(pieces + 1, MOST_POINTS - rows.length / POINT);
      for (let k = 0; k < count; k++) this.numbers[k] = begin + (s.duration * k) / pieces;
      this.c.evaluate(i, count);
      const n = (k: number): number => this.numbers[k] ?? NaN;
      for (let k = 0; k < count; k++) {
        const at = count + 4 * k;
        rows.push(i, n(k), n(at), n(at + 1), n(at + 2), n(at + 3), n(5 * count + k));
      }
    });
    return Float64Array.from(rows);
  }

  /** Start of the first whole cycle of the motion among the recorded segments; -1 if none does. */
  private cycleStart(segments: readonly Segment[]): number {
    const first = segments.findIndex((_, i) => (segments[i - 1]?.target ?? 0) > 0);
    return first + this.motion().switches <= segments.length ? first : -1;
  }

  /** Takes the orbit from one period of the motion, with its monodromy matrix as it was run; whether it can. */
  private take(first: number): boolean {
    this.orbitSegments = this.c.take(first);
    return this.orbitSegments > 0;
  }

  private get matrix(): Matrix {
    return [...this.numbers.subarray(0, MATRIX)];
  }

  /** The orbit of the recorded motion. */
  closed(): Closed | null {
    const segments = this.segments();
    const first = this.cycleStart(segments);
    if (first < 0 || !this.take(first)) return null;
    const cycle = segments.slice(first, first + this.motion().switches);
    this.c.energies(first, first + cycle.length);
    const [work = NaN, damperLoss = NaN, frictionLoss = NaN] = this.numbers;
    const converged = this.c.solve(-1, 0, 0, 1) !== 0;
    const [advance = NaN, residual = NaN] = this.numbers.subarray(MATRIX);
    return { converged, matrix: this.matrix, advance, residual, cycle, work, damperLoss, frictionLoss };
  }

  /** The monodromy matrix of the orbit that `closed` left, followed to the prepared parameters. */
  follow(): Matrix | null {
    return this.c.solve(-1, 0, 0, 1) ? this.matrix : null;
  }

  /** The orbit along its branch at which part `pin` of its start is `at`: the parameter's value and the monodromy. */
  along(pin: number, at: number, free: Parameter): { value: number; matrix: Matrix } | null {
    if (!this.c.solve(pin, at, PARAMETERS.indexOf(free), 1)) return null;
    return { value: this.numbers[MATRIX + 2] ?? NaN, matrix: this.matrix };
  }

  /** Start of the orbit: x_r, v_r, v_c and the forcing angle. */
  orbitStart(): number[] {
    return [...this.unknowns.subarray(0, DURATION)];
  }

  /** State and forcing angle within the orbit's first segment, off every switch. */
  orbitWithin(): number[] {
    this.c.orbit_within();
    return [...this.numbers.subarray(0, DURATION)];
  }

  durations(): number[] {
    return [...this.unknowns.subarray(DURATION, DURATION + this.orbitSegments)];
  }

  bifurcation(zero: number, free: Parameter): Event | null {
    if (!this.c.solve(DURATION + zero, 0, PARAMETERS.indexOf(free), 0)) return null;
    const [, residual = NaN, value = NaN, x = 0, v = 0, w = 0, force = 0, before = 0, during = 0, after = 0] = this.numbers.subarray(MATRIX);
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
      impacts: cycle.filter((s, i) => touches(s.field) && contact((cycle[i - 1] ?? before)?.field ?? 0) !== contact(s.field)).map((s) => s.start[1]),
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
    const open: Attained = { stop: "done", periodNumber: 0, never: 0, advance: 0, work: 0, states: [], matrix: null, cycle: [], before: undefined, end: [0, 0, 0] };
    const ended = stop(this.c.attain(periods, Number(early)));
    if (ended !== "done") return { ...open, stop: ended };
    const { period_number: m, switches, advance, never, field } = this.motion();
    const end = this.where().state;
    const n = this.c.strobes(m && m < STROBES ? m : STROBES);
    const at = (k: number): number => this.numbers[k] ?? NaN;
    const states = Array.from({ length: n }, (_, i): Triple => [at(3 * i), at(3 * i + 1), at(3 * i + 2)]);
    const motion = { ...open, periodNumber: m, never: never ? field : 0, advance, states, end };
    if (early && !switches) return motion;
    const recorded = this.record(m ? 2 * m + 1 : STROBES);
    if (recorded !== "done" && recorded !== "full") return { ...open, stop: recorded };
    const segments = this.segments();
    const first = m ? this.cycleStart(segments) : 1;
    if (first < 0 && switches) return { ...open, stop: "full" as const }; // longer than the record: not distinguished
    const cycle = first < 0 ? [] : segments.slice(first, m ? first + switches : segments.length);
    if (early || !cycle.length) return { ...motion, cycle };
    this.c.energies(first, first + cycle.length);
    const work = this.numbers[0] ?? NaN;
    return { ...motion, cycle, before: segments[first - 1], work, matrix: m && this.take(first) ? this.matrix : null };
  }
}

interface Attained extends Pick<Column, "stop" | "periodNumber" | "states" | "matrix" | "end"> {
  /** The field that is never left; 0 if there is none. */
  never: number;
  advance: number;
  work: number;
  cycle: Segment[];
  before: Segment | undefined;
}

/** Progression of a motion that never leaves a field. */
const resting = (never: number): number => (sticks(never) ? 0 : NaN);
const fieldsOf = (cycle: readonly Segment[], never: number): number[] =>
  !cycle.length && never ? [never] : cycle.map((s) => s.field);

const stop = (code: number): Stop => STOPS[code] ?? "refused";
