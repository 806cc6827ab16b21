// The view of a bifurcation diagram.
import type { App } from "../app.ts";
import type { Triple } from "../core.ts";
import { Diagram, itineraryOf } from "../diagram.ts";
import type { Place } from "../diagram.ts";
import { byId, make, pretty } from "../dom.ts";
import type { Frame } from "../draw/axes.ts";
import { Panel } from "../draw/panel.ts";
import { NUMBERS, PARAMETERS, QUANTITIES, RANGES } from "../fields.ts";
import type { Parameter, Quantity } from "../fields.ts";
import type { Mark } from "../jobs.ts";
import { spelled } from "../itinerary.ts";
import { choiceControl, numberControl } from "../ui/controls.ts";
import { printedBifurcation } from "../ui/presets.ts";
import { eventTerm } from "../ui/terms.ts";
import { drawDiagram } from "../views/diagram.ts";
import { PARTS } from "../ui/sidebar.ts";
import { parameters, startOf } from "../state.ts";
import type { State } from "../state.ts";

const OWN = ["d_x", "d_from", "d_to", "d_count", "d_periods", "d_starts", "d_way"] as const;
const LISTED = 200; // bifurcations in the table
const WAYS = { up: "up", down: "down", start: "from a further start" } as const;

export class DiagramPage {
  readonly diagram: Diagram;
  readonly panel: Panel;
  private area: Frame | null = null;
  private cursor: Place | null = null;
  private asked = 0;
  private waiting = 0;
  private listed = "";

  constructor(private readonly app: App) {
    this.diagram = new Diagram(app.pool, () => this.redraw());
    this.panel = new Panel(byId("diagram"), (...rest) => {
      this.area = drawDiagram(this.diagram, this.quantity, this.cursor, ...rest);
    }, () => app.theme);
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

  private get quantity(): Quantity {
    return this.app.state.d_y as Quantity;
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
      x.show(state.d_x);
      y.show(state.d_y);
      way.show(state.d_way);
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
      this.list();
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
  }

  /** Table of bifurcations, updated when they change; expanded rows stay expanded. */
  private list(): void {
    const { diagram } = this;
    const { marks } = diagram;
    const printed = marks.map((mark) => printedBifurcation(this.app.state, mark));
    const listed = JSON.stringify([diagram.x, marks.map(({ value, name }) => [value, name]), printed]);
    if (listed === this.listed) return;
    this.listed = listed;
    const compared = printed.some(Boolean);
    byId("printed-head").hidden = !compared;
    const rows = marks.slice(0, LISTED).map((mark, i) => this.row(mark, i, compared ? (printed[i] ?? "") : null));
    const more = marks.length - rows.length;
    byId("marks").replaceChildren(
      ...rows,
      ...(more > 0 ? [make("tr", {}, make("td", { colspan: 6 }, `and ${more} more: all of them are in bifurcations.csv, under Share`))] : []),
    );
  }

  private row(mark: Mark, i: number, printed: string | null): HTMLElement {
    const sign = NUMBERS[this.diagram.x].symbol;
    const value = mark.exact ? `${sign} = ${mark.value.toFixed(12)}` : `${sign} = ${pretty(mark.value, 8)} ± ${mark.doubt.toExponential(0).replace("-", "−")}`;
    const itineraries = mark.before || mark.after ? `${spelled(mark.before) || "not periodic"} → ${spelled(mark.after) || "not periodic"}` : "—";
    const about = eventTerm(mark.name);
    const name = about ? make("details", {}, make("summary", {}, mark.name), make("p", { class: "about" }, about)) : mark.name;
    const show = make("button", { type: "button", click: () => this.open(mark.value, mark.start), "aria-label": `Show the motion at bifurcation ${i + 1}` }, "Show");
    return make("tr", { role: "row" },
      make("th", { scope: "row", role: "rowheader" }, String(i + 1)),
      cell("value", value),
      cell("event", name),
      cell("itinerary", itineraries),
      ...(printed === null ? [] : [cell("printed", printed)]),
      cell("", show),
    );
  }

  /** Shows the motion at a value, continued from a state at phase 0, or from the start without one. */
  private open(value: number, from: Triple | null): void {
    // The parameters of a device become those of its dimensionless model.
    const { state } = this.app;
    const next = { ...state, ...parameters(state), ...startOf(state), [this.diagram.x]: value };
    const start = from ? { x_r: from[0], v_r: from[1], v_c: from[2], phase: 0 } : { phase: next.phase % ((2 * Math.PI) / next.omega) };
    this.app.change({ ...next, ...start, view: "motion", units: "dimensionless" });
    byId("main").focus();
  }

  private openPlace(place: Place): void {
    const { value, column } = this.diagram.column(place);
    this.open(value, column?.stop === "done" ? column.end : null);
  }

  private say(place: Place): void {
    const { value, column } = this.diagram.column(place);
    const itinerary = itineraryOf(column);
    const way = WAYS[this.diagram.passes[place.pass]?.way ?? "up"];
    byId("diagram-status").textContent = `${NUMBERS[this.diagram.x].symbol} = ${pretty(value, 6)}, ${way}: ${itinerary ? spelled(itinerary) : column && column.stop !== "done" ? "left open" : "not periodic"}. Enter shows the motion.`;
  }

  private picking(): void {
    const box = byId("diagram");
    const nearest = (event: PointerEvent): Place | null => {
      const { area } = this;
      if (!area) return null;
      const { left, top } = box.getBoundingClientRect();
      const [px, py] = [event.clientX - left, event.clientY - top];
      // The value is chosen first, and among its points the nearest one.
      return this.diagram.nearest(this.quantity, (x, y) => Math.round(Math.abs(area.x(x) - px)) * 1000 + Math.abs(area.y(y) - py));
    };
    let from: number | null = null;
    box.addEventListener("pointerdown", (event) => (from = event.clientX));
    box.addEventListener("pointermove", (event) => {
      this.cursor = nearest(event);
      this.redraw();
    });
    box.addEventListener("pointerup", (event) => {
      const place = from !== null && Math.abs(event.clientX - from) < 6 ? nearest(event) : null;
      from = null;
      if (place) this.openPlace(place);
    });
    box.addEventListener("pointerleave", () => {
      this.cursor = null;
      this.redraw();
    });
    box.addEventListener("keydown", (event) => {
      const { passes } = this.diagram;
      const first = passes[0];
      if (!first) return;
      if (event.key === "Enter" && this.cursor) this.openPlace(this.cursor);
      const step = { ArrowLeft: -1, ArrowRight: 1, PageDown: -10, PageUp: 10 }[event.key] ?? 0;
      const turn = { ArrowUp: 1, ArrowDown: passes.length - 1 }[event.key] ?? 0;
      if (!step && !turn) return;
      event.preventDefault();
      const last = first.values.length - 1;
      const { pass, index } = this.cursor ?? { pass: 0, index: last >> 1 };
      // From pass to pass at one value, along which they run in different directions.
      const mirrored = (at: number, k: number): number => (passes[at]?.way === "down" ? last - k : k);
      const next = (pass + turn) % passes.length;
      this.cursor = { pass: next, index: mirrored(next, Math.max(0, Math.min(last, mirrored(pass, index) + step))) };
      this.panel.draw();
      this.say(this.cursor);
    });
  }
}

const cell = (name: string, content: HTMLElement | string): HTMLElement =>
  make("td", { role: "cell", ...(name ? { "data-name": name } : {}) }, content);
