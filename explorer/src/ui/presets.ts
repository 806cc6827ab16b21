// Presets: the panels of Fig. 7 at both mass ratios, its bifurcations; of any scene diagrams, charts, a device.
import data from "../../presets.json" with { type: "json" };
import { make } from "../dom.ts";
import { globalMap, rotated } from "../itinerary.ts";
import { NUMBERS, PARAMETERS, RANGES } from "../fields.ts";
import { PULSES, REACH, SCENE } from "../scene.ts";
import type { Mark } from "../jobs.ts";
import type { Motion } from "../motion.ts";
import { defaults, parameters } from "../state.ts";
import type { State } from "../state.ts";

export interface Preset {
  group: string;
  name: string;
  state: Partial<State>;
}

const panel = (one: (typeof data.panels)[number], gamma: number): Preset => ({
  group: `Fig. 7, γ = ${gamma}`,
  name: `${one.panel}  α = ${one.alpha}`,
  state: { view: "motion", alpha: one.alpha, gamma, periods: 400 },
});

/** A line's name with its part as an exponent. */
const lineName = (line: string): string => line.replace(/\^\(([123])\)/, (_, part: string) => `⁽${"¹²³"[Number(part) - 1] ?? part}⁾`);

const event = (one: (typeof data.bifurcations)[number]): Preset => ({
  group: `Bifurcations, γ = ${one.gamma}`,
  name: `${one.type} ${lineName(one.line)}, α = ${one.alpha.toFixed(6)}`,
  state: {
    view: "diagram", gamma: one.gamma, d_x: "alpha", d_y: "x_r", d_count: 160,
    d_from: Math.max(0.001, Number((one.alpha - 0.04).toFixed(3))), d_to: Number((one.alpha + 0.04).toFixed(3)),
  },
});

/** True if the paper is about this scene. */
const PRINTED = data.scene === SCENE;

export const PRESETS: readonly Preset[] = [
  ...(PRINTED ? [...data.gammas.flatMap((gamma) => data.panels.map((one) => panel(one, gamma))), ...data.bifurcations.map(event)] : []),
  { group: "Diagrams", name: `Motions by ${NUMBERS.alpha.symbol}`, state: { view: "diagram" } },
  ...(["omega", ...PULSES.slice(2)] as const).map((name) => ({
    group: "Diagrams", name: `Progression by ${NUMBERS[name].symbol}`, state: { view: "diagram", d_x: name, d_y: "progression", d_from: RANGES[name][0], d_to: RANGES[name][1] },
  })),
  { group: "Charts", name: `Itineraries over ${NUMBERS.alpha.symbol} and ${NUMBERS.gamma.symbol}`, state: { view: "chart" } },
  ...PULSES.slice(2).map((name) => ({
    group: "Charts", name: `Progression over ${NUMBERS.omega.symbol} and ${NUMBERS[name].symbol}`,
    state: { view: "chart", c_by: "progression", c_x: "omega", c_y: name, c_x0: RANGES.omega[0], c_x1: RANGES.omega[1], c_y0: RANGES[name][0], c_y1: RANGES[name][1] },
  })),
  { group: "Charts", name: "Basins of attractors", state: { view: "chart", ...(PRINTED && data.basin), c_x: "x_r", c_y: "v_r", c_x0: -REACH, c_x1: REACH, c_y0: -REACH, c_y1: REACH, c_by: "attractor" } },
  { group: "Devices", name: "A device in SI units", state: { view: "motion", units: "device" } },
];

/** Fills a list with the presets, by group. */
export function fill(select: HTMLSelectElement, choose: (state: State) => void): void {
  const groups = new Map<string, HTMLOptGroupElement>();
  PRESETS.forEach((preset, i) => {
    const group = groups.get(preset.group) ?? make("optgroup", { label: preset.group });
    groups.set(preset.group, group);
    group.append(make("option", { value: i }, preset.name));
  });
  select.append(make("option", { value: "" }, "Presets…"), ...groups.values());
  select.addEventListener("change", () => {
    const preset = PRESETS[Number(select.value)];
    if (select.value !== "" && preset) choose({ ...defaults(), ...preset.state });
    select.value = "";
  });
}

/** True if the parameters other than α and γ are those of the case study. */
function caseStudy(state: State): boolean {
  const [p, plain] = [parameters(state), defaults()];
  return PRINTED && PARAMETERS.every((name) => name === "alpha" || name === "gamma" || p[name] === plain[name]);
}

/** Match with the paper: is this case printed, and is its global map the exact one? */
export function printedAt(state: State, motion: Motion): string {
  const p = parameters(state);
  const one = data.panels.find(({ alpha }) => alpha === p.alpha);
  if (!caseStudy(state) || !one || !data.gammas.includes(p.gamma)) return "";
  const steps = motion.cycle;
  const same = motion.globalMap === one.printed || steps.some((_, i) => globalMap(rotated(steps, i)) === one.printed);
  const what = `Fig. 7${one.panel} prints ${one.printed.replace(/_\{([^}]*)\}/g, "($1)")}`;
  return same ? `${what}: the same.` : `${what}: the exact map differs.`;
}

type Known = (typeof data.bifurcations)[number];
const NEAR = 1e-9;

/** Printed value of a bifurcation of the diagram, with its error; "" if none is printed. */
export function printedBifurcation(state: State, mark: Pick<Mark, "value" | "name">): string {
  if (state.d_x !== "alpha" || !caseStudy(state)) return "";
  const gamma = parameters(state).gamma;
  const one = data.bifurcations.find((known) => known.gamma === gamma && Math.abs(known.alpha - mark.value) < NEAR && mark.name.startsWith(known.type));
  return one ? printedText(one) : "";
}

const printedText = (one: Known): string =>
  one.printed === null ? "none" : `${one.printed} (${(100 * (one.printed / one.alpha - 1)).toFixed(2).replace("-", "−")} %)`;

/** Beside a chart of the case study: its bifurcations, exact at each mass ratio, and as printed. */
export function showKnown(box: HTMLElement, state: State): void {
  const shown = caseStudy(state) && state.c_x === "alpha" && state.c_y === "gamma";
  box.hidden = !shown;
  const body = box.querySelector("tbody");
  if (!shown || !body) return;
  body.replaceChildren(
    ...data.bifurcations.map((one) =>
      make("tr", { role: "row" },
        make("th", { scope: "row", role: "rowheader" }, `${one.type} on ${lineName(one.line)}`),
        make("td", { role: "cell", "data-name": "γ" }, String(one.gamma)),
        make("td", { role: "cell", "data-name": "exact α" }, one.alpha.toFixed(12)),
        make("td", { role: "cell", "data-name": "printed α" }, printedText(one)),
      ),
    ),
  );
}
