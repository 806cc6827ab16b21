// A device in SI units: its scales and its dimensionless parameters, by the relations that the scene declares.
import { DEFAULTS } from "./fields.ts";
import { MODEL } from "./scene.ts";
import type { Device, Parameter } from "./scene.ts";

export interface Scales {
  /** N, s and m: the units of force, time and length. */
  force: number;
  time: number;
  length: number;
}

export function scales(d: Device): Scales {
  const { friction_force, natural_frequency, length_scale } = MODEL.related(d);
  return { force: friction_force, time: 1 / natural_frequency, length: length_scale };
}

/** A unit in which something is shown: what the number without units is multiplied by, and its name. */
export interface Unit {
  factor: number;
  name: string;
}
export type Units = Record<"length" | "velocity" | "time" | "energy", Unit>;

const NONE: Unit = { factor: 1, name: "" };
export const PLAIN_UNITS: Units = { length: NONE, velocity: NONE, time: NONE, energy: NONE };

/** The units in which a device's motion is shown. */
export function unitsOf(d: Device): Units {
  const { force, time, length } = scales(d);
  return {
    length: { factor: 1e3 * length, name: "mm" },
    velocity: { factor: (1e3 * length) / time, name: "mm/s" },
    time: { factor: time, name: "s" },
    energy: { factor: 1e3 * force * length, name: "mJ" },
  };
}

/** A name with its unit, if it has one. */
export const withUnit = (name: string, unit: Unit): string => (unit.name ? `${name} (${unit.name})` : name);

export const dimensionless = (d: Device): Record<Parameter, number> => ({ ...DEFAULTS, ...MODEL.related(d).ratios });

/** Message if the device's scales cannot be represented, else "". */
export function problem(d: Device): string {
  const { force, time, length } = scales(d);
  const fine = [force, time, length].every((value) => Number.isFinite(value) && value > 0);
  return fine ? "" : "the device's scales of force, time and length must be finite and > 0";
}
