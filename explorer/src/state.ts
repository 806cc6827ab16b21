// The state of the page: a flat record, read from a URL as strictly as from a file, and written to one.
import { CHOICES, DEVICE, NUMBERS, ORIGIN, PARAMETERS, field } from "./fields.ts";
import type { ChoiceName, NumberName, Origin, Parameter } from "./fields.ts";
import { dimensionless, problem, scales } from "./device.ts";
import { SCENE, stops } from "./scene.ts";

export type State = { [K in NumberName]: number } & { [K in ChoiceName]: string };

const numberNames = Object.keys(NUMBERS) as NumberName[];
const choiceNames = Object.keys(CHOICES) as ChoiceName[];

/** The scene at its default parameters: in that of the paper the case study as printed. */
export function defaults(): State {
  const state: Record<string, number | string> = {};
  for (const name of numberNames) state[name] = NUMBERS[name].value;
  for (const name of choiceNames) state[name] = CHOICES[name].value;
  return { ...(state as State), scene: SCENE };
}

const show = (value: number): string =>
  Math.abs(value) >= 1e5 || (value !== 0 && Math.abs(value) < 1e-3) ? value.toExponential() : String(value);

/** Message about a value of a field, or "" if it is allowed. */
export function refusal(name: NumberName, value: number): string {
  const { low, high, whole, symbol } = field(name);
  if (Number.isFinite(value) && value >= low && value <= high && (!whole || Number.isInteger(value))) return "";
  return `${symbol} must be ${whole ? "a whole number" : "a number"} from ${show(low)} to ${show(high)}`;
}

const PLAIN = /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d{1,3})?$/i;

/** A number written as a person writes it; NaN for anything else. */
export function read(text: string): number {
  const trimmed = text.trim().replace("−", "-");
  return trimmed.length <= 40 && PLAIN.test(trimmed) ? Number(trimmed) : NaN;
}

/** The dimensionless parameters, of a device where the state has one. */
export function parameters(state: State): Record<Parameter, number> {
  if (state.units === "device") return dimensionless(state);
  return Object.fromEntries(PARAMETERS.map((name) => [name, state[name]])) as Record<Parameter, number>;
}

/** The units of the start: the device's scales in m, m/s and s where the state has one, else 1. */
export function startScales(state: State): Record<Origin, number> {
  const { length, time } = state.units === "device" ? scales(state) : { length: 1, time: 1 };
  return { x_r: length, v_r: length / time, v_c: length / time, phase: time };
}

/** The start without units. */
export function startOf(state: State): Record<Origin, number> {
  const scale = startScales(state);
  return Object.fromEntries(ORIGIN.map((name) => [name, state[name] / scale[name]])) as Record<Origin, number>;
}

/** The same start in the units of another state. */
export function converted(state: State, other: State): Record<Origin, number> {
  const [start, scale] = [startOf(state), startScales(other)];
  return Object.fromEntries(ORIGIN.map((name) => [name, start[name] * scale[name]])) as Record<Origin, number>;
}

/** Message about a contradiction between the fields, or "". */
export function conflict(state: State): string {
  if (state.units === "device") {
    const wrong = problem(state);
    if (wrong) return wrong;
  }
  const p = parameters(state);
  for (const name of PARAMETERS) {
    const wrong = refusal(name, p[name]);
    if (wrong) return state.units === "device" ? `of this device ${wrong}` : wrong;
  }
  const gaps = stops(p).map(({ gap }) => gap);
  if (gaps.length > 1 && !gaps.some((gap) => gap > 0)) return "one gap at least must be above 0: the stops overlap";
  const period = ((2 * Math.PI) / p.omega) * startScales(state).phase;
  if (!(state.phase < period)) return `τ₀ must be a time in [0, ${state.units === "device" ? "2π/Ω" : "2π/ω"}) = [0, ${period.toPrecision(6)})`;
  if (!(state.d_from < state.d_to)) return "the diagram's first value must be below its last";
  if (state.units === "dimensionless" || state.view !== "motion")
    for (const end of [state.d_from, state.d_to]) {
      const wrong = refusal(state.d_x as Parameter, end);
      if (wrong) return `in the diagram ${wrong}`;
    }
  if (state.c_x === state.c_y) return "the chart's axes must be two";
  for (const [axis, low, high] of [
    [state.c_x, state.c_x0, state.c_x1],
    [state.c_y, state.c_y0, state.c_y1],
  ] as const) {
    if (!(low < high)) return "each axis of the chart must begin below its end";
    const wrong = refusal(axis as NumberName, low) || refusal(axis as NumberName, high);
    if (wrong) return `in the chart ${wrong}`;
  }
  if (state.c_by === "attractor" && !ofStarts(state)) return "attractors are told apart in a chart over two starts only";
  return "";
}

/** True if the chart is of starts of one system: only there coexisting motions can be distinguished. */
export const ofStarts = (state: State): boolean => includes(ORIGIN, state.c_x) && includes(ORIGIN, state.c_y);

/** The part of a URL after "#": what differs from the defaults. */
export function format(state: State): string {
  const plain = defaults();
  const device = state.units === "device";
  const parts: string[] = [];
  for (const name of choiceNames) if (state[name] !== CHOICES[name].value) parts.push(`${name}=${state[name]}`);
  for (const name of numberNames) {
    const idle = device ? includes(PARAMETERS, name) : includes(DEVICE, name);
    if (!idle && (state[name] !== plain[name] || (device && includes(DEVICE, name))))
      parts.push(`${name}=${String(state[name])}`);
  }
  return parts.join("&");
}

const includes = (names: readonly string[], name: string): boolean => names.includes(name);

export interface Parsed {
  state: State;
  /** Reason why the text was refused; the state is then the default. */
  refused: string;
}

/** The state that a URL's fragment describes. One wrong part, and all of it is refused. */
export function parse(fragment: string): Parsed {
  const state = defaults();
  const text = fragment.replace(/^#/, "");
  const refuse = (why: string): Parsed => ({ state: defaults(), refused: why });
  if (text === "") return { state, refused: "" };
  if (text.length > 4000) return refuse("the address is longer than 4000 characters");
  const seen = new Set<string>();
  for (const part of text.split("&")) {
    const [name = "", value, more] = part.split("=");
    if (value === undefined || more !== undefined) return refuse(`"${clip(part)}" is no name=value`);
    if (seen.has(name)) return refuse(`"${clip(name)}" is given twice`);
    seen.add(name);
    if (Object.hasOwn(NUMBERS, name)) {
      const wrong = refusal(name as NumberName, read(value));
      if (wrong) return refuse(`${clip(name)}=${clip(value)}: ${wrong}`);
      state[name as NumberName] = read(value);
    } else if (Object.hasOwn(CHOICES, name)) {
      const { of } = CHOICES[name as ChoiceName];
      if (!includes(of, value)) return refuse(`${name}=${clip(value)}: must be one of ${of.join(", ")}`);
      state[name as ChoiceName] = value;
    } else return refuse(`there is no "${clip(name)}"`);
  }
  const mixed = [...seen].find((name) => includes(state.units === "device" ? PARAMETERS : DEVICE, name));
  if (mixed) return refuse(`${mixed} does not go with units=${state.units}`);
  const wrong = conflict(state);
  return wrong ? refuse(wrong) : { state, refused: "" };
}

const clip = (text: string): string => (text.length > 40 ? `${text.slice(0, 40)}…` : text);
