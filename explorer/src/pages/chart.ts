// The view of a chart of parameters, or of a basin of starts.
import type { App } from "../app.ts";
import { Chart } from "../chart.ts";
import { byId, make, pretty } from "../dom.ts";
import { valuesAt } from "../draw/axes.ts";
import type { Frame } from "../draw/axes.ts";
import { Panel } from "../draw/panel.ts";
import { AXES, DEFAULTS, NUMBERS, RANGES } from "../fields.ts";
import type { Axis } from "../fields.ts";
import { spelled } from "../itinerary.ts";
import { choiceControl, numberControl } from "../ui/controls.ts";
import { showKnown } from "../ui/presets.ts";
import { LEFT_OPEN, drawChart, itineraryColour, periodColour, progressionRange, striped } from "../views/chart.ts";
import { REACH } from "../scene.ts";
import { PARTS } from "../ui/sidebar.ts";
import { ofStarts, parameters, startOf } from "../state.ts";
import type { State } from "../state.ts";

const OWN = ["c_x", "c_y", "c_x0", "c_x1", "c_y0", "c_y1", "c_size", "c_periods", "c_by"] as const;
const ENDS: Record<Axis, readonly [number, number]> = {
  ...RANGES,
  x_r: [-REACH, REACH], v_r: [-REACH, REACH], v_c: [-REACH / 2, REACH / 2], phase: [0, Math.floor((200 * Math.PI) / DEFAULTS.omega) / 100],
};
const LISTED = 40; // regions in the list

export class ChartPage {
  readonly chart: Chart;
  readonly panel: Panel;
  private area: Frame | null = null;
  private cursor: readonly [number, number] | null = null; // a cell
  private asked = 0;
  private waiting = 0;
  private drawn = 0;

  constructor(private readonly app: App) {
    this.chart = new Chart(app.pool, () => this.redraw());
    this.panel = new Panel(byId("chart"), (...rest) => {
      this.area = drawChart(this.chart, app.state.c_by, this.cursor && this.chart.place(...this.cursor), ...rest);
    }, () => app.theme);
    this.bar();
    this.picking();
    app.listen((state, before) => {
      if (state.view !== "chart") {
        if (before.view === "chart") this.chart.cancel();
        return;
      }
      const same = before.view === "chart" && before !== state && [...OWN, ...PARTS].every((name) => state[name] === before[name]);
      if (same || (before === state && this.chart.size)) this.redraw();
      else this.schedule();
    });
    if (app.state.view === "chart") this.schedule();
  }

  private schedule(): void {
    clearTimeout(this.waiting);
    this.waiting = window.setTimeout(() => {
      this.cursor = null;
      this.chart.run(this.app.state);
      showKnown(byId("known"), this.app.state);
    }, 30);
  }

  private bar(): void {
    const { app } = this;
    const axes = AXES.map((name) => [name, `${NUMBERS[name].symbol}  ${NUMBERS[name].name}`] as const);
    // Over parameters motions that coexist cannot be told apart.
    const coloured = (change: Partial<State>): Partial<State> =>
      app.state.c_by === "attractor" && !ofStarts({ ...app.state, ...change }) ? { ...change, c_by: "itinerary" } : change;
    const x = choiceControl("c-x", "first axis", axes, (value) => app.change(coloured({ c_x: value, c_x0: ENDS[value as Axis][0], c_x1: ENDS[value as Axis][1] })));
    const y = choiceControl("c-y", "second axis", axes, (value) => app.change(coloured({ c_y: value, c_y0: ENDS[value as Axis][0], c_y1: ENDS[value as Axis][1] })));
    const by = choiceControl("c-by", "colour by", [["itinerary", "itinerary"], ["attractor", "attractor"], ["progression", "progression"], ["period", "period number"]], (value) => app.change({ c_by: value }));
    const numbers = (["c_x0", "c_x1", "c_y0", "c_y1", "c_size", "c_periods"] as const).map((name) => numberControl(name, (change) => app.change(change)));
    const [x0, x1, y0, y1, ...rest] = numbers.map((one) => one.element);
    const stop = make("button", { type: "button", id: "chart-stop", click: () => this.chart.cancel() }, "Stop");
    byId("chart-bar").append(x.element, ...[x0, x1].filter((one) => one !== undefined), y.element, ...[y0, y1, ...rest].filter((one) => one !== undefined), by.element, stop);
    const show = (state: State): void => {
      x.show(state.c_x);
      y.show(state.c_y);
      by.show(state.c_by);
      const attractor = by.select.querySelector<HTMLOptionElement>('option[value="attractor"]');
      if (attractor) [attractor.disabled, attractor.textContent] = ofStarts(state) ? [false, "attractor"] : [true, "attractor (over two starts)"];
      for (const one of numbers) one.show(state);
    };
    app.listen(show);
    show(app.state);
  }

  /** Now and then while cells come in, and when they have. */
  private redraw(): void {
    if (this.asked) return;
    const wait = this.chart.running ? Math.max(0, 150 - (performance.now() - this.drawn)) : 0;
    this.asked = window.setTimeout(() => {
      this.asked = 0;
      this.drawn = performance.now();
      this.panel.draw();
      this.status();
    }, wait);
  }

  private status(): void {
    const { chart, app } = this;
    byId<HTMLButtonElement>("chart-stop").disabled = !chart.running;
    const n = chart.size * chart.size;
    const share = n ? Math.round((100 * chart.computed) / n) : 0;
    byId("chart-status").textContent = chart.running
      ? `${chart.step ? `Drawn in squares of ${chart.step} × ${chart.step} cells` : "One cell in 16 × 16 is run first"}; ${chart.computed} of ${n} cells run`
      : chart.took ? `First picture in ${(chart.coarse / 1000).toFixed(2)} s, finished in ${(chart.took / 1000).toFixed(1)} s on ${app.pool.size} workers: ${share} % of the cells were run, all those beside another colour among them; the others lie between equal ones, and so do their progressions.` : "Stopped.";
    byId("regions").replaceChildren(...this.legend(n));
  }

  /** Key of the colours, with the share of the cells. */
  private legend(n: number): HTMLElement[] {
    const { chart, app } = this;
    const { c_by } = app.state;
    const counts = new Map<number, number>();
    for (const region of chart.of) counts.set(region, (counts.get(region) ?? 0) + 1);
    const shareOf = (count: number): string => (count * 1000 < n ? "< 0.1 %" : `${((100 * count) / n).toFixed(1)} %`);
    const item = (colour: string, text: string, stripes = false): HTMLElement => {
      const swatch = make("span", { class: stripes ? "swatch striped" : "swatch" });
      swatch.style.backgroundColor = colour;
      return make("li", {}, swatch, text);
    };
    const others = [
      ...(counts.has(-2) ? [item(app.theme.open, `not periodic after these periods, ${shareOf(counts.get(-2) ?? 0)}`)] : []),
      ...(counts.has(LEFT_OPEN) ? [item(app.theme.mark, `left open, ${shareOf(counts.get(LEFT_OPEN) ?? 0)}`)] : []),
    ];
    const found = [...counts].filter(([region]) => region >= 0);
    if (c_by === "progression") {
      const [low, high] = progressionRange(chart);
      return [make("li", {}, `Progression per excitation period${chart.plainly}, from ${pretty(low, 5)} to ${pretty(high, 5)}: the bar beside the chart has the values.`), ...others];
    }
    if (c_by === "period") {
      const periods = new Map<number, number>();
      for (const [region, count] of found) {
        const periodNumber = chart.regions[region]?.periodNumber ?? 1;
        periods.set(periodNumber, (periods.get(periodNumber) ?? 0) + count);
      }
      return [...[...periods].sort((a, b) => a[0] - b[0]).map(([periodNumber, count]) => item(periodColour(periodNumber), `period ${periodNumber}, ${shareOf(count)}`)), ...others];
    }
    const listed = found.sort((a, b) => b[1] - a[1]);
    const items = listed.slice(0, LISTED).map(([region, count]) => {
      const one = chart.regions[region];
      const text = `${spelled(one?.itinerary ?? "")}${one && one.periodNumber > 1 ? ` (period ${one.periodNumber})` : ""}${one?.alone ? `, progression ${pretty(one.cell.progression, 5)}${chart.plainly}` : ""}`;
      const rank = chart.rank(region);
      return item(itineraryColour(rank, app.theme), `${text}, ${shareOf(count)}`, striped(rank, app.theme));
    });
    const more = listed.length - items.length;
    return [
      ...items,
      ...others,
      ...(more > 0 ? [make("li", {}, `and ${more} more, all smaller`)] : []),
      ...(listed.length > 2 * app.theme.itineraries.length ? [make("li", {}, `There are ${2 * app.theme.itineraries.length} colours, plain and striped: some stand for several of these. Choose a point to see which.`)] : []),
    ];
  }

  private open([i, j]: readonly [number, number]): void {
    const { chart, app } = this;
    const [x, y] = chart.place(i, j);
    const next = { ...app.state, ...parameters(app.state), ...startOf(app.state), [chart.x]: x, [chart.y]: y };
    const phase = next.phase % ((2 * Math.PI) / next.omega);
    app.change({ ...next, view: "motion", units: "dimensionless", phase, periods: Math.max(app.state.periods, app.state.c_periods) });
    byId("main").focus();
  }

  private picking(): void {
    const box = byId("chart");
    box.addEventListener("click", (event) => {
      if (!this.area || !this.chart.size) return;
      const { left, top } = box.getBoundingClientRect();
      this.open(this.chart.cell(valuesAt(this.area, event.clientX - left, event.clientY - top, this.chart.xs, this.chart.ys)));
    });
    box.addEventListener("keydown", (event) => {
      const step = ({ ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] } as const)[event.key as "ArrowLeft"];
      const { size } = this.chart;
      if (event.key === "Enter" && this.cursor) this.open(this.cursor);
      if (!step || !size) return;
      event.preventDefault();
      const [i, j] = this.cursor ?? [size >> 1, size >> 1];
      const by = event.shiftKey ? 1 : Math.max(1, Math.round(size / 64));
      const move = (k: number, way: number): number => Math.max(0, Math.min(size - 1, k + way * by));
      this.cursor = [move(i, step[0]), move(j, step[1])];
      const number = this.chart.of[this.chart.at(...this.cursor)] ?? -1;
      const region = this.chart.regions[number];
      const at = this.chart.place(...this.cursor).map((value) => pretty(value, 4)).join(", ");
      const what = region ? spelled(region.itinerary) : number === LEFT_OPEN ? "left open" : number === -1 ? "not run yet" : "not periodic";
      byId("chart-status").textContent = `${NUMBERS[this.chart.x].symbol}, ${NUMBERS[this.chart.y].symbol} = ${at}: ${what}. Enter shows the motion.`;
      this.panel.draw();
    });
  }
}

