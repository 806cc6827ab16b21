// A tour of two minutes: a few cards, each beside its subject.
import { byId, make } from "../dom.ts";
import { MODES } from "../scene.ts";

interface Stop {
  at: string;
  title: string;
  text: string;
}

const STOPS: readonly Stop[] = [
  { at: "capsule-box", title: "A capsule that moves itself", text: "Inside the capsule a mass swings on a spring, driven by a periodic force. After a gap it meets a stop. Below, dry friction holds the capsule or lets it slide: so it creeps forward, or backward." },
  { at: "parameters", title: "Parameters", text: "The motion depends on a few numbers without units, or on a device in SI units. The scene above them is the kind of capsule: another drive, two stops, a slope. Move a slider: the motion is computed at once. The ? beside a name explains it." },
  { at: "itinerary-box", title: "Exact, segment by segment", text: `Between switches the equations are linear, and their solutions are known in closed form. The fields F1 to F${MODES.length} follow each other; the list is the itinerary, and each switch is proved to be the first.` },
  { at: "map-box", title: "The global map", text: "The same in the paper's notation: local maps from one switching plane to the next, composed from right to left." },
  { at: "phase", title: "Portraits", text: "One period of the motion in its phase plane and in its state space, each segment in its field's colour. The state space turns by dragging, or by the arrow keys." },
  { at: "tab-diagram", title: "Diagram", text: "One parameter varies, up and down. Where the itinerary changes, the event's own equation is solved: the vertical lines are bifurcations, exact to rounding. Choose a place to see the motion there." },
  { at: "tab-chart", title: "Chart and basin", text: "Two parameters, or two starts: each colour is an itinerary, or, over starts, an attractor. The picture comes coarse and is refined where neighbours differ." },
  { at: "share-open", title: "Take it along", text: "The address holds all you see. It can also be copied as Python, as a command line or as a file, and what is drawn saved as CSV, PNG or SVG." },
];

const CORNERS = ["", "left", "above", "above left"];

/** Common area of two boxes, in square pixels. */
function overlap(one: DOMRect, other: DOMRect): number {
  const wide = Math.min(one.right, other.right) - Math.max(one.left, other.left);
  const high = Math.min(one.bottom, other.bottom) - Math.max(one.top, other.top);
  return Math.max(0, wide) * Math.max(0, high);
}

/** `before` opens the view of the card. */
export function tour(before: () => void): void {
  const dialog = byId<HTMLDialogElement>("tour");
  if (dialog.open) return;
  let at = 0;
  const title = make("h2", { id: "tour-title" });
  const text = make("p");
  const count = make("p", { class: "count" });
  const back = make("button", { type: "button", click: () => go(at - 1) }, "Back");
  const next = make("button", { type: "button", class: "primary", click: () => go(at + 1) }, "Next");
  const end = make("button", { type: "button", click: () => dialog.close() }, "End the tour");
  dialog.replaceChildren(title, text, count, make("div", { class: "row" }, end, back, next));
  const mark = (on: boolean): void => {
    const target = document.getElementById(STOPS[at]?.at ?? "");
    target?.classList.toggle("toured", on);
    if (!on || !target) return;
    target.scrollIntoView({ block: "nearest", behavior: "instant" });
    // The card stands in the corner where it covers least of its subject.
    const covered = (corner: string): number => {
      dialog.className = corner;
      return overlap(dialog.getBoundingClientRect(), target.getBoundingClientRect());
    };
    const least = CORNERS.map(covered);
    dialog.className = CORNERS[least.indexOf(Math.min(...least))] ?? "";
  };
  function go(to: number): void {
    mark(false);
    const stop = STOPS[to];
    if (!stop) {
      dialog.close();
      return;
    }
    at = to;
    before();
    title.textContent = stop.title;
    text.textContent = stop.text;
    count.textContent = `${at + 1} of ${STOPS.length}`;
    back.disabled = at === 0;
    next.textContent = at === STOPS.length - 1 ? "Done" : "Next";
    mark(true);
  }
  const keys = (event: KeyboardEvent): void => {
    if (event.key === "Escape") dialog.close();
  };
  document.addEventListener("keydown", keys);
  dialog.addEventListener("close", () => {
    mark(false);
    document.removeEventListener("keydown", keys);
  }, { once: true });
  dialog.show();
  go(0);
  next.focus();
}
