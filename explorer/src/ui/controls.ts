// A number's control: name, explanation, field and slider; what is refused is said at the field.
import { field } from "../fields.ts";
import type { NumberName, Origin } from "../fields.ts";
import { make, symbol } from "../dom.ts";
import { parameters, read, refusal, startScales } from "../state.ts";
import type { State } from "../state.ts";

export type Change = (change: Partial<State>) => string;

export interface Control {
  element: HTMLElement;
  show(state: State): void;
}

const plain = (value: number): string => String(value);

/** `change` takes a new value and returns a message if it contradicts other fields, or "". */
export function numberControl(name: NumberName, change: Change): Control {
  const { symbol: sign, name: label, about, unit, si, slider, whole } = field(name);
  const id = `field-${name}`;
  const error = make("p", { class: "error", id: `${id}-error`, role: "alert", hidden: true });
  const help = make("p", { class: "about", id: `${id}-about`, hidden: true }, about);
  const entry = make("input", { id, type: "text", inputmode: whole ? "numeric" : "decimal", autocomplete: "off", spellcheck: "false", "aria-describedby": `${id}-error` });
  const query = make("button", { type: "button", class: "help", "aria-expanded": "false", "aria-controls": `${id}-about`, "aria-label": `What is ${label}?` }, "?");
  query.addEventListener("click", () => {
    help.hidden = !help.hidden;
    query.setAttribute("aria-expanded", String(!help.hidden));
  });
  const shownUnit = make("span", { class: "unit" }, unit ?? "");
  let held = NaN;
  const refuse = (why: string): void => {
    error.hidden = why === "";
    error.textContent = why && `${why}. It is still ${plain(held)}.`;
    if (why) entry.setAttribute("aria-invalid", "true");
    else entry.removeAttribute("aria-invalid");
  };
  const take = (value: number): void => refuse(refusal(name, value) || change({ [name]: value }));
  entry.addEventListener("input", () => {
    // While something is being typed it is not yet wrong; what is a value already counts.
    const value = read(entry.value);
    if (!refusal(name, value)) take(value);
  });
  entry.addEventListener("change", () => take(read(entry.value)));
  entry.addEventListener("keydown", (event) => {
    if (event.key !== "Escape" || error.hidden) return;
    entry.value = plain(held);
    refuse("");
  });
  const row = make("div", { class: "control" },
    make("label", { for: id }, symbol(sign), make("span", { class: "name" }, label)),
    query,
    make("span", { class: "entry" }, entry, ...(unit || si ? [shownUnit] : [])),
  );
  let bar: HTMLInputElement | null = null;
  if (slider) {
    const [low, high, step] = slider;
    bar = make("input", { type: "range", min: low, max: high, step, "aria-label": `${label}, slider`, class: "slider" });
    const moved = bar;
    moved.addEventListener("input", () => {
      take(Number(moved.value));
      if (Number(moved.value) !== held) moved.value = plain(held); // refused
    });
    row.append(moved);
  }
  row.append(error, help);
  return {
    element: row,
    show(state) {
      held = state[name];
      if (document.activeElement !== entry || read(entry.value) !== state[name]) {
        entry.value = plain(state[name]);
        refuse("");
      }
      if (si) shownUnit.textContent = state.units === "device" ? si : "";
      if (!bar || !slider) return;
      if (si) {
        // A start's slider ends where the motion's scale puts it.
        const scale = startScales(state)[name as Origin];
        const whole = name === "phase" ? (2 * Math.PI * scale) / parameters(state).omega : 10 ** Math.ceil(Math.log10(scale) - 1e-9);
        const [low, high, step] = name === "phase" ? [0, 0.999, 0.001] : slider;
        [bar.min, bar.max, bar.step] = [low, high, step].map((end) => String(end * whole)) as [string, string, string];
      }
      if (document.activeElement !== bar || Number(bar.value) !== state[name]) bar.value = plain(state[name]);
      bar.setAttribute("aria-valuetext", `${plain(state[name])} ${shownUnit.textContent ?? ""}`.trim());
    },
  };
}

export interface Choice {
  element: HTMLElement;
  select: HTMLSelectElement;
  /** Shows a value that holds; what was refused before is forgotten once another one holds. */
  show(value: string): void;
}

/** A choice as a labelled list. A refusal is shown there, and the list keeps the valid choice. */
export function choiceControl(id: string, label: string, options: readonly (readonly [string, string])[], chosen: (value: string) => string): Choice {
  const error = make("p", { class: "error", id: `${id}-error`, role: "alert", hidden: true });
  const select = make("select", { id, "aria-describedby": `${id}-error` }, ...options.map(([value, text]) => make("option", { value }, text)));
  let held = "";
  const refuse = (why: string): void => {
    error.hidden = why === "";
    error.textContent = why;
  };
  select.addEventListener("change", () => {
    const why = chosen(select.value);
    if (why) select.value = held;
    refuse(why);
  });
  const show = (value: string): void => {
    if (value !== held) refuse("");
    held = select.value = value;
  };
  return { element: make("div", { class: "control choice" }, make("label", { for: id }, make("span", { class: "name" }, label)), select, error), select, show };
}
