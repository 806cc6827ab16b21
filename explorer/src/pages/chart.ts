// The view of a chart of parameters, or of a basin of starts.
import type { App } from "../app.ts";
import { Chart } from "../chart.ts";
import { byId, make, pretty } from "../dom.ts";
import { UNIT } from "../draw/axes.ts";
import { Panel } from "../draw/panel.ts";
import { AXES, NUMBERS } from "../fields.ts";
import type { Axis } from "../fields.ts";
import { spelled } from "../itinerary.ts";
import { choiceControl, numberControl } from "../ui/controls.ts";
import { drawChart, wordColour } from "../views/chart.ts";
import { PARTS } from "../ui/sidebar.ts";
import { parameters } from "../state.ts";
import type { State } from "../state.ts";

const OWN = ["c_x", "c_y", "c_x0", "c_x1", "c_y0", "c_y1", "c_size", "c_periods", "c_by"] as const;
const RANGES: Record<Axis, readonly [number, number]> = {
  alpha: [0.01, 2], omega: [0.3, 1.6], delta: [0, 0.5], zeta: [0.01, 0.5], beta: [0, 10], gamma: [1, 5], f_b: [0.5, 1.5],
  x_r: [-2, 2], v_r: [-2, 2], v_c: [-1, 1],
};

export class ChartPage {
  readonly chart: Chart;
  readonly panel: Panel;
  private cursor: readonly [number, number] | null = null;
  private asked = 0;
  private waiting = 0;
  private drawn = 0;

  constructor(private readonly app: App) {
    this.chart = new Chart(app.pool, () => this.redraw());
    this.panel = new Panel(byId("chart"), (...rest) => drawChart(this.chart, app.state.c_by, this.cursor, ...rest), () => app.theme);
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
    }, 30);
  }

  private bar(): void {
    const { app } = this;
    const axes = AXES.map((name) => [name, `${NUMBERS[name].symbol}  ${NUMBERS[name].name}`] as const);
    const x = choiceControl("c-x", "first axis", axes, (value) => app.change({ c_x: value, c_x0: RANGES[value as Axis][0], c_x1: RANGES[value as Axis][1] }));
    const y = choiceControl("c-y", "second axis", axes, (value) => app.change({ c_y: value, c_y0: RANGES[value as Axis][0], c_y1: RANGES[value as Axis][1] }));
    const by = choiceControl("c-by", "colour by", [["itinerary", "itinerary"], ["attractor", "attractor"], ["progression", "progression"], ["period", "period number"]], (value) => app.change({ c_by: value }));
    const numbers = (["c_x0", "c_x1", "c_y0", "c_y1", "c_size", "c_periods"] as const).map((name) => numberControl(name, (change) => app.change(change)));
    const [x0, x1, y0, y1, ...rest] = numbers.map((one) => one.element);
    const stop = make("button", { type: "button", id: "chart-stop", click: () => this.chart.cancel() }, "Stop");
    byId("chart-bar").append(x.element, ...[x0, x1].filter((one) => one !== undefined), y.element, ...[y0, y1, ...rest].filter((one) => one !== undefined), by.element, stop);
    const show = (state: State): void => {
      [x.select.value, y.select.value, by.select.value] = [state.c_x, state.c_y, state.c_by];
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
      : chart.took ? `First picture in ${(chart.coarse / 1000).toFixed(2)} s, finished in ${(chart.took / 1000).toFixed(1)} s on ${app.pool.size} workers: ${share} % of the cells were run, the others lie between equal ones, and so do their progressions.` : "Stopped.";
    const counts = new Map<number, number>();
    for (const region of chart.of) counts.set(region, (counts.get(region) ?? 0) + 1);
    const listed = [...counts].sort((a, b) => b[1] - a[1]).filter(([region]) => region !== -1).slice(0, 40);
    byId("regions").replaceChildren(
      ...listed.map(([region, count]) => {
        const one = chart.regions[region];
        const swatch = make("span", { class: "swatch" });
        swatch.style.background = region === -3 ? app.theme.mark : one ? wordColour(region, app.theme) : app.theme.open;
        const text = one ? `${spelled(one.word)}${one.multiple > 1 ? ` (period ${one.multiple})` : ""}${one.key.includes("@") ? `, progression ${pretty(one.cell.progression, 5)}` : ""}`
          : region === -3 ? "left open" : "not periodic after these periods";
        return make("li", {}, swatch, `${text}, ${((100 * count) / n).toFixed(1)} %`);
      }),
    );
  }

  private open([x, y]: readonly [number, number]): void {
    const { chart, app } = this;
    const whole = app.state.units === "device" ? parameters(app.state) : {};
    app.change({ view: "motion", units: "dimensionless", ...whole, [chart.x]: x, [chart.y]: y, periods: Math.max(app.state.periods, app.state.c_periods) });
    byId("main").focus();
  }

  private picking(): void {
    const box = byId("chart");
    const margins = [58, 14, 12, 42] as const;
    const place = (event: PointerEvent): readonly [number, number] => {
      const { left, top, width, height } = box.getBoundingClientRect();
      const [l, r, t, b] = margins.map((margin) => margin * UNIT) as [number, number, number, number];
      const share = (value: number, length: number): number => Math.max(0, Math.min(1, value / length));
      const [sx, sy] = [share(event.clientX - left - l, width - l - r), 1 - share(event.clientY - top - t, height - t - b)];
      return [this.chart.xs[0] + sx * (this.chart.xs[1] - this.chart.xs[0]), this.chart.ys[0] + sy * (this.chart.ys[1] - this.chart.ys[0])];
    };
    box.addEventListener("click", (event) => this.open(place(event as PointerEvent).map((value) => Number(value.toPrecision(6))) as [number, number]));
    box.addEventListener("keydown", (event) => {
      const step = ({ ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] } as const)[event.key as "ArrowLeft"];
      if (event.key === "Enter" && this.cursor) this.open(this.cursor);
      if (!step) return;
      event.preventDefault();
      const { xs, ys, size, of } = this.chart;
      const [cx, cy] = this.cursor ?? [(xs[0] + xs[1]) / 2, (ys[0] + ys[1]) / 2];
      const move = (value: number, by: number, [low, high]: readonly [number, number]): number => Math.max(low, Math.min(high, value + (by * (high - low)) / 64));
      this.cursor = [move(cx, step[0], xs), move(cy, step[1], ys)];
      const index = (value: number, [low, high]: readonly [number, number]): number => Math.min(size - 1, Math.floor(((value - low) / (high - low)) * size));
      const region = size ? this.chart.regions[of[this.chart.at(index(this.cursor[0], xs), index(this.cursor[1], ys))] ?? -1] : undefined;
      const at = this.cursor.map((value) => pretty(value, 4)).join(", ");
      byId("chart-status").textContent = `${NUMBERS[this.chart.x].symbol}, ${NUMBERS[this.chart.y].symbol} = ${at}: ${region ? spelled(region.word) : "not periodic"}. Enter shows the motion.`;
      this.panel.draw();
    });
  }
}
