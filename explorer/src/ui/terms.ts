// Explanations of the page's terms: a "?" beside each.
import { make } from "../dom.ts";
import { MODEL, MODES, PULSES, REACTS } from "../scene.ts";

const { SPRINGS, BOUNDS } = MODEL;
const letter = (name: keyof typeof MODEL.PARAMETER_FIELDS | undefined): string => (name ? MODEL.PARAMETER_FIELDS[name].symbol : "");
const surfaces = SPRINGS.map(([gap], i) => `x_r = ${i ? "−" : ""}${letter(gap)}`).join(" and ");
const sides = SPRINGS.length > 1 ? "in contact with the stop in front (FC), with that behind (BC) or with none (NC)" : "in contact with the second spring (C) or not (NC)";
const pull = REACTS ? "P − u" : "P";
const held = `−${letter(BOUNDS["-1"])} ≤ ${pull} ≤ ${letter(BOUNDS["1"])}${REACTS ? " at phase 0" : ""}`;

export const TERMS = {
  itinerary: `The fields that the motion passes through in one period, in order. A field is the part of the state space in which one set of linear equations holds: ${sides}, the capsule drifting forward (FD), sticking (S) or drifting backward (BD)${PULSES.length ? ", and the drive high (H) or low (L)" : ""}. So ${MODES.map((mode, i) => `F${i + 1} is ${mode}`).join(", ")}. A segment is as wide here as it is long in time.`,
  map: "The motion as the paper writes it: P with index Σj,Fi,Σk is the local map through field Fi from the switching plane Σk to Σj. The maps are composed from right to left; a motion that stays in one field is Id.",
  capsule: `The capsule, its inner mass, its spring and stops at one time. The mass has its field's colour. The grey arrow above it is the drive${REACTS ? ", which pushes the capsule back by as much" : ""}; the red one below is the friction on the capsule${MODEL.LOAD ? " and its weight on the slope, which is drawn steeper than it is" : ""}, the blue one its velocity.`,
  history: "Relative displacement x_r = x_m − x_c, relative velocity v_r = v_m − v_c and velocity of the capsule v_c over the periods of the excitation. The bands are the fields, the line at the foot is the drive. Drag to enlarge a part, click twice for the whole.",
  phase: `Two of the three states against each other, each segment in its field's colour. Circles are switches${PULSES.length ? ", full ones edges of the drive" : ""}; ${surfaces} is where the mass meets a stop.`,
  space: `All three states. Blue is ${surfaces}, where impacts are. The grey part of v_c = 0 is where friction holds the capsule, ${held}; its edges are where it lets go.`,
  segments: `Every segment of one period: its local map, its duration, its state at the start, and how it ends. ${PULSES.length ? "Rise, fall: at an edge of the drive, at a known time. " : ""}Regular: the guard crosses zero at an angle. Graze: it only touches. Corner: two guards at once. Sliding tangency: friction takes or lets go tangentially. Undecided: open even in 106 bits. A switch that double precision leaves open is decided in 106 bits.`,
  period: "After how many excitation periods the motion repeats.",
  progression: "How far the capsule advances in one excitation period.",
  velocity: "Progression over the excitation period 2π/ω.",
  multipliers: "Floquet multipliers: by how much a small deviation grows in one period of the motion. All below 1: stable. One is 0 where the capsule sticks.",
  work: "Work of the driving force in one excitation period; damper and friction take it up.",
  losses: "What the damper and the friction take up in one excitation period.",
  switches: "Segments in one period of the motion, and the number of their ends that 106 bits decided because double precision could not.",
  diagram: "One parameter varies. At every value the motion is run until it has settled, and then drawn: one point for each period of the excitation after which it repeats. “Up” and “down” start at each value from the last state, so that motions that coexist are found; further starts find more.",
  marks: "Where the itinerary changes. It is bracketed by bisection; then the event's own equation is solved along the periodic orbit, to rounding. Where no equation was solved, the value has its uncertainty, and its line is dashed.",
  chart: "At every point of the plane a motion is run until it has settled, and coloured. Squares with equal corners are filled, all others refined, and in the end every cell beside another colour is run itself.",
} as const;
export type Term = keyof typeof TERMS;

/** By the beginning of its name, what an event is. */
const EVENTS: readonly (readonly [string, string])[] = [
  ["boundary-intersection crossing", "A switch of contact and one of friction change their order: the motion passes through the line in which two switching planes meet."],
  ["grazing on", "The mass just touches a stop, or no longer leaves it: a segment of contact, or one without, appears with no duration."],
  ["adding-sliding", "A drift just begins, or ends, within a sticking segment: a drift of no duration splits it."],
  ["crossing-sliding", "A sticking segment of no duration appears where the capsule turns its drift around."],
  ["switching-sliding", "The end of a drift moves over the edge of the sticking region: a drift the other way appears before the capsule sticks."],
  ["grazing-sliding", "A drift just touches rest: a sticking segment, or a drift the other way, appears within it with no duration."],
  ["edge", "A switch meets an edge of the drive: beyond it they come in the other order, or the switch is not there."],
  ["period doubling", "A multiplier passes −1: the motion repeats only after twice as many periods."],
  ["fold", "A multiplier reaches 1: the stable motion meets an unstable one, and both vanish."],
  ["Neimark-Sacker", "A pair of multipliers leaves the unit circle: the motion becomes quasi-periodic."],
  ["jump to another motion", "On the two sides the runs come to different motions; no event's equation was solved there."],
  ["end of a periodic motion", "On one side the runs come to no periodic motion in the time they are given; no event's equation was solved there."],
  ["left open", "What is here was not looked for to the end."],
];

export const eventTerm = (name: string): string => EVENTS.find(([begin]) => name.startsWith(begin))?.[1] ?? "";

let made = 0;

/** A "?" that shows and hides a text, and the text. */
export function explained(name: string, text: string, tag: "p" | "dd" = "p"): { button: HTMLButtonElement; about: HTMLElement } {
  const id = `about-${++made}`;
  const about = make(tag, { class: "about", id, hidden: true }, text);
  const button = make("button", { type: "button", class: "help", "aria-expanded": "false", "aria-controls": id, "aria-label": `What is ${name}?` }, "?");
  button.addEventListener("click", () => {
    about.hidden = !about.hidden;
    button.setAttribute("aria-expanded", String(!about.hidden));
  });
  return { button, about };
}

/** Puts a "?" beside every heading that names a term. */
export function explainHeadings(): void {
  for (const heading of document.querySelectorAll<HTMLElement>("[data-term]")) {
    const { button, about } = explained(`“${heading.textContent ?? ""}”`, TERMS[heading.dataset["term"] as Term]);
    const title = make("div", { class: "title" });
    heading.replaceWith(title);
    title.append(heading, button);
    (title.closest(".card-head") ?? title).after(about);
  }
}
