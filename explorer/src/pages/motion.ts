// The view of one motion: computed and drawn in one go whenever the state changes.
import type { App } from "../app.ts";
import { byId, make } from "../dom.ts";
import { Panel } from "../draw/panel.ts";
import { CHOICES, DEVICE, NUMBERS, PARAMETERS, STARTS } from "../fields.ts";
import { motionAt } from "../motion.ts";
import type { Motion } from "../motion.ts";
import type { State } from "../state.ts";
import { showItinerary, showMap, showQuantities, showSegments, verdict } from "../ui/readout.ts";
import { drawCapsule, nowAt } from "../views/capsule.ts";
import { History, drawHistory } from "../views/history.ts";
import { PLANES, drawPhase } from "../views/phase.ts";
import { drawSpace } from "../views/space.ts";
import type { Turn } from "../views/space.ts";
import { printedAt } from "../ui/presets.ts";

const COMPUTED = ["units", ...PARAMETERS, ...DEVICE, ...STARTS, "phase", "periods"] as const;

export class MotionPage {
  motion: Motion | null = null;
  readonly panels: Record<string, Panel>;
  private readonly history: History;
  private share = 0;
  private rounds = 0;
  private playing = false;
  private asked = 0;
  private told = 0;

  constructor(private readonly app: App) {
    const theme = () => app.theme;
    const drawn = (draw: (motion: Motion, ...rest: Parameters<ConstructorParameters<typeof Panel>[1]>) => void) =>
      (...rest: Parameters<ConstructorParameters<typeof Panel>[1]>): void => {
        if (this.motion) draw(this.motion, ...rest);
      };
    this.history = new History(byId("history"), theme);
    this.panels = {
      capsule: new Panel(byId("capsule"), drawn((motion, ...rest) => drawCapsule(motion, nowAt(motion, this.share, this.rounds), ...rest)), theme),
      phase: new Panel(byId("phase"), drawn((motion, ...rest) => drawPhase(motion, this.plane, ...rest)), theme),
      space: new Panel(byId("space"), drawn((motion, ...rest) => drawSpace(motion, this.turn, ...rest)), theme),
    };
    this.planeChoice();
    this.turning();
    this.playback();
    app.listen((state, before) => {
      if (state.view !== "motion") return;
      const same = this.motion && before.view === "motion" && before !== state && COMPUTED.every((name) => state[name] === before[name]);
      if (!same) this.schedule();
      else if (state.around !== before.around || state.above !== before.above) this.panels["space"]?.draw();
      else if (state.plane !== before.plane) this.panels["phase"]?.draw();
    });
  }

  private get plane(): number {
    return CHOICES.plane.of.indexOf(this.app.state.plane);
  }

  private get turn(): Turn {
    const { around, above } = this.app.state;
    return { around: (around * Math.PI) / 180, above: (above * Math.PI) / 180 };
  }

  /** Draws before the next frame, however often it is called until then. */
  private schedule(): void {
    if (this.asked) return;
    this.asked = requestAnimationFrame(() => {
      this.asked = 0;
      this.update();
    });
  }

  update(): void {
    const { app } = this;
    if (!app.ready) return;
    const begun = performance.now();
    const motion = (this.motion = motionAt(app.core, app.state));
    const computed = performance.now() - begun;
    this.rounds = 0;
    this.show(motion, app.state);
    const all = performance.now() - begun;
    byId("timing").textContent = `${app.state.periods} periods${motion.byNewton ? ", Newton's method" : ""} and orbit in ${computed.toFixed(1)} ms`;
    performance.measure("picture", { start: begun, duration: all });
    document.documentElement.dataset["motions"] = String(Number(document.documentElement.dataset["motions"] ?? 0) + 1);
  }

  private show(motion: Motion, state: State): void {
    // The panels take their sizes before the plot of histories changes the page: it is laid out once.
    for (const panel of Object.values(this.panels)) panel.draw();
    this.history.show(motion);
    showItinerary(byId("itinerary"), motion, this.app.theme);
    showMap(byId("map"), motion);
    showQuantities(byId("quantities"), motion);
    showSegments(byId("segments"), motion, this.app.theme);
    const printed = byId("printed");
    const text = printedAt(state, motion);
    printed.hidden = text === "";
    printed.textContent = text;
    // Screen readers get the text once a slider stops.
    clearTimeout(this.told);
    const say = verdict(motion);
    if (byId("verdict").textContent === "") byId("verdict").textContent = say;
    else this.told = window.setTimeout(() => (byId("verdict").textContent = say), 120);
  }

  /** Every picture as SVG, by name. */
  svgs(): Record<string, string> {
    const { motion } = this;
    if (!motion) return {};
    const made = Object.fromEntries(Object.entries(this.panels).map(([name, panel]) => [name, panel.svg(`capsule-sym ${name}`)]));
    const spare = document.createElement("div");
    const panel = new Panel(spare, (...rest) => drawHistory(motion, ...rest), () => this.app.theme);
    return { ...made, history: panel.svg("capsule-sym time histories") };
  }

  private planeChoice(): void {
    const select = byId<HTMLSelectElement>("plane");
    select.append(...PLANES.map(({ name }, i) => make("option", { value: CHOICES.plane.of[i] ?? "" }, name)));
    select.addEventListener("change", () => this.app.change({ plane: select.value }));
    const show = (): void => {
      select.value = this.app.state.plane;
    };
    this.app.listen(show);
    show();
  }

  private turning(): void {
    const box = byId("space");
    let from: { x: number; y: number; around: number; above: number } | null = null;
    const to = (around: number, above: number): void => {
      const { low, high } = NUMBERS.above;
      this.app.change({ around: Math.round(around) % 360, above: Math.max(low, Math.min(high, Math.round(above))) });
    };
    box.addEventListener("pointerdown", (event) => {
      const { around, above } = this.app.state;
      from = { x: event.clientX, y: event.clientY, around, above };
      box.setPointerCapture(event.pointerId);
    });
    box.addEventListener("pointermove", (event) => {
      if (from) to(from.around - (event.clientX - from.x) * 0.6, from.above + (event.clientY - from.y) * 0.6);
    });
    for (const end of ["pointerup", "pointercancel"]) box.addEventListener(end, () => (from = null));
    box.addEventListener("keydown", (event) => {
      const step = ({ ArrowLeft: [6, 0], ArrowRight: [-6, 0], ArrowUp: [0, 6], ArrowDown: [0, -6] } as const)[event.key as "ArrowLeft"];
      if (!step) return;
      event.preventDefault();
      to(this.app.state.around + step[0], this.app.state.above + step[1]);
    });
  }

  private playback(): void {
    const [button, scrub, pace] = [byId<HTMLButtonElement>("play"), byId<HTMLInputElement>("scrub"), byId<HTMLSelectElement>("pace")];
    let last = 0;
    const frame = (now: number): void => {
      if (!this.playing) return;
      const { motion } = this;
      if (motion?.turns && this.app.state.view === "motion" && !document.hidden) {
        // One excitation period in three seconds.
        const next = this.share + (Math.min(100, now - last) * Number(pace.value)) / 3000 / motion.turns;
        this.rounds += Math.floor(next);
        this.share = next % 1;
        scrub.value = String(this.share);
        this.panels["capsule"]?.draw();
      }
      last = now;
      requestAnimationFrame(frame);
    };
    const play = (on: boolean): void => {
      this.playing = on;
      button.setAttribute("aria-pressed", String(on));
      button.textContent = on ? "Pause" : "Play";
      last = performance.now();
      if (on) requestAnimationFrame(frame);
    };
    button.addEventListener("click", () => play(!this.playing));
    scrub.addEventListener("input", () => {
      play(false);
      this.share = Math.min(0.9999, Number(scrub.value));
      this.panels["capsule"]?.draw();
    });
    if (!matchMedia("(prefers-reduced-motion: reduce)").matches) setTimeout(() => play(true), 600);
  }
}
