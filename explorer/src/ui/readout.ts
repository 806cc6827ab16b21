// Description of the motion: itinerary, global map, quantities, table of segments, for all readers.
import { withUnit } from "../device.ts";
import { byId, make, mapText, pretty } from "../dom.ts";
import { fieldColour } from "../draw/colours.ts";
import type { Theme } from "../draw/colours.ts";
import { edgeOf, meaning } from "../itinerary.ts";
import type { Motion } from "../motion.ts";
import { modulus } from "../multipliers.ts";
import { TERMS, explained } from "./terms.ts";
import type { Term } from "./terms.ts";
import { MODES, OUTCOMES, dragged } from "../scene.ts";

const LISTED = 60; // segments in the table

const REASONS: Record<string, string> = {
  open: "The next switch stays open in 106 bits",
  stopped: "The run did not finish in time",
  refused: "The library refused these values",
  full: "",
  done: "",
};

/** Kind of the motion, in one sentence. */
export function verdict(motion: Motion): string {
  if (motion.stop !== "done") return `${REASONS[motion.stop] ?? motion.stop}${motion.why ? ` (${motion.why})` : ""}: what is shown ends there.`;
  const way = motion.periodNumber ? 0 : dragged(motion.parameters);
  if (way) return `The mean force exceeds friction: it drags the device ${way > 0 ? "forward" : "backward"} without end.`;
  if (!motion.periodNumber) return "Not periodic after these periods: it may still settle, or be chaotic.";
  const period = motion.periodNumber === 1 ? "Period-1 motion" : `Period-${motion.periodNumber} motion`;
  const drift = Math.abs(motion.progression) < 1e-9 ? "without progression" : motion.progression > 0 ? "moving forward" : "moving backward";
  const largest = motion.multipliers?.[0];
  const stable = largest ? (modulus(largest) < 1 ? ", stable" : ", unstable") : "";
  return `${period}, ${drift}${stable}.`;
}

export function showItinerary(box: HTMLElement, motion: Motion, theme: Theme): void {
  const cycle = motion.periodNumber ? motion.cycle : motion.segments;
  const shown = cycle.slice(0, 40);
  const total = shown.reduce((sum, s) => sum + s.duration, 0) || 1;
  box.replaceChildren(
    ...shown.map((s) => {
      const chip = make("li", { class: "chip", title: `${MODES[s.field - 1] ?? ""}: ${meaning(s.field)}` },
        make("b", {}, `F${s.field}`), make("span", {}, MODES[s.field - 1] ?? ""));
      chip.style.setProperty("--c", fieldColour(s.field, theme));
      chip.style.flexGrow = String(Math.max(0.02, s.duration / total));
      return chip;
    }),
    ...(cycle.length > shown.length ? [make("li", { class: "chip more" }, `and ${cycle.length - shown.length} more`)] : []),
  );
}

export function showMap(box: HTMLElement, motion: Motion): void {
  box.replaceChildren(motion.globalMap ? mapText(motion.globalMap) : "—");
}

type Row = readonly [term: Term, name: string, value: string, unit: string];

function rows(motion: Motion): Row[] {
  const { length, velocity, energy } = motion.units;
  const work = (value: number, digits: number): string => pretty(value * energy.factor, digits);
  return [
    ["period", "period number", motion.periodNumber ? String(motion.periodNumber) : "—", ""],
    ["progression", "progression", pretty(motion.progression * length.factor, 10), `${length.name} per period`],
    ["velocity", "average velocity", pretty(motion.velocity * velocity.factor, 7), velocity.name],
    ["multipliers", "multipliers |μ|", motion.multipliers ? motion.multipliers.map((z) => pretty(modulus(z), 4)).join(", ") : "—", ""],
    ["work", "work", work(motion.work, 9), `${energy.name} per period`],
    ["losses", "losses", Number.isFinite(motion.work) ? `${work(motion.damperLoss, 5)} + ${work(motion.frictionLoss, 5)}` : "—", `${energy.name} damper + friction`],
    ["switches", "switches", motion.periodNumber ? String(motion.cycle.length) : "—", motion.wide ? `${motion.wide} decided in 106 bits` : "all decided in double"],
  ];
}

/** Written into the elements that are there, whose explanations stay open. */
export function showQuantities(box: HTMLElement, motion: Motion): void {
  const wanted = rows(motion);
  const terms = wanted.map(([term]) => term).join();
  if (box.dataset["terms"] !== terms) {
    box.dataset["terms"] = terms;
    box.replaceChildren(...wanted.map(([term, name]) => quantity(term, name)));
  }
  wanted.forEach(([, , value, unit], i) => {
    const [number, small] = box.children[i]?.querySelectorAll("b, small") ?? [];
    if (number) number.textContent = value;
    if (small) small.textContent = unit;
  });
}

function quantity(term: Term, name: string): HTMLElement {
  const { button, about } = explained(name, TERMS[term], "dd");
  return make("div", { class: "quantity" }, make("dt", {}, name, " ", button), make("dd", {}, make("b"), " ", make("small")), about);
}

export function showSegments(body: HTMLElement, motion: Motion, theme: Theme): void {
  const { time, length, velocity } = motion.units;
  const units = length.name && ` in ${length.name}, ${velocity.name}`;
  byId("duration-unit").textContent = time.name && ` in ${time.name}`;
  byId("start-unit").textContent = units;
  const shown = motion.cycle.slice(0, LISTED);
  const more = motion.cycle.length - shown.length;
  body.replaceChildren(
    ...shown.map((s, i) =>
      make("tr", { role: "row" },
        make("th", { scope: "row", role: "rowheader" }, dot(fieldColour(s.field, theme)), `F${s.field} ${MODES[s.field - 1] ?? ""}`),
        cell("local map", s.source && s.target ? mapText(`P_{Σ${s.target},F${s.field},Σ${s.source}}`) : "—"),
        cell(withUnit("duration", time), pretty(s.duration * time.factor, 7)),
        cell(`start${units}`, s.start.map((value, k) => pretty(value * (k ? velocity : length).factor, 6)).join(", ")),
        cell("ends by", `${edgeOf(s.field, motion.cycle[(i + 1) % motion.cycle.length]?.field ?? s.field) || OUTCOMES[s.outcome]}${s.wide ? ", 106 bits" : ""}`),
      ),
    ),
    ...(more > 0 ? [make("tr", { role: "row" }, make("td", { role: "cell", colspan: 5 }, `and ${more} more: all of them are in segments.csv, under Share`))] : []),
  );
}

function dot(colour: string): HTMLElement {
  const made = make("span", { class: "dot" });
  made.style.setProperty("--c", colour);
  return made;
}

const cell = (name: string, content: Node | string): HTMLElement => make("td", { role: "cell", "data-name": name }, content);
