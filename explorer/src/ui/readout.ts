// The motion in words and numbers: itinerary, global map, quantities, table of segments, for all readers.
import { make, mapText, pretty } from "../dom.ts";
import { scales } from "../device.ts";
import { MEANINGS, MODES } from "../itinerary.ts";
import type { Motion } from "../motion.ts";
import { modulus } from "../multipliers.ts";
import type { State } from "../state.ts";

const REASONS: Record<string, string> = {
  open: "The next switch stays open in 106 bits",
  stopped: "The run did not finish in time",
  refused: "The library refused these values",
  full: "",
  done: "",
};

/** What kind of motion it is, in one sentence. */
export function verdict(motion: Motion): string {
  if (motion.stop !== "done") return `${REASONS[motion.stop] ?? motion.stop}${motion.why ? ` (${motion.why})` : ""}: what is shown ends there.`;
  if (!motion.multiple) return "Not periodic after these periods: it may still settle, or be chaotic.";
  const period = motion.multiple === 1 ? "Period-1 motion" : `Period-${motion.multiple} motion`;
  const drift = Math.abs(motion.progression) < 1e-9 ? "without progression" : motion.progression > 0 ? "moving forward" : "moving backward";
  const largest = motion.multipliers?.[0];
  const stable = largest ? (modulus(largest) < 1 ? ", stable" : ", unstable") : "";
  return `${period}, ${drift}${stable}.`;
}

export function showItinerary(box: HTMLElement, motion: Motion): void {
  const cycle = motion.multiple ? motion.cycle : motion.segments;
  const shown = cycle.slice(0, 40);
  const total = shown.reduce((sum, s) => sum + s.duration, 0) || 1;
  box.replaceChildren(
    ...shown.map((s) => {
      const chip = make("li", { class: `chip f${s.field}`, title: `${MODES[s.field - 1] ?? ""}: ${MEANINGS[s.field - 1] ?? ""}` },
        make("b", {}, `F${s.field}`), make("span", {}, MODES[s.field - 1] ?? ""));
      chip.style.flexGrow = String(Math.max(0.02, s.duration / total));
      return chip;
    }),
    ...(cycle.length > shown.length ? [make("li", { class: "chip more" }, `and ${cycle.length - shown.length} more`)] : []),
  );
}

export function showMap(box: HTMLElement, motion: Motion): void {
  box.replaceChildren(motion.globalMap ? mapText(motion.globalMap) : "—");
}

const ABOUT: Record<string, string> = {
  "progression": "How far the capsule advances in one excitation period.",
  "average velocity": "Progression over the excitation period 2π/ω.",
  "period number": "After how many excitation periods the motion repeats.",
  "multipliers |μ|": "Floquet multipliers: by how much a small deviation grows in one period of the motion. All below 1: stable. One is 0 where the capsule sticks.",
  "work": "Work of the driving force in one excitation period; the damper and the friction take it up.",
  "losses": "What the damper and the friction take up in one excitation period.",
  "switches": "Segments in one period of the motion, and how many of their ends double precision left open and 106 bits decided.",
  "speed": "Average speed of the device.",
};

export function showQuantities(box: HTMLElement, motion: Motion, state: State): void {
  const rows: [string, string, string][] = [
    ["period number", motion.multiple ? String(motion.multiple) : "—", ""],
    ["progression", pretty(motion.progression, 10), "per period"],
    ["average velocity", pretty(motion.velocity, 7), ""],
  ];
  if (state.units === "device") {
    const { length, time } = scales(state);
    rows.push(["speed", pretty(((motion.velocity * length) / time) * 1000, 6), "mm/s"]);
  }
  rows.push(
    ["multipliers |μ|", motion.multipliers ? motion.multipliers.map((z) => pretty(modulus(z), 4)).join(", ") : "—", ""],
    ["work", pretty(motion.work, 9), "per period"],
    ["losses", Number.isFinite(motion.work) ? `${pretty(motion.damperLoss, 5)} + ${pretty(motion.frictionLoss, 5)}` : "—", "damper + friction"],
    ["switches", motion.multiple ? String(motion.cycle.length) : "—", motion.wide ? `${motion.wide} decided in 106 bits` : "all decided in double"],
  );
  box.replaceChildren(...rows.map(([name, value, unit]) => quantity(name, value, unit)));
}

function quantity(name: string, value: string, unit: string): HTMLElement {
  return make("div", { class: "quantity", title: ABOUT[name] ?? "" }, make("dt", {}, name), make("dd", {}, make("b", {}, value), ...(unit ? [" ", make("small", {}, unit)] : [])));
}

export function showSegments(body: HTMLElement, motion: Motion): void {
  body.replaceChildren(
    ...motion.cycle.slice(0, 60).map((s) =>
      make("tr", {},
        make("th", { scope: "row" }, make("span", { class: `dot f${s.field}` }), `F${s.field} ${MODES[s.field - 1] ?? ""}`),
        make("td", {}, s.source && s.target ? mapText(`P_{Σ${s.target},F${s.field},Σ${s.source}}`) : "—"),
        make("td", {}, pretty(s.duration, 7)),
        make("td", {}, s.start.map((value) => pretty(value, 6)).join(", ")),
        make("td", {}, s.wide ? `${s.outcome}, 106 bits` : s.outcome),
      ),
    ),
  );
}
