// A bifurcation diagram: columns from the workers, up and down and from further starts, and exact events.
import type { Column, Triple } from "./core.ts";
import type { Parameter, Quantity } from "./fields.ts";
import type { Mark } from "./jobs.ts";
import { digits } from "./itinerary.ts";
import { modulus, multipliers } from "./multipliers.ts";
import type { Giver } from "./chart.ts";
import { REACH } from "./scene.ts";
import { parameters, startOf } from "./state.ts";
import type { State } from "./state.ts";

export interface Pass {
  way: "up" | "down" | "start";
  values: number[];
  columns: (Column | undefined)[];
}

/** A column: which pass, and its index there. */
export interface Place {
  pass: number;
  index: number;
}

/** Further starts, the same every time: the golden ratio's powers spread them. */
const further = (k: number): Triple => {
  const share = (factor: number): number => ((k + 1) * factor) % 1;
  return [REACH * (1.5 * share(0.819172513) - 0.75), 3 * share(0.671043607) - 1.5, k % 2 ? 2 * share(0.549700478) - 1 : 0];
};

export class Diagram {
  passes: Pass[] = [];
  marks: Mark[] = [];
  x: Parameter = "alpha";
  range: readonly [number, number] = [0, 1];
  omega = 1;
  /** Text beside its axes, which have no units even for a device. */
  plainly = "";
  started = 0;
  /** Milliseconds from the start to the last column; 0 while it is under way. */
  took = 0;
  looking = 0; // brackets in which an event is still looked for
  private jobs = new Set<number>();
  private left = 0;

  constructor(
    private readonly pool: Giver,
    private readonly changed: () => void,
  ) {}

  get running(): boolean {
    return this.left + this.looking > 0;
  }

  get progress(): number {
    const all = this.passes.reduce((sum, pass) => sum + pass.values.length, 0);
    const done = this.passes.reduce((sum, pass) => sum + pass.columns.filter(Boolean).length, 0);
    return all ? done / all : 1;
  }

  cancel(): void {
    for (const job of this.jobs) this.pool.cancel(job);
    this.jobs.clear();
    this.left = this.looking = 0;
    this.changed();
  }

  run(state: State): void {
    this.cancel();
    const [low, high, n] = [state.d_from, state.d_to, state.d_count];
    const base = parameters(state);
    const { x_r, v_r, v_c, phase } = startOf(state);
    this.plainly = state.units === "device" ? ", dimensionless" : "";
    this.x = state.d_x as Parameter;
    this.range = [low, high];
    this.omega = base.omega;
    this.marks = [];
    this.started = performance.now();
    this.took = 0;
    const up = Array.from({ length: n }, (_, i) => (i === n - 1 ? high : low + ((high - low) * i) / (n - 1)));
    const ways: Pass["way"][] = state.d_way === "both" ? ["up", "down"] : [state.d_way as "up" | "down"];
    const starts = Array.from({ length: state.d_starts }, () => "start" as const);
    this.passes = [...ways, ...starts].map((way) => ({
      way,
      values: way === "down" ? [...up].reverse() : up,
      columns: new Array<Column | undefined>(n),
    }));
    this.passes.forEach((pass, k) => {
      const onward = pass.way !== "start";
      const start = onward
        ? { state: [x_r, v_r, v_c] as const, phase }
        : { state: further(k - ways.length), phase: 0 };
      this.left++;
      this.ask({ kind: "sweep", base, x: this.x, values: pass.values, periods: state.d_periods, start, onward }, (answer) => {
        if ("part" in answer) {
          answer.part.columns.forEach((column, i) => (pass.columns[answer.part.from + i] = column));
        } else if ("done" in answer) {
          this.left--;
          if (!this.left) this.took = performance.now() - this.started;
          if (onward) this.look(pass, base, state.d_periods);
        }
        this.changed();
      });
    });
  }

  private ask(job: Parameters<Giver["give"]>[0], listener: Parameters<Giver["give"]>[1]): void {
    const number = this.pool.give(job, (answer) => {
      if ("done" in answer) this.jobs.delete(number);
      listener(answer);
    });
    this.jobs.add(number);
  }

  /** Looks for the events between neighbouring columns whose itineraries differ. */
  private look(pass: Pass, base: ReturnType<typeof parameters>, periods: number): void {
    const itineraries = pass.columns.map(itineraryOf);
    for (let i = 1; i < itineraries.length; i++) {
      const [a, b] = [pass.values[i - 1] ?? 0, pass.values[i] ?? 0];
      const before = pass.columns[i - 1];
      if (itineraries[i] === itineraries[i - 1] || !before || (!itineraries[i] && !itineraries[i - 1])) continue;
      this.looking++;
      this.ask({ kind: "mark", base, x: this.x, from: a, to: b, start: before.end, periods }, (answer) => {
        if ("marks" in answer) this.take(answer.marks);
        if ("done" in answer) this.looking--;
        this.changed();
      });
    }
  }

  private take(marks: readonly Mark[]): void {
    for (const mark of marks) {
      const near = 1e-9 * (this.range[1] - this.range[0]) + mark.doubt;
      const same = this.marks.findIndex((one) => Math.abs(one.value - mark.value) <= near + one.doubt && one.name === mark.name);
      const known = this.marks[same];
      if (!known) this.marks.push(mark);
      else {
        // Found from both sides: each gave one of two motions.
        const better = mark.doubt < known.doubt ? mark : known;
        this.marks[same] = { ...better, before: known.before || mark.before, after: known.after || mark.after };
      }
    }
    this.marks.sort((a, b) => a.value - b.value);
  }

  /** The column that has the point nearest to a place, by a measure of its own; null where nothing is drawn. */
  nearest(quantity: Quantity, distance: (x: number, y: number) => number): Place | null {
    let best: Place | null = null;
    let least = Infinity;
    this.passes.forEach(({ values, columns }, pass) =>
      columns.forEach((column, index) => {
        const x = values[index] ?? NaN;
        for (const y of column ? this.values(column, x, quantity) : []) {
          const away = distance(x, y);
          if (!(away < least)) continue;
          least = away;
          best = { pass, index };
        }
      }),
    );
    return best;
  }

  column({ pass, index }: Place): { value: number; column: Column | undefined } {
    const { values, columns } = this.passes[pass] ?? { values: [], columns: [] };
    return { value: values[index] ?? NaN, column: columns[index] };
  }

  /** Values of a column drawn for a quantity. */
  values(column: Column, x: number, quantity: Quantity): number[] {
    if (column.stop !== "done") return [];
    switch (quantity) {
      case "x_r":
      case "v_r":
      case "v_c": {
        const k = (["x_r", "v_r", "v_c"] as const).indexOf(quantity);
        return column.states.map((state) => state[k] ?? NaN);
      }
      case "impact":
        return column.impacts;
      case "velocity":
        return [(column.progression * (this.x === "omega" ? x : this.omega)) / (2 * Math.PI)];
      case "period":
        return column.periodNumber ? [column.periodNumber] : [];
      case "multiplier":
        return column.matrix ? multipliers(column.matrix).slice(0, 1).map(modulus) : [];
      default:
        return [column[quantity]];
    }
  }
}

export const itineraryOf = (column: Column | undefined): string =>
  column && column.stop === "done" && column.periodNumber ? digits(column.fields) : "";
