// A file of parameters opened on the page: TOML as for --params, dimensionless or a device in SI units.
import { parse } from "smol-toml";
import type { App } from "../app.ts";
import { make } from "../dom.ts";
import { DEVICE, NUMBERS, PARAMETERS } from "../fields.ts";
import type { NumberName } from "../fields.ts";
import { MODEL, SCENE, SCENES } from "../scene.ts";
import { refusal } from "../state.ts";
import type { State } from "../state.ts";

const LARGEST = 100_000; // characters

/** State from a file's text, read as strictly as by the package; or the reason why it is refused. */
export function fromFile(text: string): Partial<State> | string {
  if (text.length > LARGEST) return `the file is longer than ${LARGEST} characters`;
  let table: Record<string, unknown>;
  try {
    table = parse(text);
  } catch (error) {
    return `the file is not TOML: ${String((error as Error).message).split("\n")[0] ?? ""}`;
  }
  const { scene = SCENES[0], ...given } = table;
  if (scene !== SCENE) return `it is of the scene "${String(scene).slice(0, 40)}": choose that first`;
  const names = Object.keys(given);
  const strange = names.find((name) => ![...PARAMETERS, ...DEVICE].includes(name as never));
  if (strange !== undefined) return `there is no parameter "${strange.slice(0, 40)}"; there are ${PARAMETERS.join(", ")}, or in SI units ${DEVICE.join(", ")}`;
  const device = DEVICE.filter((name) => name in table);
  const mixed = PARAMETERS.find((name) => name in table);
  if (device[0] && mixed) return `${mixed} does not go with ${device[0]} in SI units`;
  const missing = device[0] && DEVICE.find((name) => !(name in table) && !MODEL.OPTIONAL.includes(name));
  if (missing) return `${missing} is missing: it is given with the others in SI units`;
  const own: readonly NumberName[] = device[0] ? DEVICE : PARAMETERS;
  const state: Record<string, number | string> = { units: device[0] ? "device" : "dimensionless" };
  for (const name of own) {
    const value = name in table ? table[name] : NUMBERS[name].value;
    if (typeof value !== "number") return `${name} must be a number`;
    const wrong = refusal(name, value);
    if (wrong) return wrong;
    state[name] = value;
  }
  return state as Partial<State>;
}

/** A button that opens a file; what is refused is said beneath. */
export function fileControl(app: App): HTMLElement {
  const error = make("p", { class: "error", id: "file-error", role: "alert", hidden: true });
  const refuse = (why: string): void => {
    error.hidden = why === "";
    error.textContent = why && `The file was not taken: ${why}.`;
  };
  const input = make("input", { type: "file", id: "file", accept: ".toml", hidden: true });
  input.addEventListener("change", () => {
    const [file] = input.files ?? [];
    if (!file) return;
    const large = file.size > 4 * LARGEST;
    (large ? Promise.resolve(" ".repeat(LARGEST + 1)) : file.text()).then(
      (text) => {
        const taken = fromFile(text);
        refuse(typeof taken === "string" ? taken : app.change(taken));
      },
      () => refuse("it cannot be read"),
    );
    input.value = ""; // so that the same file can be opened again
  });
  const button = make("button", { type: "button", id: "open-file", "aria-describedby": "file-error", click: () => input.click() }, "Open a file (TOML)…");
  return make("div", { class: "file" }, button, input, error);
}
