// The scene that is shown: the address names it, and a page, with its workers, is of one scene until it is loaded again.
import * as capsule from "./models/capsule.ts";
import * as prototype from "./models/prototype.ts";
import * as reaction from "./models/reaction.ts";
import * as reaction_pulse from "./models/reaction_pulse.ts";
import * as slope from "./models/slope.ts";

/** Parameters that all scenes have; others are met by their part in the model, or in a list of all. */
export type Parameter = "alpha" | "omega" | "zeta" | "gamma";
/** Likewise for a device. */
export type Quantity = "M_m" | "M_c" | "k1" | "c" | "Omega";
export type Device = Record<Quantity, number>;

export interface OwnField {
  kind: "number";
  low: number;
  high: number;
  value: number;
  symbol: string;
  name: string;
  about: string;
  slider: readonly [number, number, number];
  unit?: string;
}

/** Generated facts of a scene. */
interface Model extends Pick<typeof capsule, "STOPS" | "OUTCOMES" | "STATE_SIZE" | "SEGMENT_SIZE" | "stateAt" | "segmentAt" | "motionAt"> {
  ABOUT: string;
  FIELDS: Record<number, { contact: number; drift: number; level: number }>;
  MODES: readonly string[];
  SPRINGS: readonly (readonly [gap: Parameter, stiffness: Parameter])[];
  BOUNDS: Record<string, Parameter>;
  LOAD: Parameter | "";
  PULSES: readonly [] | readonly [high: Parameter, low: Parameter, share: Parameter];
  REACTS: boolean;
  PLACES: Record<string, string>;
  PARAMETERS: readonly Parameter[];
  PARAMETER_FIELDS: Record<Parameter, OwnField>;
  DEVICE: readonly Quantity[];
  DEVICE_FIELDS: Record<Quantity, OwnField>;
  OPTIONAL: readonly string[];
  related(d: Device): { friction_force: number; natural_frequency: number; length_scale: number; ratios: Record<Parameter, number> };
}

const MODELS = { capsule, slope, prototype, reaction, reaction_pulse } as unknown as Record<string, Model>;
export const SCENES = Object.keys(MODELS);
/** Descriptions of the scenes, each in a sentence. */
export const ABOUT = (scene: string): string => MODELS[scene]?.ABOUT ?? "";

/** The scene that an address names, the first one where it names none that is there. */
export function sceneOf(fragment: string): string {
  const named = /(?:^|[#&])scene=(\w+)/.exec(fragment)?.[1] ?? "";
  return SCENES.includes(named) ? named : (SCENES[0] ?? "");
}

// A worker has it as its name.
const asked = "document" in globalThis ? location.hash : (globalThis as { name?: string }).name;
export const SCENE = sceneOf(asked ?? "");
export const MODEL = MODELS[SCENE] ?? (capsule as unknown as Model);
export const { PARAMETERS, DEVICE, PULSES, REACTS, MODES, STOPS, OUTCOMES } = MODEL;

/** The stops: their distance, stiffness and side, 1 in front and -1 behind, at some parameters. */
export const stops = (p: Record<Parameter, number>): { gap: number; stiffness: number; side: number; symbol: string }[] =>
  MODEL.SPRINGS.map(([gap, stiffness], i) => ({
    gap: p[gap], stiffness: p[stiffness], side: i ? -1 : 1, symbol: `${i ? "−" : ""}${MODEL.PARAMETER_FIELDS[gap].symbol}`,
  }));

/** Largest friction against drift in a direction, 1 or -1. */
export const bound = (p: Record<Parameter, number>, way: number): number => p[MODEL.BOUNDS[String(way)] ?? "alpha"];

/** The drive at a share of its period. */
export function driveAt(p: Record<Parameter, number>, share: number): number {
  const [high, low, part] = PULSES;
  return high && low && part ? p[share < p[part] ? high : low] : p.alpha * Math.cos(2 * Math.PI * share);
}

/** Direction in which drive and load drag the device without end, so that nothing is periodic; 0 if friction holds their mean. */
export function dragged(p: Record<Parameter, number>): number {
  const [high, low, part] = PULSES;
  const mean = high && low && part ? p[part] * p[high] + (1 - p[part]) * p[low] : 0;
  const force = (REACTS ? 0 : mean) - (MODEL.LOAD ? p[MODEL.LOAD] : 0);
  return force > bound(p, 1) ? 1 : force < -bound(p, -1) ? -1 : 0;
}

/** The drive's largest size. */
export const highest = (p: Record<Parameter, number>): number => Math.max(...[PULSES[0] ?? "alpha", PULSES[1] ?? "alpha"].map((name) => Math.abs(p[name as Parameter])));

/** Phases at which the drive jumps: its rise and its fall. */
export const edges = (p: Record<Parameter, number>): number[] => (PULSES[2] ? [0, p[PULSES[2]]] : []);

/** Largest of the gaps that a device of this kind has: motions are so wide. */
export const REACH = Math.max(2, ...MODEL.SPRINGS.map(([gap]) => Math.ceil(MODEL.PARAMETER_FIELDS[gap].value)));
