// The view of a bifurcation diagram.
import type { App } from "../app.ts";
import { Diagram } from "../diagram.ts";
import { byId, make, pretty } from "../dom.ts";
import { UNIT } from "../draw/axes.ts";
import { Panel } from "../draw/panel.ts";
import { NUMBERS, PARAMETERS, QUANTITIES } from "../fields.ts";
import type { Parameter, Quantity } from "../fields.ts";
import { spelled } from "../itinerary.ts";
import { choiceControl, numberControl } from "../ui/controls.ts";
import { AREA, drawDiagram } from "../views/diagram.ts";
import { PARTS } from "../ui/sidebar.ts";
import { parameters } from "../state.ts";
import type { State } from "../state.ts";

const OWN = ["d_x", "d_from", "d_to", "d_count", "d_periods", "d_starts", "d_way"] as const;
const RANGES: Record<Parameter, readonly [number, number]> = {
  alpha: [0.005, 2], omega: [0.3, 1.6], delta: [0, 0.5], zeta: [0.01, 0.5], beta: [0, 10], gamma: [1, 6], f_b: [0.5, 1.5],
};

export class DiagramPage {
  readonly diagram: Diagram;
  readonly panel: Panel;
  private cursor: number | null = null;
  private asked = 0;
  private waiting = 0;

  constructor(private readonly app: App) {
    this.diagram = new Diagram(app.pool, () => this.redraw());
    const quantity = (): Quantity => app.state.d_y as Quantity;
    this.panel = new Panel(byId("diagram"), (...rest) => drawDiagram(this.diagram, quantity(), this.cursor, ...rest), () => app.theme);
    this.bar();
    this.picking();
    app.listen((state, before) => {
      if (state.view !== "diagram") {
        if (before.view === "diagram") this.diagram.cancel();
        return;
      }
      const same = before.view === "diagram" && before !== state && [...OWN, ...PARTS].every((name) => state[name] === before[name]);
      if (same || (before === state && this.diagram.passes.length)) this.redraw();
      else this.schedule();
    });
    if (app.state.view === "diagram") this.schedule();
  }

  private schedule(): void {
    clearTimeout(this.waiting);
    this.waiting = window.setTimeout(() => {
      this.cursor = null;
      this.diagram.run(this.app.state);
    }, 30);
  }

  private bar(): void {
    const { app } = this;
    const x = choiceControl("d-x", "parameter", PARAMETERS.map((name) => [name, `${NUMBERS[name].symbol}  ${NUMBERS[name].name}`]), (value) => {
      const [d_from, d_to] = RANGES[value as Parameter];
      // Of a device the numbers without units vary.
      return app.change({ d_x: value, d_from, d_to });
    });
    const y = choiceControl("d-y", "quantity", Object.entries(QUANTITIES), (value) => app.change({ d_y: value }));
    const way = choiceControl("d-way", "directions", [["both", "up and down"], ["up", "up"], ["down", "down"]], (value) => app.change({ d_way: value }));
    const numbers = (["d_from", "d_to", "d_count", "d_periods", "d_starts"] as const).map((name) => numberControl(name, (change) => app.change(change)));
    const stop = make("button", { type: "button", id: "diagram-stop", click: () => this.diagram.cancel() }, "Stop");
    byId("diagram-bar").append(x.element, y.element, ...numbers.map((one) => one.element), way.element, stop);
    const show = (state: State): void => {
      [x.select.value, y.select.value, way.select.value] = [state.d_x, state.d_y, state.d_way];
      for (const one of numbers) one.show(state);
    };
    app.listen(show);
    show(app.state);
  }

  private redraw(): void {
    if (this.asked) return;
    this.asked = requestAnimationFrame(() => {
      this.asked = 0;
      this.panel.draw();
      this.status();
    });
  }

  private status(): void {
    const { diagram } = this;
    byId<HTMLButtonElement>("diagram-stop").disabled = !diagram.running;
    const exact = diagram.marks.filter((mark) => mark.exact).length;
    const open = diagram.passes.reduce((sum, pass) => sum + pass.columns.filter((column) => column && column.stop !== "done").length, 0);
    const counted = `${diagram.marks.length} bifurcations, ${exact} of them solved to rounding${open ? `; ${open} values left open` : ""}`;
    byId("diagram-status").textContent = diagram.running
      ? diagram.progress < 1 ? `${Math.round(100 * diagram.progress)} %` : `Looking for bifurcations, ${diagram.looking} places left`
      : diagram.took ? `${counted}. Points in ${(diagram.took / 1000).toFixed(2)} s on ${this.app.pool.size} workers.` : "Stopped.";
    byId("marks").replaceChildren(
      ...diagram.marks.slice(0, 200).map((mark, i) =>
        make("tr", {},
          make("th", { scope: "row" }, String(i + 1)),
          make("td", {}, mark.exact ? `${NUMBERS[diagram.x].symbol} = ${mark.value.toFixed(12)}` : `${NUMBERS[diagram.x].symbol} = ${pretty(mark.value, 8)} ± ${mark.doubt.toExponential(0)}`),
          make("td", {}, mark.name),
          make("td", {}, `${spelled(mark.before) || "not periodic"} → ${spelled(mark.after) || "not periodic"}`),
          make("td", {}, make("button", { type: "button", click: () => this.open(mark.value) , "aria-label": `Show the motion at bifurcation ${i + 1}` }, "Show")),
        ),
      ),
    );
  }

  private open(value: number): void {
    // The parameters of a device become those of its dimensionless model.
    const { state } = this.app;
    const whole = state.units === "device" ? parameters(state) : {};
    this.app.change({ view: "motion", units: "dimensionless", ...whole, [this.diagram.x]: value });
    byId("main").focus();
  }

  private picking(): void {
    const box = byId("diagram");
    const value = (event: PointerEvent): number => {
      const { left, width } = box.getBoundingClientRect();
      const [a, b] = [AREA.left * UNIT, width - AREA.right * UNIT];
      const share = Math.max(0, Math.min(1, (event.clientX - left - a) / (b - a)));
      const [low, high] = this.diagram.range;
      return low + share * (high - low);
    };
    let from: number | null = null;
    box.addEventListener("pointerdown", (event) => (from = event.clientX));
    box.addEventListener("pointermove", (event) => {
      this.cursor = value(event);
      this.redraw();
    });
    box.addEventListener("pointerup", (event) => {
      if (from !== null && Math.abs(event.clientX - from) < 6) this.open(Number(value(event).toPrecision(6)));
      from = null;
    });
    box.addEventListener("pointerleave", () => {
      this.cursor = null;
      this.redraw();
    });
    box.addEventListener("keydown", (event) => {
      const [low, high] = this.diagram.range;
      const step = { ArrowLeft: -1, ArrowRight: 1, PageDown: -10, PageUp: 10 }[event.key];
      if (event.key === "Enter" && this.cursor !== null) this.open(Number(this.cursor.toPrecision(6)));
      if (step === undefined) return;
      event.preventDefault();
      this.cursor = Math.max(low, Math.min(high, (this.cursor ?? (low + high) / 2) + (step * (high - low)) / 200));
      byId("diagram-status").textContent = `${NUMBERS[this.diagram.x].symbol} = ${pretty(this.cursor, 5)}: Enter shows the motion.`;
      this.panel.draw();
    });
  }
}
